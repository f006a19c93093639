#include "src/output/point_cache.h"

#include "avatar/io/file_error.h"

#include <bit>
#include <cmath>
#include <cstring>
#include <filesystem>
#include <limits>
#include <stdexcept>
#include <utility>

namespace simulcap {
namespace {

static_assert(std::endian::native == std::endian::little, "PC2 is little endian");

constexpr char kSignature[12] = "POINTCACHE2";

/// The file's first bytes as they lie there.
struct Pc2Header {
  char signature[12] = {};
  std::int32_t version = 1;
  std::int32_t numPoints = 0;
  float startFrame = 0.0F;
  float sampleRate = 1.0F;
  std::int32_t numSamples = 0;
};

static_assert(sizeof(Pc2Header) == 32);

std::string_view bytesOf(const Pc2Header& header) {
  return {reinterpret_cast<const char*>(&header), sizeof header};
}

int requirePositive(int numPoints) {
  if (numPoints <= 0)
    throw std::invalid_argument("Pc2Writer: a point cache has at least one point");
  return numPoints;
}

}  // namespace

Pc2Writer::Pc2Writer(const std::string& path, int numPoints, const Pc2Timing& timing)
    : file_(path), zUp_(3, requirePositive(numPoints)) {
  if (!(timing.sampleRate > 0.0F) || !std::isfinite(timing.sampleRate + timing.startFrame))
    throw std::invalid_argument("Pc2Writer: the sample rate must be positive, the start finite");
  Pc2Header header{
      .numPoints = numPoints, .startFrame = timing.startFrame, .sampleRate = timing.sampleRate};
  std::memcpy(header.signature, kSignature, sizeof kSignature);
  file_.append(bytesOf(header));
}

void Pc2Writer::append(const Eigen::Ref<const Eigen::Matrix3Xf>& vertices) {
  if (vertices.cols() != zUp_.cols() || !vertices.allFinite())
    throw std::invalid_argument(
        "Pc2Writer: frame " + std::to_string(numFrames_) + " needs " + std::to_string(zUp_.cols()) +
        " finite vertices");
  if (numFrames_ == std::numeric_limits<std::int32_t>::max())
    throw std::invalid_argument("Pc2Writer: a point cache counts its frames in 32 bits");
  zUp_.row(0) = vertices.row(0);
  zUp_.row(1) = -vertices.row(2);
  zUp_.row(2) = vertices.row(1);
  const std::size_t numBytes = sizeof(float) * static_cast<std::size_t>(zUp_.size());
  file_.append({reinterpret_cast<const char*>(zUp_.data()), numBytes});
  ++numFrames_;
}

void Pc2Writer::finish() {
  const std::int32_t numSamples = numFrames_;
  file_.overwrite(
      offsetof(Pc2Header, numSamples),
      {reinterpret_cast<const char*>(&numSamples), sizeof numSamples});
  file_.commit();
}

Pc2Reader::Pc2Reader(std::string path) : path_(std::move(path)), file_(path_, std::ios::binary) {
  Pc2Header header;
  if (!std::filesystem::is_regular_file(path_) ||
      !file_.read(reinterpret_cast<char*>(&header), sizeof header) ||
      std::memcmp(header.signature, kSignature, sizeof kSignature) != 0)
    throw avatar::FileError(path_, "", "is no PC2 point cache");
  if (header.version != 1 || header.numPoints <= 0 || header.numSamples < 0)
    throw avatar::FileError(path_, "header", "expected version 1, points > 0 and samples ≥ 0");
  const auto frameBytes = 3 * sizeof(float) * static_cast<std::uintmax_t>(header.numPoints);
  if (std::filesystem::file_size(path_) !=
      sizeof header + frameBytes * static_cast<std::uintmax_t>(header.numSamples))
    throw avatar::FileError(
        path_, "header", "says another number of frames than the file holds; it is truncated");
  timing_ = {header.startFrame, header.sampleRate};
  numPoints_ = header.numPoints;
  numFrames_ = header.numSamples;
}

Eigen::Matrix3Xf Pc2Reader::frame(int index) {
  if (index < 0 || index >= numFrames_)
    throw std::out_of_range("Pc2Reader: no frame " + std::to_string(index));
  Eigen::Matrix3Xf zUp(3, numPoints_);
  const auto frameBytes = static_cast<std::streamsize>(3 * sizeof(float)) * numPoints_;
  file_.seekg(static_cast<std::streamoff>(sizeof(Pc2Header)) + index * frameBytes);
  if (!file_.read(reinterpret_cast<char*>(zUp.data()), frameBytes))
    throw avatar::FileError(path_, "frame " + std::to_string(index), "can't be read");
  Eigen::Matrix3Xf vertices(3, numPoints_);
  vertices << zUp.row(0), zUp.row(2), -zUp.row(1);
  return vertices;
}

}  // namespace simulcap
