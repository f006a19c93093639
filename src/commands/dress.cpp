#include "avatar/default_body/embedded_body.h"
#include "avatar/io/avatar_file.h"
#include "avatar/io/file_error.h"
#include "avatar/io/mesh_file.h"
#include "avatar/wardrobe/outfit.h"
#include "bullet_ext/core/cloth_material.h"
#include "src/commands/body_input.h"
#include "src/commands/commands.h"
#include "src/output/named_pose.h"
#include "src/program/console.h"

#include <CLI/CLI.hpp>

#include <cstdio>
#include <filesystem>
#include <memory>

namespace simulcap {
namespace {

struct DressOptions {
  std::string body;
  std::string output;
  std::vector<std::string> wear;
  std::vector<std::string> files;
  std::string filePose = "auto";
  std::string unit = "m";
  std::string shape;
  std::string material = "middle";
  double edgeLength = 0.02;
  bool remesh = false;
};

/// "tshirt" or "tshirt:0.03".
avatar::GarmentOrder parseOrder(const std::string& text, double edgeLength) {
  const std::size_t colon = text.find(':');
  avatar::GarmentOrder order{.name = text.substr(0, colon), .edgeLength = edgeLength};
  if (colon != std::string::npos)
    order.ease = parseNumber("--wear: ease", text.substr(colon + 1));
  try {
    order.validate();
  } catch (const std::invalid_argument& error) {
    throw UsageError(std::string("--wear: ") + error.what());
  }
  return order;
}

avatar::ModelledGarment readGarment(
    const std::string& path, const DressOptions& options, const Console& console) {
  const avatar::MeshFile file =
      avatar::readMesh(path, {.unit = avatar::parseLengthUnit(options.unit)});
  for (const std::string& warning : file.warnings)
    console.warn(avatar::FileError(path, "", warning).what());
  avatar::ModelledGarment garment{
      .name = std::filesystem::path(path).stem().string(),
      .mesh = file.mesh,
      .vertexColors = file.vertexColors};
  if (options.filePose != "auto")
    garment.pose = namedPose(options.filePose);
  if (options.remesh)
    garment.edgeLength = options.edgeLength;
  return garment;
}

void requireDifferentCuts(const std::vector<avatar::GarmentOrder>& orders) {
  for (std::size_t i = 1; i < orders.size(); ++i) {
    for (std::size_t j = 0; j < i; ++j) {
      if (orders[i].name == orders[j].name)
        throw UsageError("--wear: " + orders[i].name + " is named twice");
    }
  }
}

avatar::Outfit readOutfit(const DressOptions& options, const Console& console) {
  std::vector<avatar::GarmentOrder> orders;
  orders.reserve(options.wear.size());
  for (const std::string& text : options.wear)
    orders.push_back(parseOrder(text, options.edgeLength));
  requireDifferentCuts(orders);
  avatar::Outfit outfit;
  for (const avatar::GarmentOrder& order : orders)
    outfit.pieces.emplace_back(order);
  for (const std::string& path : options.files)
    outfit.pieces.emplace_back(readGarment(path, options, console));
  if (outfit.pieces.empty())
    throw UsageError("name something to wear: --wear NAME or --garment FILE");
  return outfit;
}

Eigen::VectorXd chosenBetas(const DressOptions& options, const avatar::BodyModel& model) {
  if (options.shape.empty())
    return Eigen::VectorXd::Zero(model.numBetas());
  return parseShape(options.shape, model).betas;
}

std::string garmentLine(const avatar::Garment& garment) {
  char text[160];
  std::snprintf(
      text,
      sizeof text,
      "layer %d  %-10s %6ld vertices %6ld faces %4zu pins",
      garment.layer,
      garment.name.c_str(),
      static_cast<long>(garment.mesh.numVertices()),
      static_cast<long>(garment.mesh.numFaces()),
      garment.pins.size());
  return text;
}

void dress(const DressOptions& options, const CommandContext& context) {
  const avatar::BodyModel model = avatar::loadBody(options.body);
  avatar::DressedAvatar result =
      avatar::dressed(model, chosenBetas(options, model), readOutfit(options, context.console));
  for (const std::string& note : result.notes)
    context.console.info(note);
  const bullet_ext::ClothMaterial material = bullet_ext::paperMaterial(options.material);
  for (avatar::Garment& garment : result.avatar.garments) {
    garment.cloth.stretchStiffness = material.stretchStiffness;
    garment.cloth.torsionStiffness = material.torsionStiffness;
  }
  avatar::writeAvatar(options.output, result.avatar);
  for (const avatar::Garment& garment : result.avatar.garments)
    context.console.result(garmentLine(garment));
  context.console.info("wrote " + options.output);
}

std::string wardrobeHelp() {
  std::string help =
      "Built-in garments, separated by commas, each with its ease in metres if you "
      "like (tshirt:0.03):";
  for (const avatar::WardrobePiece& piece : avatar::wardrobe()) {
    char line[120];
    std::snprintf(
        line,
        sizeof line,
        "\n%s - %s (%.3g)",
        piece.name.c_str(),
        piece.description.c_str(),
        piece.ease);
    help += line;
  }
  return help;
}

void addGarmentFileOptions(CLI::App& verb, DressOptions& options) {
  verb.add_option(
          "--garment",
          options.files,
          "Garment modelled elsewhere: .obj, .glb, .ply (Y up, facing +Z); repeat for several")
      ->expected(1)
      ->multi_option_policy(CLI::MultiOptionPolicy::TakeAll)
      ->allow_extra_args(false)
      ->type_name("FILE");
  std::vector<std::string> poses = namedPoses();
  poses.insert(poses.begin(), "auto");
  verb.add_option(
          "--garment-pose",
          options.filePose,
          "Pose that the body had when the garment files were modelled; auto finds it")
      ->check(CLI::IsMember(poses))
      ->capture_default_str();
  verb.add_option("--unit", options.unit, "Unit of the garment files")
      ->check(CLI::IsMember({"m", "cm", "mm"}))
      ->capture_default_str();
  verb.add_flag(
      "--remesh",
      options.remesh,
      "Give garment files new triangles of --edge-length, which simulate best; without it they "
      "keep their vertices and faces, and needle triangles are reported");
}

}  // namespace

void addDress(CLI::App& program, ChosenCommand& chosen) {
  CLI::App* verb = program.add_subcommand(
      "dress", "A body with built-in or imported garments becomes an avatar (.glb)");
  const auto options = std::make_shared<DressOptions>();
  verb->add_option("BODY", options->body, "'default' (the built-in body) or a body model .npz")
      ->required();
  verb->add_option("-o,--output", options->output, "Avatar to write (.glb)")->required();
  verb->add_option("--wear", options->wear, wardrobeHelp())->delimiter(',');
  addGarmentFileOptions(*verb, *options);
  verb->add_option("--betas", options->shape, shapeHelp() + " (default: the mean shape)")
      ->type_name("BETAS");
  verb->add_option("--material", options->material, "The paper's cloth, for all garments")
      ->check(CLI::IsMember({"soft", "middle", "hard"}))
      ->capture_default_str();
  verb->add_option(
          "--edge-length",
          options->edgeLength,
          "Edges of the built-in (with --remesh: all) garments [m], 0.008 to 0.05")
      ->check(CLI::Range(0.008, 0.05))
      ->capture_default_str();
  verb->callback([options, &chosen] {
    chosen = [options](const CommandContext& context) { dress(*options, context); };
  });
}

}  // namespace simulcap
