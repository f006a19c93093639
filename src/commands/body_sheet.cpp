#include "src/commands/body_sheet.h"

#include "src/program/console.h"
#include "src/program/parallel_for.h"

#include <Eigen/Geometry>

namespace simulcap {

std::vector<avatar::ColorImage> pictures(
    const PicturedPerson& person,
    const std::vector<SheetPanel>& panels,
    const PictureOptions& options,
    const CommandContext& context) {
  std::vector<avatar::ColorImage> images(panels.size());
  Progress progress(context.console, "rendering", static_cast<long>(panels.size()), "pictures");
  parallelFor(static_cast<long>(panels.size()), context.threads, [&](long i) {
    const SheetPanel& panel = panels[static_cast<std::size_t>(i)];
    images[static_cast<std::size_t>(i)] =
        picture(person, panel.body, panel.view, panel.box, options);
    progress.advance();
  });
  return images;
}

ContactSheet bodySheet(
    const PicturedPerson& person, const BodySheetRequest& request, const CommandContext& context) {
  ContactSheet sheet;
  std::vector<std::vector<Eigen::AlignedBox3d>> boxesOfView;
  for (const BodyView& view : request.views) {
    sheet.columnLabels.push_back(view.name);
    boxesOfView.push_back(framingBoxes(
        request.bodies,
        verticesOfJoints(person.skinningWeights, view.joints),
        request.commonFloor));
  }
  std::vector<SheetPanel> panels;
  for (std::size_t row = 0; row < request.bodies.size(); ++row) {
    sheet.rowLabels.push_back(request.bodies[row].label);
    for (std::size_t column = 0; column < request.views.size(); ++column)
      panels.push_back({request.bodies[row], request.views[column], boxesOfView[column][row]});
  }
  sheet.panels = pictures(person, panels, request.picture, context);
  return sheet;
}

}  // namespace simulcap
