#include "src/scene/scene_file.h"

#include "avatar/io/file_error.h"
#include "src/scene/scene_binder.h"
#include "src/scene/scene_check.h"
#include "src/scene/scene_json.h"
#include "src/scene/scene_rules.h"

#include <nlohmann/json.hpp>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <sstream>

namespace simulcap {
namespace {

namespace fs = std::filesystem;

std::string readText(const std::string& path) {
  // Long lists of pins fit ten times; a mesh or a video, named by mistake, doesn't get read.
  constexpr std::uintmax_t kMaxBytes = 4 << 20;
  std::error_code error;
  if (!fs::is_regular_file(path, error))
    throw avatar::FileError(path, "", "no such file; expected a scene (.json)");
  if (fs::file_size(path, error) > kMaxBytes)
    throw avatar::FileError(path, "", "is larger than 4 MB, so it is no scene");
  std::ifstream file(path, std::ios::binary);
  if (!file)
    throw avatar::FileError(path, "", "can't be read; check its permissions");
  std::ostringstream text;
  text << file.rdbuf();
  return text.str();
}

/// Keys can hold any character; messages stay one printable line.
std::string printable(std::string text) {
  std::replace_if(
      text.begin(), text.end(), [](char c) { return (c >= 0 && c < ' ') || c == 0x7f; }, '?');
  return text;
}

}  // namespace

Scene readScene(const std::string& path) {
  const std::string text = readText(path);
  try {
    const nlohmann::json document = parseSceneJson(text);
    checkAgainstTable(document, sceneTable());
    Scene scene = sceneFromJson(document);
    applySceneRules(scene, fs::path(path).parent_path());
    return scene;
  } catch (const SceneProblem& problem) {
    throw avatar::FileError(path, printable(problem.where), printable(problem.what()));
  }
}

}  // namespace simulcap
