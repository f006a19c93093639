#include "src/commands/person_input.h"

#include "avatar/default_body/embedded_body.h"
#include "avatar/io/avatar_file.h"
#include "avatar/io/file_error.h"
#include "avatar/io/motion_file.h"
#include "bullet_ext/core/cloth_material.h"
#include "src/digitization/rest_shape.h"
#include "src/evaluation/camera_file.h"
#include "src/evaluation/posed_avatar.h"
#include "src/program/console.h"
#include "src/program/interruption.h"

#include <CLI/CLI.hpp>

#include <filesystem>
#include <utility>

namespace simulcap {
namespace {

namespace fs = std::filesystem;

/// `camera` is beside the poses where it isn't given.
std::optional<KnownPoses> readPoses(const PersonOptions& options) {
  if (options.poses.empty())
    return std::nullopt;
  const std::string camera = options.camera.empty()
                                 ? (fs::path(options.poses).parent_path() / "camera.json").string()
                                 : options.camera;
  return KnownPoses{avatar::readMotion(options.poses).motion, readCameraFromWorld(camera)};
}

}  // namespace

void addPersonOptions(CLI::App& verb, PersonOptions& options) {
  verb.add_option(
          "--avatar", options.avatar, "The person, dressed (.glb, as dress or digitize makes it)")
      ->type_name("FILE");
  verb.add_option(
          "--body",
          options.body,
          "'default' or the body model .npz of the avatar (default: as the avatar says)")
      ->type_name("BODY");
  verb.add_option(
          "--material", options.material, "The paper's cloth for all garments (default: their own)")
      ->check(CLI::IsMember({"soft", "middle", "hard"}));
  verb.add_option("--first", options.range.first, "First frame, counted from 0")
      ->check(CLI::Range(0, 100000000))
      ->type_name("N")
      ->capture_default_str();
  verb.add_option("--frames", options.range.count, "Number of frames (default: all that follow)")
      ->check(CLI::Range(1, 100000000))
      ->type_name("N");
}

void addPosesOptions(CLI::App& verb, PersonOptions& options) {
  verb.add_option(
          "--poses",
          options.poses,
          "Known poses, AMASS-style .npz with a frame per frame number of SEQ, instead of tracking")
      ->type_name("FILE");
  verb.add_option(
          "--camera",
          options.camera,
          "camera_from_world of the poses' world (default: camera.json beside the poses)")
      ->type_name("FILE");
}

Person readPerson(const PersonOptions& options) {
  if (!options.camera.empty() && options.poses.empty())
    throw UsageError("--camera: goes with --poses");
  Person person{avatar::readAvatar(options.avatar), nullptr};
  const std::string name = options.body.empty() ? person.avatar.body.model : options.body;
  person.model = std::make_shared<avatar::BodyModel>(avatar::loadBody(name));
  if (!definesJointsOf(*person.model, person.avatar.body))
    throw avatar::FileError(
        options.avatar,
        "simulcap_body",
        "its body isn't of the model " + name + "; give --body the model it was made with");
  wearMaterial(person.avatar, options.material);
  return person;
}

void findRestShapes(Person& person, const CommandContext& context) {
  RestShapeOptions options;
  options.threads = context.threads;
  options.onRound = [&](int round) {
    stopIfInterrupted();
    if (round == 0)
      context.console.info("finding shapes that hang as the garments were worn");
  };
  person.restShapes = restShapes(person.captured(), options);
}

void wearMaterial(avatar::LayeredAvatar& avatar, const std::string& material) {
  if (material.empty())
    return;
  const bullet_ext::ClothMaterial cloth = bullet_ext::paperMaterial(material);
  for (avatar::Garment& garment : avatar.garments) {
    garment.cloth.stretchStiffness = cloth.stretchStiffness;
    garment.cloth.torsionStiffness = cloth.torsionStiffness;
    garment.cloth.edgeStretchStiffness.clear();
    garment.cloth.edgeTorsionStiffness.clear();
  }
}

TrackedPerson trackedPerson(const PersonOptions& options, const Person& person, int threads) {
  std::optional<KnownPoses> poses = readPoses(options);
  std::optional<OuterLayer> clothes;
  if (!poses)
    clothes = outerLayer(draped({*person.model, person.avatar}, threads));
  return {
      .model = *person.model,
      .betas = person.avatar.body.betas,
      .outer = std::move(clothes),
      .poses = std::move(poses),
      .armsApart = true};
}

TrackedRecording openFrames(
    const std::string& sequence, const PersonOptions& options, const Person& person, int threads) {
  return {sequence, trackedPerson(options, person, threads), options.range};
}

}  // namespace simulcap
