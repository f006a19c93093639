#pragma once

#include "src/commands/commands.h"
#include "src/output/body_view.h"
#include "src/output/contact_sheet.h"

#include <vector>

namespace simulcap {

/// One picture of a sheet. Body and view must outlive it.
struct SheetPanel {
  const PicturedBody& body;
  const BodyView& view;
  Eigen::AlignedBox3d box;  ///< what the picture shows [m]
};

/// Pictures of all panels, in their order; one progress bar, all threads.
std::vector<avatar::ColorImage> pictures(
    const PicturedPerson& person,
    const std::vector<SheetPanel>& panels,
    const PictureOptions& options,
    const CommandContext& context);

struct BodySheetRequest {
  std::vector<PicturedBody> bodies;  ///< the rows
  std::vector<BodyView> views;       ///< the columns
  bool commonFloor = false;          ///< see framingBoxes()
  PictureOptions picture;            ///< of each panel
};

/// All bodies in all views, at one scale per view.
ContactSheet bodySheet(
    const PicturedPerson& person, const BodySheetRequest& request, const CommandContext& context);

}  // namespace simulcap
