#include "src/output/image_file.h"

#include "avatar/io/atomic_file.h"
#include "avatar/io/file_error.h"

#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>

#include <algorithm>
#include <filesystem>
#include <stdexcept>
#include <variant>

namespace simulcap {
namespace {

constexpr int kFont = cv::FONT_HERSHEY_SIMPLEX;

/// A view of the image's memory; OpenCV neither copies nor frees it.
cv::Mat viewOf(const avatar::ColorImage& image) {
  return {image.height, image.width, CV_8UC3, const_cast<std::uint8_t*>(image.rgb.data())};
}

std::string encoded(const char* format, const cv::Mat& image, const std::vector<int>& options) {
  std::vector<unsigned char> bytes;
  if (!cv::imencode(format, image, bytes, options))
    throw std::runtime_error(std::string("a picture could not be encoded as ") + format);
  return {bytes.begin(), bytes.end()};
}

template <class Value>
std::string encodedGray(int width, int height, const std::vector<Value>& values, int type) {
  if (width < 1 || height < 1 ||
      values.size() != static_cast<std::size_t>(width) * static_cast<std::size_t>(height))
    throw std::invalid_argument("pngBytes: needs width × height values");
  const cv::Mat view(height, width, type, const_cast<Value*>(values.data()));
  return encoded(".png", view, {cv::IMWRITE_PNG_COMPRESSION, 1});
}

double fontScale(int height) {
  return cv::getFontScaleFromHeight(kFont, height, 1);
}

/// Draws the items of a drawing into an image with `scale` pixels per unit.
class Rasterizer {
 public:
  Rasterizer(cv::Mat& canvas, double scale) : canvas_(canvas), scale_(scale) {}

  void operator()(const DrawnLine& line) const {
    std::vector<cv::Point> points;
    for (const Eigen::Vector2d& point : line.points)
      points.push_back(fixedPoint(point));
    if (line.filled)
      cv::fillConvexPoly(canvas_, points, color(line.fillColor), cv::LINE_AA, kFractionBits);
    if (line.width > 0.0)
      cv::polylines(
          canvas_,
          points,
          line.closed,
          color(line.color),
          std::max(1, cvRound(line.width * scale_)),
          cv::LINE_AA,
          kFractionBits);
  }

  void operator()(const DrawnText& text) const {
    constexpr double kStroke = 0.12;  // width of a letter's lines relative to its height
    const int thickness = std::max(1, cvRound(kStroke * text.height * scale_));
    const double size = cv::getFontScaleFromHeight(kFont, cvRound(text.height * scale_), thickness);
    int baseline = 0;
    const int width = cv::getTextSize(text.text, kFont, size, thickness, &baseline).width;
    const int shares[] = {0, width / 2, width};
    const int left = cvRound(text.position.x() * scale_) - shares[static_cast<int>(text.anchor)];
    cv::putText(
        canvas_,
        text.text,
        {left, cvRound(text.position.y() * scale_)},
        kFont,
        size,
        color(text.color),
        thickness,
        cv::LINE_AA);
  }

 private:
  static constexpr int kFractionBits = 4;  // of OpenCV's coordinates

  cv::Point fixedPoint(const Eigen::Vector2d& point) const {
    const Eigen::Vector2d at = scale_ * (1 << kFractionBits) * point;
    return {cvRound(at.x()), cvRound(at.y())};
  }

  static cv::Scalar color(const Eigen::Vector3d& rgb) {
    return {255.0 * rgb[0], 255.0 * rgb[1], 255.0 * rgb[2]};
  }

  cv::Mat& canvas_;
  double scale_;
};

}  // namespace

void writePng(const std::string& path, const avatar::ColorImage& image) {
  cv::Mat bgr;
  cv::cvtColor(viewOf(image), bgr, cv::COLOR_RGB2BGR);
  std::vector<unsigned char> bytes;
  if (!cv::imencode(".png", bgr, bytes, {cv::IMWRITE_PNG_COMPRESSION, 9}))
    throw avatar::FileError(path, "", "the picture could not be encoded as PNG");
  avatar::writeFileAtomically(path, {reinterpret_cast<const char*>(bytes.data()), bytes.size()});
}

std::string jpegBytes(const avatar::ColorImage& image, int quality) {
  cv::Mat bgr;
  cv::cvtColor(viewOf(image), bgr, cv::COLOR_RGB2BGR);
  return encoded(".jpg", bgr, {cv::IMWRITE_JPEG_QUALITY, quality});
}

avatar::ColorImage resized(const avatar::ColorImage& image, int width, int height) {
  if (image.rgb.empty() || width < 1 || height < 1)
    throw std::invalid_argument("resized: needs pixels");
  const auto size = static_cast<std::size_t>(width) * static_cast<std::size_t>(height);
  avatar::ColorImage result{width, height, std::vector<std::uint8_t>(3 * size)};
  cv::Mat pixels = viewOf(result);
  cv::resize(viewOf(image), pixels, pixels.size(), 0.0, 0.0, cv::INTER_AREA);
  return result;
}

std::string pngBytes(int width, int height, const std::vector<std::uint8_t>& values) {
  return encodedGray(width, height, values, CV_8UC1);
}

std::string pngBytes(int width, int height, const std::vector<std::uint16_t>& values) {
  return encodedGray(width, height, values, CV_16UC1);
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

avatar::ColorImage rasterized(const Drawing& drawing, double scale) {
  if (!(scale >= 0.25 && scale <= 8.0))
    throw std::invalid_argument("rasterized: scale must be 0.25 to 8");
  constexpr int kSamples = 2;  // per pixel and side
  const int width = cvRound(drawing.width * scale);
  const int height = cvRound(drawing.height * scale);
  cv::Mat canvas(kSamples * height, kSamples * width, CV_8UC3, cv::Scalar::all(255));
  for (const auto& item : drawing.items)
    std::visit(Rasterizer(canvas, kSamples * scale), item);
  avatar::ColorImage image{
      width, height, std::vector<std::uint8_t>(3 * static_cast<std::size_t>(width * height))};
  cv::Mat pixels = viewOf(image);
  cv::resize(canvas, pixels, pixels.size(), 0.0, 0.0, cv::INTER_AREA);
  return image;
}

}  // namespace simulcap
