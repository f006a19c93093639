#include "src/output/image_file.h"

#include "avatar/io/atomic_file.h"
#include "avatar/io/file_error.h"

#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>

#include <filesystem>

namespace simulcap {
namespace {

constexpr int kFont = cv::FONT_HERSHEY_SIMPLEX;

/// A view of the image's memory; OpenCV neither copies nor frees it.
cv::Mat viewOf(const avatar::ColorImage& image) {
  return {image.height, image.width, CV_8UC3, const_cast<std::uint8_t*>(image.rgb.data())};
}

double fontScale(int height) {
  return cv::getFontScaleFromHeight(kFont, height, 1);
}

}  // namespace

void writePng(const std::string& path, const avatar::ColorImage& image) {
  cv::Mat bgr;
  cv::cvtColor(viewOf(image), bgr, cv::COLOR_RGB2BGR);
  std::vector<unsigned char> bytes;
  if (!cv::imencode(".png", bgr, bytes, {cv::IMWRITE_PNG_COMPRESSION, 9}))
    throw avatar::FileError(path, "", "the picture could not be encoded as PNG");
  avatar::writeFileAtomically(path, {reinterpret_cast<const char*>(bytes.data()), bytes.size()});
}

avatar::ColorImage readColorImage(const std::string& path) {
  if (!std::filesystem::is_regular_file(path))
    throw avatar::FileError(path, "", "no such file");
  const cv::Mat bgr = cv::imread(path, cv::IMREAD_COLOR);
  if (bgr.empty())
    throw avatar::FileError(path, "", "is no picture that can be read (damaged or cut off?)");
  avatar::ColorImage image{bgr.cols, bgr.rows, std::vector<std::uint8_t>(3 * bgr.total())};
  cv::Mat rgb = viewOf(image);
  cv::cvtColor(bgr, rgb, cv::COLOR_BGR2RGB);
  return image;
}

void drawText(avatar::ColorImage& image, const std::string& text, const TextOptions& options) {
  cv::Mat view = viewOf(image);
  cv::putText(
      view,
      text,
      {options.x, options.y},
      kFont,
      fontScale(options.height),
      cv::Scalar::all(options.gray),
      1,
      cv::LINE_AA);
}

int textWidth(const std::string& text, int height) {
  int baseline = 0;
  return cv::getTextSize(text, kFont, fontScale(height), 1, &baseline).width;
}

}  // namespace simulcap
