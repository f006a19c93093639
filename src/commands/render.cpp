#include "avatar/avatar_pose.h"
#include "avatar/default_body/embedded_body.h"
#include "avatar/io/avatar_file.h"
#include "src/commands/body_input.h"
#include "src/commands/body_sheet.h"
#include "src/commands/commands.h"
#include "src/commands/motion_input.h"
#include "src/output/image_file.h"
#include "src/output/named_pose.h"
#include "src/program/console.h"

#include <CLI/CLI.hpp>

#include <memory>
#include <utility>

namespace simulcap {
namespace {

struct RenderOptions {
  std::string body = "default";
  std::string output;
  std::vector<std::string> shapes;
  std::vector<std::string> poses;
  MotionRequest motion;
  std::vector<std::string> views;
  std::string size;
  bool sheet = false;
  bool wireframe = false;
  std::vector<double> color;
};

std::vector<std::string> viewNames() {
  std::vector<std::string> names;
  names.reserve(bodyViews().size());
  for (const BodyView& view : bodyViews())
    names.push_back(view.name);
  return names;
}

std::vector<BodyView> chosenViews(const RenderOptions& options) {
  std::vector<std::string> names = options.views;
  if (names.empty() && options.sheet)
    names = {"front", "three-quarter", "side", "back"};
  else if (names.empty())
    names = {"three-quarter"};
  std::vector<BodyView> views;
  views.reserve(names.size());
  for (const std::string& name : names)
    views.push_back(bodyView(name));
  return views;
}

/// What is shown of one shape: its poses or the frames of its motion.
std::vector<LabelledPose> chosenPoses(
    const RenderOptions& options, const avatar::ShapedBody& shaped, const Console& console) {
  if (!options.motion.source.empty())
    return motionPoses(options.motion, shaped, options.sheet ? 6 : 1, console);
  std::vector<std::string> names = options.poses;
  if (names.empty())
    names = {"apose"};
  std::vector<LabelledPose> poses;
  poses.reserve(names.size());
  for (const std::string& name : names)
    poses.push_back({name, namedPose(name)});
  return poses;
}

std::vector<PicturedBody> chosenBodies(
    const RenderOptions& options, const avatar::BodyModel& model, const Console& console) {
  const avatar::Skinning skinning(model);
  std::vector<PicturedBody> bodies;
  for (const NamedShape& shape : parseShapes(options.shapes, model)) {
    const avatar::ShapedBody shaped = skinning.shape(shape.betas);
    for (const LabelledPose& pose : chosenPoses(options, shaped, console)) {
      const std::string separator = shape.label.empty() ? "" : ", ";
      bodies.push_back(
          {shape.label + separator + pose.label, skinning.pose(shaped, pose.pose).vertices});
    }
  }
  return bodies;
}

/// The avatar as a viewer shows it: garments follow the body unsimulated.
std::vector<PicturedBody> chosenAvatars(
    const RenderOptions& options, const avatar::LayeredAvatar& dressed, const Console& console) {
  if (!options.shapes.empty())
    throw UsageError("--betas: an avatar has its own shape; leave it out");
  std::vector<PicturedBody> bodies;
  const avatar::ShapedBody shaped{dressed.body.mesh.vertices, dressed.body.joints};
  for (const LabelledPose& pose : chosenPoses(options, shaped, console)) {
    PicturedBody body{pose.label, avatar::posedVertices(dressed.body, pose.pose)};
    for (const avatar::Garment& garment : dressed.garments)
      body.garments.push_back(
          {{avatar::posedVertices(garment, dressed.body, pose.pose), garment.mesh.faces},
           garment.color,
           garment.vertexColors});
    bodies.push_back(std::move(body));
  }
  return bodies;
}

PictureOptions pictureOptions(const RenderOptions& options, bool isSheet) {
  PictureOptions picture;
  picture.wireframe = options.wireframe;
  if (isSheet) {
    picture.width = 280;
    picture.height = 300;
  }
  if (!options.size.empty()) {
    const PixelSize size = parseSize(options.size);
    picture.width = size.width;
    picture.height = size.height;
  }
  if (!options.color.empty())
    picture.color = Eigen::Vector3d(options.color[0], options.color[1], options.color[2]);
  return picture;
}

void render(
    const PicturedPerson& person,
    std::vector<PicturedBody> bodies,
    const RenderOptions& options,
    const CommandContext& context) {
  const bool isSheet = options.sheet || bodies.size() > 1;
  const BodySheetRequest request{
      .bodies = std::move(bodies),
      .views = chosenViews(options),
      .commonFloor = !options.motion.source.empty(),
      .picture = pictureOptions(options, isSheet)};
  const ContactSheet sheet = bodySheet(person, request, context);
  const avatar::ColorImage image =
      sheet.panels.size() == 1 && !options.sheet ? sheet.panels.front() : composed(sheet);
  writePng(options.output, image);
  context.console.info(
      "wrote " + options.output + " (" + std::to_string(image.width) + "x" +
      std::to_string(image.height) + ")");
}

void render(const RenderOptions& options, const CommandContext& context) {
  if (options.body.ends_with(".glb")) {
    const avatar::LayeredAvatar dressed = avatar::readAvatar(options.body);
    render(
        PicturedPerson(dressed.body),
        chosenAvatars(options, dressed, context.console),
        options,
        context);
    return;
  }
  const avatar::BodyModel model = avatar::loadBody(options.body);
  render(PicturedPerson(model), chosenBodies(options, model, context.console), options, context);
}

void addWhatIsShown(CLI::App& verb, RenderOptions& options) {
  verb.add_option(
          "BODY",
          options.body,
          "'default' (the built-in body), a body model .npz or an avatar .glb")
      ->capture_default_str();
  verb.add_option("-o,--output", options.output, "PNG file to write")->required();
  addShapeOption(verb, options.shapes, "rows");
  verb.add_option("--pose", options.poses, "Poses, separated by commas (default: apose)")
      ->delimiter(',')
      ->check(CLI::IsMember(namedPoses()));
  addMotionOptions(verb, options.motion);
  verb.get_option("--motion")->excludes("--pose");
}

void addHowItIsShown(CLI::App& verb, RenderOptions& options) {
  verb.add_option(
          "--view",
          options.views,
          "Views, separated by commas (default: three-quarter; with --sheet "
          "front,three-quarter,side,back)")
      ->delimiter(',')
      ->check(CLI::IsMember(viewNames()));
  verb.add_option(
          "--size",
          options.size,
          "Size of a picture in pixels (default: 480x640; on a sheet 280x300 each)")
      ->type_name("WxH");
  verb.add_flag(
      "--sheet",
      options.sheet,
      "A labelled sheet: shapes, poses or frames down, views across (several pictures always are "
      "one)");
  verb.add_flag("--wireframe", options.wireframe, "Draw the edges of the mesh");
  verb.add_option("--color", options.color, "Colour of the body, three numbers 0 to 1: R,G,B")
      ->delimiter(',')
      ->expected(3)
      ->check(CLI::Range(0.0, 1.0));
}

}  // namespace

void addRender(CLI::App& program, ChosenCommand& chosen) {
  CLI::App* verb =
      program.add_subcommand("render", "Picture of a body or an avatar: shapes, poses, motions");
  const auto options = std::make_shared<RenderOptions>();
  addWhatIsShown(*verb, *options);
  addHowItIsShown(*verb, *options);
  verb->callback([options, &chosen] {
    chosen = [options](const CommandContext& context) { render(*options, context); };
  });
}

}  // namespace simulcap
