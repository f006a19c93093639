#include "src/output/image_file.h"

#include "avatar/io/file_error.h"
#include "src/output/contact_sheet.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <filesystem>
#include <fstream>
#include <stdexcept>

namespace simulcap {
namespace {

namespace fs = std::filesystem;

avatar::ColorImage uniform(int width, int height, std::uint8_t gray) {
  return {
      width, height, std::vector<std::uint8_t>(static_cast<std::size_t>(3) * width * height, gray)};
}

fs::path temporary(const std::string& name) {
  return fs::temp_directory_path() / ("simulcap_image_" + name);
}

TEST(ImageFile, PngKeepsEveryByteAndTheOrderOfTheChannels) {
  avatar::ColorImage image = uniform(7, 5, 0);
  for (std::size_t i = 0; i < image.rgb.size(); ++i)
    image.rgb[i] = static_cast<std::uint8_t>(37 * i);
  const fs::path path = temporary("roundtrip.png");
  writePng(path, image);
  const avatar::ColorImage back = readColorImage(path);
  fs::remove(path);
  EXPECT_EQ(back.width, 7);
  EXPECT_EQ(back.height, 5);
  EXPECT_EQ(back.rgb, image.rgb);
}

TEST(ImageFile, DamagedAndMissingPicturesAreNamed) {
  const fs::path path = temporary("damaged.png");
  std::ofstream(path) << "no picture";
  EXPECT_THROW(readColorImage(path), avatar::FileError);
  fs::remove(path);
  EXPECT_THROW(readColorImage(path), avatar::FileError);
}

TEST(ImageFile, TextIsDarkAndInsideItsWidth) {
  avatar::ColorImage image = uniform(200, 40, 255);
  const int width = textWidth("front", 14);
  drawText(image, "front", {.x = 10, .y = 30, .height = 14});
  int first = 200;
  int last = 0;
  for (int i = 0; i < 200 * 40; ++i) {
    if (image.rgb[static_cast<std::size_t>(3) * i] < 128) {
      first = std::min(first, i % 200);
      last = std::max(last, i % 200);
    }
  }
  // One pixel of anti-aliasing on either side.
  EXPECT_GE(first, 9);
  EXPECT_LE(last, 11 + width);
  EXPECT_GT(last - first, width / 2);
}

TEST(ContactSheet, PanelsStandInRowsAndColumns) {
  ContactSheet sheet{.rowLabels = {"", ""}, .columnLabels = {"", ""}};
  for (const std::uint8_t gray : std::array<std::uint8_t, 4>{10, 20, 30, 40})
    sheet.panels.push_back(uniform(30, 20, gray));
  const avatar::ColorImage image = composed(sheet);
  std::vector<int> firstSeenAt(4, -1);
  for (int i = 0; i < image.width * image.height; ++i) {
    const int gray = image.rgb[static_cast<std::size_t>(3) * i];
    if (gray <= 40 && firstSeenAt[gray / 10 - 1] < 0)
      firstSeenAt[gray / 10 - 1] = i;
  }
  const auto x = [&](int panel) { return firstSeenAt[panel] % image.width; };
  const auto y = [&](int panel) { return firstSeenAt[panel] / image.width; };
  EXPECT_EQ(x(0), x(2));
  EXPECT_EQ(x(1), x(3));
  EXPECT_GE(x(1), x(0) + 30);
  EXPECT_EQ(y(0), y(1));
  EXPECT_EQ(y(2), y(3));
  EXPECT_GE(y(2), y(0) + 20);
  EXPECT_LE(x(1) + 30, image.width);
  EXPECT_LE(y(2) + 20, image.height);
}

TEST(ContactSheet, RefusesAMissingOrOddPanel) {
  ContactSheet sheet{.rowLabels = {"a"}, .columnLabels = {"b", "c"}, .panels = {uniform(9, 9, 0)}};
  EXPECT_THROW(composed(sheet), std::invalid_argument);
  sheet.panels.push_back(uniform(9, 8, 0));
  EXPECT_THROW(composed(sheet), std::invalid_argument);
}

}  // namespace
}  // namespace simulcap
