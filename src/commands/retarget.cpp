#include "avatar/default_body/embedded_body.h"
#include "avatar/io/atomic_file.h"
#include "avatar/io/avatar_file.h"
#include "avatar/retargeting/retargeting.h"
#include "src/commands/body_input.h"
#include "src/commands/commands.h"
#include "src/commands/scene_simulation.h"
#include "src/output/named_pose.h"
#include "src/program/console.h"
#include "src/simulation/motion_source.h"

#include <CLI/CLI.hpp>
#include <nlohmann/json.hpp>

#include <cstdio>
#include <filesystem>
#include <memory>

namespace simulcap {
namespace {

struct RetargetCommandOptions {
  std::string avatar;
  std::vector<std::string> bodies;
  std::vector<std::string> shapes;
  std::vector<std::string> motion;
  std::string upAxis;
  std::string pose = "apose";
  double seconds = 2.0;
  bool keepSize = false;
  std::string output;
};

/// Somebody to be dressed.
struct Target {
  std::string label;
  std::string model;  ///< "default" or a file
  Eigen::VectorXd betas;
};

std::string stemOf(const std::string& file) {
  return std::filesystem::path(file).stem().string();
}

/// The bodies of `--body`, each in the shapes of `--betas`; another avatar's in its own.
std::vector<Target> targets(
    const RetargetCommandOptions& options, const avatar::LayeredAvatar& source) {
  std::vector<std::string> bodies = options.bodies;
  if (bodies.empty())
    bodies.push_back(source.body.model);
  std::vector<Target> found;
  for (const std::string& body : bodies) {
    if (body.ends_with(".glb") && options.shapes.empty()) {
      const avatar::AvatarBody other = avatar::readAvatar(body).body;
      found.push_back({stemOf(body), other.model, other.betas});
      continue;
    }
    const std::string file = body.ends_with(".glb") ? avatar::readAvatar(body).body.model : body;
    const avatar::BodyModel model = avatar::loadBody(file);
    for (const NamedShape& shape : parseShapes(options.shapes, model)) {
      const std::string name = stemOf(body);
      const bool several = bodies.size() > 1 && !shape.label.empty();
      found.push_back(
          {several || shape.label.empty() ? name + (several ? "_" + shape.label : "") : shape.label,
           file,
           shape.betas});
    }
  }
  return found;
}

nlohmann::json reportOf(const Target& target, const avatar::RetargetedAvatar& dressed) {
  nlohmann::json garments = nlohmann::json::array();
  for (const avatar::RetargetedGarment& garment : dressed.garments)
    garments.push_back(
        {{"name", garment.name},
         {"ease_change_mm",
          {{"mean", 1000.0 * garment.meanEaseChange}, {"p95", 1000.0 * garment.p95EaseChange}}},
         {"edge_change_p95", garment.p95EdgeChange},
         {"vertices_moved", garment.movedVertices},
         {"vertices_without_room", garment.verticesBelow}});
  nlohmann::json report = {
      {"target", target.label},
      {"body", target.model},
      {"betas", std::vector<double>(target.betas.begin(), target.betas.end())},
      {"same_topology", dressed.sameTopology},
      {"garments", garments}};
  if (!dressed.sameTopology)
    report["registration_mm"] = {
        {"mean", 1000.0 * dressed.registration.mean},
        {"p95", 1000.0 * dressed.registration.p95},
        {"max", 1000.0 * dressed.registration.max}};
  return report;
}

Scene sceneFor(
    const RetargetCommandOptions& options,
    const Target& target,
    const avatar::LayeredAvatar& dressed) {
  SceneBody body;
  body.model = target.model;
  body.betas = std::vector<double>(target.betas.begin(), target.betas.end());
  body.motion = options.motion;
  body.pose = options.pose;
  if (!options.upAxis.empty())
    body.upAxis = options.upAxis == "z" ? avatar::UpAxis::kZ : avatar::UpAxis::kY;
  SceneTime time;
  if (options.motion.empty())
    time.seconds = options.seconds;
  return sceneOf(dressed, body, time);
}

nlohmann::json dressTarget(
    const RetargetCommandOptions& options,
    const avatar::LayeredAvatar& source,
    const Target& target,
    const std::filesystem::path& folder,
    const CommandContext& context) {
  const avatar::BodyModel model = avatar::loadBody(target.model);
  avatar::RetargetedAvatar dressed = avatar::retargeted(
      source,
      model,
      target.betas,
      options.keepSize ? avatar::GarmentSize::kKept : avatar::GarmentSize::kGraded);
  dressed.avatar.body.model = target.model;
  const nlohmann::json report = reportOf(target, dressed);
  const Scene scene = sceneFor(options, target, dressed.avatar);
  nlohmann::json metrics =
      simulateStage(scene, setStage(scene, std::move(dressed.avatar)), folder, context);
  metrics["input"] = options.avatar;
  metrics["retargeting"] = report;
  writeMetrics(folder, metrics);
  return metrics;
}

void sayResult(const Target& target, const nlohmann::json& metrics, const Console& console) {
  double ease = 0.0;
  for (const nlohmann::json& garment : metrics["retargeting"]["garments"])
    ease = std::max(ease, garment["ease_change_mm"]["mean"].get<double>());
  char text[200];
  std::snprintf(
      text,
      sizeof text,
      "%-20s under the skin %.4f %%  strain p95 %.1f %%  ease changed by %.1f mm (mean)",
      target.label.c_str(),
      100.0 * metrics["penetration"]["fraction"].get<double>(),
      100.0 * metrics["edge_strain"]["p95"].get<double>(),
      ease);
  console.result(text);
}

void retarget(const RetargetCommandOptions& options, const CommandContext& context) {
  const avatar::LayeredAvatar source = avatar::readAvatar(options.avatar);
  if (source.garments.empty())
    throw std::runtime_error(options.avatar + ": the avatar wears nothing");
  const std::vector<Target> all = targets(options, source);
  nlohmann::json summary = nlohmann::json::array();
  for (const Target& target : all) {
    std::filesystem::path folder(options.output);
    if (all.size() > 1)
      folder /= target.label;
    context.console.info("dressing " + target.label);
    const nlohmann::json metrics = dressTarget(options, source, target, folder, context);
    sayResult(target, metrics, context.console);
    summary.push_back(metrics);
  }
  if (all.size() > 1)
    avatar::writeFileAtomically(
        std::filesystem::path(options.output) / "retarget.json", summary.dump(1) + "\n");
}

void addTargetOptions(CLI::App& verb, RetargetCommandOptions& options) {
  verb.add_option(
          "--body",
          options.bodies,
          "Whom to dress: 'default', a body model .npz or another avatar .glb; repeat for several "
          "(default: the avatar's own body model)")
      ->expected(1)
      ->multi_option_policy(CLI::MultiOptionPolicy::TakeAll)
      ->allow_extra_args(false)
      ->type_name("BODY");
  addShapeOption(verb, options.shapes, "targets");
  verb.add_flag(
      "--keep-size",
      options.keepSize,
      "The very garments, tight or loose as they are there, instead of graded ones");
  verb.add_option(
          "--motion",
          options.motion,
          "Built-in clips (" + clipList() + ") and .npz or .bvh files, one after the other")
      ->delimiter(',');
  verb.add_option("--up", options.upAxis, "Up axis of motion files (default: what they say)")
      ->check(CLI::IsMember({"y", "z"}));
  verb.add_option("--pose", options.pose, "Pose to settle in when there is no motion")
      ->check(CLI::IsMember(namedPoses()))
      ->capture_default_str();
  verb.add_option("--seconds", options.seconds, "Time to settle when there is no motion [s]")
      ->check(CLI::Range(0.1, 600.0))
      ->capture_default_str();
}

}  // namespace

void addRetarget(CLI::App& program, ChosenCommand& chosen) {
  CLI::App* verb = program.add_subcommand(
      "retarget",
      "An avatar's clothes on other bodies, graded or in their own size, and simulated");
  const auto options = std::make_shared<RetargetCommandOptions>();
  verb->add_option("AVATAR", options->avatar, "Avatar whose clothes are worn (.glb)")->required();
  addTargetOptions(*verb, *options);
  verb->add_option(
          "-o,--output", options->output, "Folder to write to; one in it per target if several")
      ->required();
  verb->callback([options, &chosen] {
    chosen = [options](const CommandContext& context) { retarget(*options, context); };
  });
}

}  // namespace simulcap
