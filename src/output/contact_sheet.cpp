#include "src/output/contact_sheet.h"

#include "src/output/image_file.h"

#include <algorithm>
#include <stdexcept>

namespace simulcap {
namespace {

constexpr int kLabelTextHeight = 13;  // [px]
constexpr int kPanelGap = 6;          // between panels and around captions [px]
constexpr int kCaption = kLabelTextHeight + 2 * kPanelGap;

void requirePanels(const ContactSheet& sheet) {
  const auto isOdd = [&](const avatar::ColorImage& panel) {
    return panel.width != sheet.panels[0].width || panel.height != sheet.panels[0].height;
  };
  if (sheet.panels.empty() ||
      sheet.panels.size() != sheet.rowLabels.size() * sheet.columnLabels.size() ||
      std::any_of(sheet.panels.begin(), sheet.panels.end(), isOdd))
    throw std::invalid_argument("composed: a sheet needs rows x columns panels of one size");
}

void paste(avatar::ColorImage& sheet, const avatar::ColorImage& panel, int left, int top) {
  for (int y = 0; y < panel.height; ++y) {
    const auto row = panel.rgb.begin() + static_cast<std::ptrdiff_t>(3) * panel.width * y;
    std::copy(
        row,
        row + static_cast<std::ptrdiff_t>(3) * panel.width,
        sheet.rgb.begin() + static_cast<std::ptrdiff_t>(3) * (sheet.width * (top + y) + left));
  }
}

}  // namespace

avatar::ColorImage composed(const ContactSheet& sheet) {
  requirePanels(sheet);
  const int columns = static_cast<int>(sheet.columnLabels.size());
  const int rows = static_cast<int>(sheet.rowLabels.size());
  const int panelWidth = sheet.panels[0].width;
  const int panelHeight = sheet.panels[0].height;
  const int rowPitch = panelHeight + kCaption;

  avatar::ColorImage image;
  image.width = columns * (panelWidth + kPanelGap) + kPanelGap;
  image.height = kCaption + rows * rowPitch;
  image.rgb.assign(static_cast<std::size_t>(3) * image.width * image.height, 255);
  for (int c = 0; c < columns; ++c) {
    const std::string& label = sheet.columnLabels[c];
    const int left = kPanelGap + c * (panelWidth + kPanelGap);
    const int x = left + (panelWidth - textWidth(label, kLabelTextHeight)) / 2;
    drawText(image, label, {.x = x, .y = kPanelGap + kLabelTextHeight, .height = kLabelTextHeight});
  }
  for (int r = 0; r < rows; ++r) {
    const int top = kCaption + r * rowPitch;
    for (int c = 0; c < columns; ++c)
      paste(image, sheet.panels[r * columns + c], kPanelGap + c * (panelWidth + kPanelGap), top);
    drawText(
        image,
        sheet.rowLabels[r],
        {.x = kPanelGap,
         .y = top + panelHeight + kPanelGap + kLabelTextHeight,
         .height = kLabelTextHeight});
  }
  return image;
}

}  // namespace simulcap
