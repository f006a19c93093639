#include "src/report/track_codec.h"

#include <cmath>
#include <stdexcept>

namespace simulcap {
namespace {

std::uint32_t mask(const TrackShape& shape) {
  return shape.bytesPerValue == 4 ? ~0U : (1U << (8 * shape.bytesPerValue)) - 1U;
}

/// Where the value of a point and component is, within all; and its place among the bytes.
class TrackWalk {
 public:
  explicit TrackWalk(const TrackShape& shape)
      : components_(static_cast<std::size_t>(shape.components)),
        points_(static_cast<std::size_t>(shape.points)),
        frameSize_(components_ * points_),
        frames_(static_cast<std::size_t>(shape.frames)) {}

  /// Calls visit(index of the value, whether it has a frame before, whether a point before).
  template <class Visit>
  void operator()(const Visit& visit) const {
    for (std::size_t c = 0; c < components_; ++c)
      for (std::size_t f = 0; f < frames_; ++f)
        for (std::size_t p = 0; p < points_; ++p)
          visit(f * frameSize_ + p * components_ + c, f > 0, p > 0);
  }

  std::size_t frameSize() const { return frameSize_; }

  std::size_t pointSize() const { return components_; }

 private:
  std::size_t components_, points_, frameSize_, frames_;
};

std::uint32_t folded(std::uint32_t difference, std::uint32_t mask) {
  const bool negative = difference > mask / 2;
  return negative ? 2U * (mask - difference) + 1U : 2U * difference;
}

std::uint32_t unfolded(std::uint32_t value, std::uint32_t mask) {
  return (value & 1U) != 0 ? mask - value / 2U : value / 2U;
}

}  // namespace

void TrackShape::validate() const {
  if (frames < 1 || points < 0 || components < 1)
    throw std::invalid_argument("TrackShape: needs frames ≥ 1, points ≥ 0, components ≥ 1");
  if (bytesPerValue != 1 && bytesPerValue != 2 && bytesPerValue != 4)
    throw std::invalid_argument("TrackShape: bytesPerValue must be 1, 2 or 4");
}

std::string packedTrack(std::span<const std::uint32_t> values, const TrackShape& shape) {
  shape.validate();
  if (values.size() != shape.size())
    throw std::invalid_argument("packedTrack: another number of values than the shape's");
  const TrackWalk walk(shape);
  const std::uint32_t modulus = mask(shape);
  const auto overTime = [&](std::size_t index, bool hasFrame) {
    const bool predicted = shape.overTime && hasFrame;
    return values[index] - (predicted ? values[index - walk.frameSize()] : 0U);
  };
  std::string bytes(values.size() * static_cast<std::size_t>(shape.bytesPerValue), '\0');
  std::size_t place = 0;
  walk([&](std::size_t index, bool hasFrame, bool hasPoint) {
    const std::uint32_t before = hasPoint ? overTime(index - walk.pointSize(), hasFrame) : 0U;
    const std::uint32_t value = folded((overTime(index, hasFrame) - before) & modulus, modulus);
    for (std::size_t b = 0; b < static_cast<std::size_t>(shape.bytesPerValue); ++b)
      bytes[b * values.size() + place] = static_cast<char>((value >> (8 * b)) & 0xFFU);
    ++place;
  });
  return bytes;
}

std::vector<std::uint32_t> unpackedTrack(std::string_view bytes, const TrackShape& shape) {
  shape.validate();
  const std::size_t count = shape.size();
  if (bytes.size() != count * static_cast<std::size_t>(shape.bytesPerValue))
    throw std::invalid_argument("unpackedTrack: another number of bytes than the shape's");
  const TrackWalk walk(shape);
  const std::uint32_t modulus = mask(shape);
  std::vector<std::uint32_t> values(count);
  std::size_t place = 0;
  std::uint32_t difference = 0;  // to the frame before, of the point before
  walk([&](std::size_t index, bool hasFrame, bool hasPoint) {
    std::uint32_t value = 0;
    for (std::size_t b = 0; b < static_cast<std::size_t>(shape.bytesPerValue); ++b)
      value |= static_cast<std::uint32_t>(static_cast<std::uint8_t>(bytes[b * count + place]))
               << (8 * b);
    ++place;
    difference = (hasPoint ? difference : 0U) + unfolded(value, modulus);
    const bool predicted = shape.overTime && hasFrame;
    values[index] = (difference + (predicted ? values[index - walk.frameSize()] : 0U)) & modulus;
  });
  return values;
}

PositionChunk quantized(std::span<const Eigen::Matrix3Xf> frames, double step) {
  if (frames.empty() || !(step > 0.0))
    throw std::invalid_argument("quantized: needs frames and a positive step");
  constexpr double kMost = 65535.0;
  const Eigen::Index points = frames.front().cols();
  PositionChunk chunk;
  chunk.step = step;
  chunk.shape = {
      .frames = static_cast<int>(frames.size()),
      .points = static_cast<int>(points),
      .components = 3};
  chunk.values.reserve(chunk.shape.size());
  Eigen::Array3d low = Eigen::Array3d::Constant(1e30), high = -low;
  for (const Eigen::Matrix3Xf& frame : frames) {
    if (frame.cols() != points || !frame.allFinite())
      throw std::invalid_argument("quantized: frames of different sizes, or not finite");
    if (points == 0)
      continue;
    low = low.min(frame.rowwise().minCoeff().cast<double>().array());
    high = high.max(frame.rowwise().maxCoeff().cast<double>().array());
  }
  if (points == 0)
    return chunk;
  while (((high - low) / chunk.step).maxCoeff() > kMost)
    chunk.step *= 2.0;
  chunk.origin = low;
  for (const Eigen::Matrix3Xf& frame : frames)
    for (Eigen::Index v = 0; v < points; ++v)
      for (int c = 0; c < 3; ++c)
        chunk.values.push_back(static_cast<std::uint32_t>(
            std::lround((static_cast<double>(frame(c, v)) - low[c]) / chunk.step)));
  return chunk;
}

std::vector<Eigen::Matrix3Xf> dequantized(const PositionChunk& chunk) {
  std::vector<Eigen::Matrix3Xf> frames(
      static_cast<std::size_t>(chunk.shape.frames), Eigen::Matrix3Xf(3, chunk.shape.points));
  auto value = chunk.values.begin();
  for (Eigen::Matrix3Xf& frame : frames)
    for (Eigen::Index v = 0; v < frame.cols(); ++v)
      for (int c = 0; c < 3; ++c)
        frame(c, v) = static_cast<float>(chunk.origin[c] + chunk.step * *value++);
  return frames;
}

}  // namespace simulcap
