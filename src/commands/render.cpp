#include "src/commands/body_input.h"
#include "src/commands/body_sheet.h"
#include "src/commands/commands.h"
#include "src/commands/picture_input.h"
#include "src/output/image_file.h"
#include "src/program/console.h"

#include <CLI/CLI.hpp>

#include <memory>
#include <utility>

namespace simulcap {
namespace {

constexpr int kSheetFrames = 6;  // of a motion, unless others are asked for

struct RenderOptions {
  PictureRequest what;
  std::string output;
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

void requireSomebody(const PictureSubject& subject, const std::vector<BodyView>& views) {
  for (const BodyView& view : views)
    if (!view.joints.empty() && subject.person.skinningWeights.rows() == 0)
      throw UsageError("--view: there is nobody of whom " + view.name + " could be shown");
}

void render(const RenderOptions& options, const CommandContext& context) {
  PictureRequest what = options.what;
  what.usualFrames = options.sheet ? kSheetFrames : 1;
  const std::vector<BodyView> views = chosenViews(options);
  PictureSubject subject = pictureSubject(what, context);
  requireSomebody(subject, views);
  const bool isSheet = options.sheet || subject.bodies.size() > 1;
  const BodySheetRequest request{
      .bodies = std::move(subject.bodies),
      .views = views,
      .commonFloor = subject.moves,
      .picture = pictureOptions(options, isSheet)};
  const ContactSheet sheet = bodySheet(subject.person, request, context);
  const avatar::ColorImage image =
      sheet.panels.size() == 1 && !options.sheet ? sheet.panels.front() : composed(sheet);
  writePng(options.output, image);
  context.console.info(
      "wrote " + options.output + " (" + std::to_string(image.width) + "x" +
      std::to_string(image.height) + ")");
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
      program.add_subcommand("render", "Picture of a body, an avatar, a scene or an output folder");
  const auto options = std::make_shared<RenderOptions>();
  addPictureInput(*verb, options->what);
  verb->add_option("-o,--output", options->output, "PNG file to write")->required();
  addHowItIsShown(*verb, *options);
  verb->callback([options, &chosen] {
    chosen = [options](const CommandContext& context) { render(*options, context); };
  });
}

}  // namespace simulcap
