#include "avatar/default_body/embedded_body.h"
#include "avatar/io/atomic_file.h"
#include "avatar/motion_clips.h"
#include "avatar/skinning.h"
#include "src/commands/body_sheet.h"
#include "src/commands/commands.h"
#include "src/commands/measure_table.h"
#include "src/commands/motion_input.h"
#include "src/output/image_file.h"
#include "src/output/named_pose.h"
#include "src/program/console.h"
#include "src/program/machine.h"
#include "src/program/version.h"

#include <CLI/CLI.hpp>
#include <nlohmann/json.hpp>

#include <algorithm>
#include <chrono>
#include <filesystem>
#include <memory>

namespace simulcap {
namespace {

constexpr int kFramesPerClip = 8;

struct DemoOptions {
  std::string output = "out/demo";
};

/// One file of the demo's folder.
struct DemoPicture {
  std::string file;
  std::string title;
};

std::vector<BodyView> views(std::initializer_list<const char*> names) {
  std::vector<BodyView> chosen;
  chosen.reserve(names.size());
  for (const char* name : names)
    chosen.push_back(bodyView(name));
  return chosen;
}

/// The default body with everything the demo asks of it.
class DemoBody {
 public:
  explicit DemoBody(const CommandContext& context)
      : model_(avatar::defaultBody()), person_(model_), skinning_(model_), context_(context) {}

  ContactSheet shapes() const {
    BodySheetRequest request;
    request.views = views({"front", "three-quarter", "side", "back"});
    request.picture = {.width = 240, .height = 320};
    for (const avatar::BodyPreset& preset : avatar::bodyPresets())
      request.bodies.push_back(body(preset, preset.name, "apose"));
    return bodySheet(person_, request, context_);
  }

  ContactSheet poses() const {
    BodySheetRequest request;
    request.views = views({"front", "three-quarter", "side", "back"});
    request.picture = {.width = 300, .height = 300};
    for (const std::string& pose : namedPoses())
      request.bodies.push_back(body(avatar::bodyPresets().front(), pose, pose));
    return bodySheet(person_, request, context_);
  }

  ContactSheet details() const {
    BodySheetRequest request;
    request.views = views({"face", "face-side", "hand", "foot"});
    request.picture = {.width = 300, .height = 300};
    for (const avatar::BodyPreset& preset : avatar::bodyPresets())
      request.bodies.push_back(body(preset, preset.name, "tpose"));
    return bodySheet(person_, request, context_);
  }

  /// A row per built-in clip, moments of it from left to right.
  ContactSheet motions() const {
    const avatar::ShapedBody shaped = skinning_.shape(avatar::bodyPresets().front().betas);
    ContactSheet sheet;
    std::vector<PicturedBody> bodies;
    for (const std::string_view clip : avatar::clipNames()) {
      const MotionRequest request{.source = std::string(clip)};
      for (const LabelledPose& pose :
           motionPoses(request, shaped, kFramesPerClip, context_.console))
        bodies.push_back({pose.label, skinning_.pose(shaped, pose.pose).vertices});
      sheet.rowLabels.emplace_back(clip);
    }
    for (int i = 0; i < kFramesPerClip; ++i)
      sheet.columnLabels.push_back(std::to_string(100 * i / (kFramesPerClip - 1)) + " %");

    const BodyView& view = bodyView("three-quarter");
    const std::vector<Eigen::AlignedBox3d> boxes =
        framingBoxes(bodies, verticesOfJoints(model_.skinningWeights, {}), true);
    std::vector<SheetPanel> panels;
    for (std::size_t i = 0; i < bodies.size(); ++i)
      panels.push_back({bodies[i], view, boxes[i]});
    sheet.panels = pictures(person_, panels, {.width = 180, .height = 220}, context_);
    return sheet;
  }

  std::string measures() const {
    std::vector<MeasuredBody> bodies;
    for (const avatar::BodyPreset& preset : avatar::bodyPresets())
      bodies.push_back(measured(preset.name, model_, skinning_.shape(preset.betas)));
    return measureTable(bodies);
  }

  /// Times of posing and of rendering one picture on one thread [ms].
  nlohmann::json timings() const {
    const avatar::ShapedBody shaped = skinning_.shape(avatar::bodyPresets().front().betas);
    const avatar::BodyPose pose = namedPose("squat");
    const auto posed = skinning_.pose(shaped, pose);
    const PicturedBody pictured{"", posed.vertices};
    const Eigen::AlignedBox3d box =
        framingBoxes({pictured}, verticesOfJoints(model_.skinningWeights, {}), false).front();
    const PictureOptions size{.width = 640, .height = 480, .supersampling = 1};
    return {
        {"posing", timed([&] { skinning_.pose(shaped, pose); })},
        {"picture_640x480",
         timed([&] { picture(person_, pictured, bodyView("front"), box, size); })}};
  }

 private:
  PicturedBody body(
      const avatar::BodyPreset& preset, const std::string& label, const std::string& pose) const {
    return {label, skinning_.pose(skinning_.shape(preset.betas), namedPose(pose)).vertices};
  }

  template <typename Work>
  static nlohmann::json timed(const Work& work) {
    using Clock = std::chrono::steady_clock;
    std::vector<double> milliseconds(50);
    for (double& time : milliseconds) {
      const Clock::time_point start = Clock::now();
      work();
      time = std::chrono::duration<double, std::milli>(Clock::now() - start).count();
    }
    std::sort(milliseconds.begin(), milliseconds.end());
    return {
        {"median", milliseconds[milliseconds.size() / 2]},
        {"p95", milliseconds[milliseconds.size() * 95 / 100]}};
  }

  const avatar::BodyModel& model_;
  PicturedPerson person_;
  avatar::Skinning skinning_;
  const CommandContext& context_;
};

std::string report(const std::vector<DemoPicture>& pictures, const std::string& table) {
  std::string html =
      "<!DOCTYPE html>\n<html lang=\"en\"><meta charset=\"utf-8\"><title>simulcap demo</title>\n"
      "<style>body{font-family:sans-serif;margin:2em}img{max-width:100%}</style>\n"
      "<h1>simulcap " +
      std::string(kVersion) + ": the built-in body</h1>\n";
  for (const DemoPicture& picture : pictures)
    html += "<h2>" + picture.title + "</h2>\n<img src=\"" + picture.file + "\" alt=\"" +
            picture.title + "\">\n";
  return html + "<h2>Measures</h2>\n<pre>" + table + "</pre>\n</html>\n";
}

nlohmann::json metrics(const nlohmann::json& timings, const CommandContext& context) {
  return {
      {"program", std::string("simulcap ") + kVersion},
      {"input", "default"},
      {"machine", {{"cpu", cpuName()}, {"threads", context.threads}}},
      {"timing_ms", timings}};
}

std::string milliseconds(const nlohmann::json& time) {
  char text[32];
  std::snprintf(text, sizeof text, "%.2f ms", time.at("median").get<double>());
  return text;
}

void demo(const DemoOptions& options, const CommandContext& context) {
  const std::filesystem::path folder(options.output);
  const DemoBody body(context);
  const std::vector<DemoPicture> pictures = {
      {"shapes.png", "Shapes"},
      {"motions.png", "Motions"},
      {"poses.png", "Poses"},
      {"details.png", "Face, hand and foot"}};
  writePng(folder / "shapes.png", composed(body.shapes()));
  writePng(folder / "motions.png", composed(body.motions()));
  writePng(folder / "poses.png", composed(body.poses()));
  writePng(folder / "details.png", composed(body.details()));

  const std::string table = body.measures();
  avatar::writeFileAtomically(folder / "report.html", report(pictures, table));
  const nlohmann::json timings = body.timings();
  avatar::writeFileAtomically(folder / "metrics.json", metrics(timings, context).dump(1) + "\n");

  context.console.result(table);
  context.console.result(
      "posing the body: " + milliseconds(timings["posing"]) + ", a picture of 640x480: " +
      milliseconds(timings["picture_640x480"]) + " (medians of 50, one thread)");
  context.console.result("Open " + (folder / "report.html").string() + " in a browser.");
}

}  // namespace

void addDemo(CLI::App& program, ChosenCommand& chosen) {
  CLI::App* verb = program.add_subcommand(
      "demo", "Pictures and measures of the built-in body: its shapes, poses and motions");
  const auto options = std::make_shared<DemoOptions>();
  verb->add_option("-o,--output", options->output, "Folder to write to")->capture_default_str();
  verb->callback([options, &chosen] {
    chosen = [options](const CommandContext& context) { demo(*options, context); };
  });
}

}  // namespace simulcap
