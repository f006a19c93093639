#include "src/report/report_input.h"

#include "avatar/default_body/embedded_body.h"
#include "avatar/io/avatar_file.h"
#include "avatar/io/file_error.h"
#include "src/evaluation/camera_file.h"

#include <filesystem>
#include <fstream>
#include <sstream>
#include <stdexcept>

namespace simulcap {
namespace {

namespace fs = std::filesystem;

std::string within(const std::string& folder, const char* name) {
  return (fs::path(folder) / name).string();
}

std::string textOf(const std::string& path) {
  std::ifstream file(path, std::ios::binary);
  if (!file)
    throw avatar::FileError(path, "", "can't be read");
  std::ostringstream text;
  text << file.rdbuf();
  return text.str();
}

std::optional<std::string> textIfThere(const std::string& path) {
  if (!fs::is_regular_file(path))
    return std::nullopt;
  return textOf(path);
}

nlohmann::json documentOf(const std::string& path) {
  nlohmann::json document = nlohmann::json::parse(textOf(path), nullptr, false);
  if (!document.is_object())
    throw avatar::FileError(path, "", "is no JSON object; write it anew or take it away");
  return document;
}

/// The result of another verb, as given or beside the others; nothing where there is none.
std::optional<nlohmann::json> resultOf(
    const std::string& given, const std::string& beside, const char* key) {
  if (given.empty() && !fs::exists(beside))
    return std::nullopt;
  const std::string path = given.empty() ? beside : given;
  nlohmann::json document = documentOf(path);
  const auto list = document.find(key);
  if (list == document.end() || !list->is_array())
    throw avatar::FileError(path, key, "missing, or no list; expected what simulcap writes");
  return document;
}

/// What metrics.json says was captured or simulated; empty when it says nothing.
std::string inputOf(const ReportInput& input) {
  const auto found = input.metrics.find("input");
  if (found == input.metrics.end())
    return "";
  if (!found->is_string())
    throw avatar::FileError(
        within(input.folder, "metrics.json"), "input", "is no text; write it anew or take it away");
  return found->get<std::string>();
}

PerformanceReader openPerformance(const std::string& folder) {
  if (!fs::is_directory(folder))
    throw avatar::FileError(
        folder, "", "is no folder; expected a capture's or simulation's output");
  const std::string path = within(folder, "performance.npz");
  if (!fs::exists(path))
    throw avatar::FileError(
        path, "", "missing; expected the output folder of a finished capture or simulation");
  return PerformanceReader(path);
}

void requireSameMeshes(const ReportInput& input) {
  for (const PerformanceLayout::Garment& garment : input.performance.layout().garments)
    for (const avatar::Garment& candidate : input.avatar->garments)
      if (candidate.name == garment.name && (candidate.mesh.numVertices() != garment.numVertices ||
                                             candidate.mesh.faces != garment.faces))
        throw avatar::FileError(
            within(input.folder, "avatar.glb"),
            "garment " + garment.name,
            "of another mesh than in performance.npz: they are not of one run");
}

void openAvatar(ReportInput& input) {
  const std::string path = within(input.folder, "avatar.glb");
  if (!fs::exists(path))
    return;
  input.avatar = avatar::readAvatar(path);
  requireSameMeshes(input);
  std::shared_ptr<const avatar::BodyModel> model;
  try {
    model = std::make_shared<avatar::BodyModel>(avatar::loadBody(input.avatar->body.model));
  } catch (const avatar::FileError& error) {
    input.notes.push_back(
        std::string("the body is shown without pose blend shapes: ") + error.what());
  }
  input.body.emplace(input.avatar->body, std::move(model));
}

/// gt/ beside the recording.
void openTruth(const std::string& recording, ReportInput& input) {
  const std::string folder = within(recording, "gt");
  if (!fs::is_directory(folder))
    return;
  try {
    input.truth = std::make_unique<GroundTruth>(folder, "");
    if (input.truth->garments().empty() || input.truth->numFrames() < 1)
      input.truth.reset();
  } catch (const avatar::FileError& error) {
    input.notes.push_back(std::string("the truth is not shown: ") + error.what());
  }
}

void openSeen(const ReportOptions& options, ReportInput& input) {
  const std::string camera = within(input.folder, "camera.json");
  if (!fs::exists(camera)) {
    if (!options.recording.empty())
      throw avatar::FileError(
          camera, "", "missing: a recording can only be shown with the camera of its capture");
    return;
  }
  std::string folder = options.recording;
  if (folder.empty()) {
    folder = inputOf(input);
    if (folder.empty() || !fs::is_directory(folder)) {
      input.notes.push_back(
          "without camera view and depth: the recording " + folder +
          " isn't there any more; say where it is with --recording");
      return;
    }
  }
  input.recording = std::make_unique<SeenRecording>(folder, readCameraFromWorld(camera));
  openTruth(folder, input);
}

/// The scene of a simulation, as metrics.json names it.
void readScene(ReportInput& input) {
  const std::string path = inputOf(input);
  if (fs::path(path).extension() != ".json")
    return;
  input.scene = textIfThere(path);
  if (!input.scene)
    input.notes.push_back("without the scene: " + path + " isn't there any more");
}

}  // namespace

void ReportOptions::validate() const {
  if (maxFrames < 1 || maxFrames > 10000)
    throw std::invalid_argument("ReportOptions: maxFrames must be 1 to 10000");
  if (threads < 1)
    throw std::invalid_argument("ReportOptions: threads must be 1 or more");
}

std::unique_ptr<ReportInput> openPerformed(const std::string& folder) {
  std::unique_ptr<ReportInput> input(
      new ReportInput{.folder = folder, .performance = openPerformance(folder)});
  if (input->performance.numFrames() == 0)
    throw avatar::FileError(within(folder, "performance.npz"), "poses", "has no frames");
  openAvatar(*input);
  return input;
}

std::unique_ptr<ReportInput> openReportInput(
    const std::string& folder, const ReportOptions& options) {
  options.validate();
  std::unique_ptr<ReportInput> input = openPerformed(folder);
  const std::string metrics = within(folder, "metrics.json");
  input->metrics = fs::exists(metrics) ? documentOf(metrics) : nlohmann::json::object();
  if (!fs::exists(metrics))
    input->notes.emplace_back("without figures: there is no metrics.json");
  input->comparison = resultOf(options.comparison, within(folder, "compare.json"), "runs");
  input->stability = resultOf(options.stability, within(folder, "stability.json"), "grid");
  input->timing = textIfThere(within(folder, "timing.csv"));
  openSeen(options, *input);
  readScene(*input);
  return input;
}

}  // namespace simulcap
