// make_scene_docs FOLDER [--check]: writes FOLDER/scene.schema.json and the tables of keys in
// FOLDER/README.md (between its two marks) as scene_fields.h has them. With --check nothing is
// written; fails when a file differs.

#include "avatar/io/atomic_file.h"
#include "src/scene/scene_documents.h"

#include <cstdio>
#include <exception>
#include <fstream>
#include <sstream>
#include <stdexcept>
#include <string>
#include <vector>

namespace {

struct Document {
  std::string path;
  std::string text;
};

std::string fileText(const std::string& path) {
  std::ostringstream text;
  text << std::ifstream(path, std::ios::binary).rdbuf();
  return text.str();
}

/// The text with what stands between the marks replaced.
std::string withTables(const std::string& readme, const std::string& tables) {
  const std::string beginMark = "<!-- keys: made by make_scene_docs, don't edit -->\n";
  const std::string endMark = "<!-- end of keys -->";
  const std::size_t begin = readme.find(beginMark);
  const std::size_t end = readme.find(endMark);
  if (begin == std::string::npos || end == std::string::npos || end < begin)
    throw std::runtime_error("README.md has lost its marks " + beginMark + endMark);
  return readme.substr(0, begin + beginMark.size()) + "\n" + tables + "\n" + readme.substr(end);
}

std::vector<Document> documents(const std::string& folder) {
  const simulcap::SceneTable& table = simulcap::sceneTable();
  const std::string readme = folder + "/README.md";
  return {
      {folder + "/scene.schema.json", simulcap::sceneSchema(table)},
      {readme, withTables(fileText(readme), simulcap::sceneKeyTables(table))}};
}

bool isCurrent(const Document& document) {
  if (fileText(document.path) == document.text)
    return true;
  std::fprintf(
      stderr,
      "%s differs from src/scene/scene_fields.h; run make_scene_docs on its folder\n",
      document.path.c_str());
  return false;
}

}  // namespace

int main(int argc, char** argv) {
  const std::vector<std::string> arguments(argv + 1, argv + argc);
  const bool check = arguments.size() == 2 && arguments[1] == "--check";
  if (arguments.size() != 1 && !check) {
    std::fputs("usage: make_scene_docs FOLDER [--check]\n", stderr);
    return 2;
  }
  try {
    bool current = true;
    for (const Document& document : documents(arguments[0])) {
      if (check)
        current = isCurrent(document) && current;
      else
        avatar::writeFileAtomically(document.path, document.text);
    }
    return current ? 0 : 1;
  } catch (const std::exception& error) {
    std::fprintf(stderr, "make_scene_docs: %s\n", error.what());
    return 1;
  }
}
