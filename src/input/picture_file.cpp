#include "src/input/picture_file.h"

#include "src/input/depth_cloud.h"

#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <iterator>

namespace simulcap {
namespace {

using Bytes = std::vector<unsigned char>;

constexpr std::size_t kPngHeader = 33;  // signature and IHDR chunk

Bytes readBytes(const std::string& path) {
  std::ifstream file(path, std::ios::binary);
  if (!file || !std::filesystem::is_regular_file(path))
    throw PictureProblem("pictures that are missing");
  Bytes bytes(std::filesystem::file_size(path));
  file.read(reinterpret_cast<char*>(bytes.data()), std::ssize(bytes));
  return bytes;
}

bool isPng(const Bytes& bytes) {
  constexpr unsigned char kSignature[] = {0x89, 'P', 'N', 'G', '\r', '\n', 0x1a, '\n'};
  return bytes.size() >= kPngHeader &&
         std::equal(std::begin(kSignature), std::end(kSignature), bytes.begin());
}

bool isJpeg(const Bytes& bytes) {
  return bytes.size() > 2 && bytes[0] == 0xff && bytes[1] == 0xd8;
}

/// A JPEG ends with FF D9; its decoder would fill up what is missing with grey.
bool hasJpegEnd(const Bytes& bytes) {
  constexpr std::ptrdiff_t kMaxPadding = 1024;
  constexpr unsigned char kEnd[] = {0xff, 0xd9};
  const auto from = bytes.end() - std::min<std::ptrdiff_t>(kMaxPadding, std::ssize(bytes));
  return std::search(from, bytes.end(), std::begin(kEnd), std::end(kEnd)) != bytes.end();
}

[[noreturn]] void failOnSize(int width, int height, const PictureSize& expected) {
  throw PictureProblem(
      "pictures of " + std::to_string(width) + " x " + std::to_string(height) +
      " pixels where the intrinsics say " + std::to_string(expected.width) + " x " +
      std::to_string(expected.height));
}

/// A PNG's size from its header: spares decoding (and allocating) what can't be used.
void requirePngSize(const Bytes& bytes, const PictureSize& expected) {
  const auto bigEndian = [&](std::size_t at) {
    return bytes[at] << 24 | bytes[at + 1] << 16 | bytes[at + 2] << 8 | bytes[at + 3];
  };
  if (bigEndian(16) != expected.width || bigEndian(20) != expected.height)
    failOnSize(bigEndian(16), bigEndian(20), expected);
}

cv::Mat decoded(const std::string& path, int mode, const PictureSize& size) {
  const Bytes bytes = readBytes(path);
  if (isPng(bytes))
    requirePngSize(bytes, size);
  cv::Mat image;
  try {
    if (isPng(bytes) || (isJpeg(bytes) && hasJpegEnd(bytes)))
      image = cv::imdecode(bytes, mode);
  } catch (const cv::Exception&) {
    image.release();
  }
  if (image.empty())
    throw PictureProblem("pictures that are damaged or cut off");
  if (image.cols != size.width || image.rows != size.height)
    failOnSize(image.cols, image.rows, size);
  return image;
}

template <typename Pixel>
std::vector<Pixel> pixelsOf(const cv::Mat& image) {
  std::vector<Pixel> result(image.total());
  cv::Mat view(image.rows, image.cols, image.type(), result.data());
  image.copyTo(view);
  return result;
}

}  // namespace

std::vector<std::uint16_t> readDepthPicture(const std::string& path, const PictureSize& size) {
  const cv::Mat image = decoded(path, cv::IMREAD_UNCHANGED, size);
  if (image.type() != CV_16UC1)
    throw PictureProblem(
        "depth pictures with " + std::to_string(8 * image.elemSize1()) + " bits and " +
        std::to_string(image.channels()) + " channels where 16 bits and 1 channel are expected");
  return pixelsOf<std::uint16_t>(image);
}

avatar::ColorImage readColorPicture(const std::string& path, const PictureSize& size) {
  const cv::Mat bgr = decoded(path, cv::IMREAD_COLOR, size);
  avatar::ColorImage image{bgr.cols, bgr.rows, std::vector<std::uint8_t>(3 * bgr.total())};
  cv::Mat rgb(image.height, image.width, CV_8UC3, image.rgb.data());
  cv::cvtColor(bgr, rgb, cv::COLOR_BGR2RGB);
  return image;
}

std::vector<std::uint8_t> readLabelPicture(const std::string& path, const PictureSize& size) {
  const cv::Mat image = decoded(path, cv::IMREAD_UNCHANGED, size);
  if (image.type() != CV_8UC1)
    throw PictureProblem("label pictures that are not 8-bit with a single channel");
  auto labels = pixelsOf<std::uint8_t>(image);
  if (std::any_of(labels.begin(), labels.end(), [](std::uint8_t l) { return l > kLower; }))
    throw PictureProblem("label pictures with values other than 0 to 3");
  return labels;
}

}  // namespace simulcap
