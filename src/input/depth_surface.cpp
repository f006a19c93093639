#include "src/input/depth_surface.h"

#include "src/input/pixel_rays.h"
#include "src/input/wide_clones.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <iterator>
#include <stdexcept>
#include <utility>
#include <vector>

namespace simulcap {
namespace {

/// Pixels [left, right) × [top, bottom).
struct Box {
  int left = 0, top = 0, right = 0, bottom = 0;

  int width() const { return right - left; }

  int height() const { return bottom - top; }
};

/// The first of the mask's pixels from `first` on that is `value`, else `end`. (std::find looks at
/// one byte at a time.)
const std::uint8_t* findPixel(
    const std::uint8_t* first, const std::uint8_t* end, std::uint8_t value) {
  const void* found = std::memchr(first, value, static_cast<std::size_t>(end - first));
  return found != nullptr ? static_cast<const std::uint8_t*>(found) : end;
}

Box boxOfPerson(const DepthCloud& cloud) {
  Box box{cloud.width, cloud.height, 0, 0};
  for (int y = 0; y < cloud.height; ++y) {
    const std::uint8_t* row = cloud.person.data() + cloud.index(0, y);
    const std::uint8_t* end = row + cloud.width;
    const auto first = findPixel(row, end, 1) - row;
    if (first == cloud.width)
      continue;
    const auto afterLast = std::find(std::reverse_iterator(end), std::reverse_iterator(row), 1);
    box.left = std::min(box.left, static_cast<int>(first));
    box.right = std::max(box.right, static_cast<int>(afterLast.base() - row));
    box.top = std::min(box.top, y);
    box.bottom = y + 1;
  }
  return box;
}

constexpr int kLargestReach = 8;  // [px]

/// Inverse depth of the person's pixels; 0 elsewhere, and in a margin around the box.
class InverseDepth {
 public:
  InverseDepth(const DepthCloud& cloud, const Box& box)
      : stride_(box.width() + 2 * kMargin),
        values_(Eigen::ArrayXf::Zero((box.height() + 2 * kMargin) * stride_)) {
    for (int y = 0; y < box.height(); ++y) {
      const std::size_t from = cloud.index(box.left, box.top + y);
      invert(
          cloud.depth.data() + from,
          cloud.person.data() + from,
          values_.data() + offset(y),
          box.width());
    }
  }

  /// Row y of the box, or one as far as the margin goes.
  const float* row(int y) const { return values_.data() + offset(y); }

  Eigen::Index stride() const { return stride_; }

  /// Of the person's pixels.
  float mean() const {
    // 1 for what is within a kilometre: sums are wide where counts aren't.
    const float count = (values_ * 1e3F).min(1.0F).sum();
    return values_.sum() / std::max(count, 1.0F);
  }

 private:
  static constexpr int kMargin = 2 * kLargestReach;

  static void invert(
      const float* depth, const std::uint8_t* person, float* __restrict inverse, int count) {
    constexpr float kTiny = 1e-6F;  // what isn't measured isn't the person either
    for (int x = 0; x < count; ++x)
      inverse[x] = static_cast<float>(person[x]) / std::max(depth[x], kTiny);
  }

  Eigen::Index offset(int y) const { return (y + kMargin) * stride_ + kMargin; }

  Eigen::Index stride_;
  Eigen::ArrayXf values_;
};

/// Differences are taken over 2 · reach pixels and averaged over ±reach, so that pixels at a border
/// still see some [px].
int reachFor(const NormalOptions& options, double focal, float meanInverseDepth) {
  const float pixels = options.baseline * static_cast<float>(focal) * meanInverseDepth;
  return std::clamp(static_cast<int>(std::lround(0.5F * pixels)), 1, kLargestReach);
}

/// What differences of inverse depth may be: |Δ(1/z)| = |Δz| / z². depthJump's noise over z² with
/// z = 1 / inverse, and a surface's slope over the reach, times 1/z.
inline float differenceLimit(float inverse, float slope) {
  const float fromNear = 1.0F - 0.4F * inverse;
  return 5.0F * (0.0012F * inverse * inverse + 0.0019F * fromNear * fromNear) + slope * inverse;
}

/// Inverse depth of pixels and of those before and after them.
struct ComparedPixels {
  const float* before;
  const float* centre;
  const float* after;
};

/// Per pixel the difference of the ones after and before and a 1, if all three are of one surface;
/// else zeros. Free of branches, so that the compiler makes it wide.
SIMULCAP_WIDE_CLONES void findDifferences(
    const ComparedPixels& pixels,
    float slope,
    float* __restrict difference,
    float* __restrict one,
    int count) {
  const float* before = pixels.before;
  const float* centre = pixels.centre;
  const float* after = pixels.after;
  for (int x = 0; x < count; ++x) {
    const float limit = differenceLimit(centre[x], slope);
    const int same = static_cast<int>(centre[x] > 0.0F) & static_cast<int>(after[x] > 0.0F) &
                     static_cast<int>(before[x] > 0.0F) &
                     static_cast<int>(std::abs(after[x] - centre[x]) <= limit) &
                     static_cast<int>(std::abs(centre[x] - before[x]) <= limit);
    one[x] = static_cast<float>(same);
    difference[x] = one[x] * (after[x] - before[x]);
  }
}

/// Differences of inverse depth in one direction, averaged over a window that goes down the image.
class WindowedDifference {
 public:
  /// `step`: from a pixel to the ones that are compared, `reach` pixels before and after it.
  /// `slope`: of differenceLimit().
  WindowedDifference(
      const InverseDepth& image, int width, int reach, Eigen::Index step, float slope)
      : image_(image),
        width_(width),
        reach_(reach),
        step_(step),
        slope_(slope),
        rows_(2 * reach + 1, Sums(width)),
        columns_(width + 2 * reach + 1),
        window_(width) {
    for (int y = 0; y < reach; ++y)
      add(y);
  }

  /// Goes on to row y; rows in order from 0.
  void advance(int y) {
    add(y + reach_);
    const Eigen::Index size = 2 * reach_ + 1;
    const Eigen::ArrayXf& sum = columns_.sum;
    const Eigen::ArrayXf& count = columns_.count;
    float windowSum = sum.head(size).sum();
    float windowCount = count.head(size).sum();
    for (Eigen::Index x = 0; x < width_; ++x) {
      windowSum += sum[x + size] - sum[x];
      windowCount += count[x + size] - count[x];
      window_.sum[x] = windowSum;
      window_.count[x] = windowCount;
    }
  }

  /// Around each pixel of the row; 0 where there is no difference.
  auto mean() const { return window_.sum / window_.count.max(1.0F); }

  /// 1 where there is any difference, else 0.
  auto isKnown() const { return window_.count.min(1.0F); }

 private:
  struct Sums {
    explicit Sums(Eigen::Index size)
        : sum(Eigen::ArrayXf::Zero(size)), count(Eigen::ArrayXf::Zero(size)) {}

    Eigen::ArrayXf sum, count;
  };

  /// Takes row y into the columns' sums and the one that leaves the window out.
  void add(int y) {
    Sums& slot = rows_[static_cast<std::size_t>(y) % rows_.size()];
    columns_.sum.segment(reach_ + 1, width_) -= slot.sum;
    columns_.count.segment(reach_ + 1, width_) -= slot.count;
    const float* row = image_.row(y);
    findDifferences(
        {row - step_, row, row + step_}, slope_, slot.sum.data(), slot.count.data(), width_);
    columns_.sum.segment(reach_ + 1, width_) += slot.sum;
    columns_.count.segment(reach_ + 1, width_) += slot.count;
  }

  const InverseDepth& image_;
  int width_;
  int reach_;
  Eigen::Index step_;
  float slope_;
  std::vector<Sums> rows_;  // of the window
  Sums columns_;            // sums of those, with a margin of reach + 1 before and reach after
  Sums window_;             // sums of the columns around each pixel
};

/// Points and normals, row by row.
class SurfaceRows {
 public:
  SurfaceRows(const InverseDepth& inverse, const Box& box, const avatar::Camera& camera, int reach)
      : inverse_(inverse),
        box_(box),
        scale_(0.5 * camera.fx / reach, 0.5 * camera.fy / reach),
        along_(inverse, box.width(), reach, reach, slopeLimit(reach, camera.fx)),
        down_(inverse, box.width(), reach, reach * inverse.stride(), slopeLimit(reach, camera.fy)),
        rayX_(pixelRays(box.left, box.width(), camera.cx, camera.fx)),
        rayY_(pixelRays(box.top, box.height(), camera.cy, camera.fy)),
        normals_(box.width(), 3),
        toUnit_(box.width()) {}

  /// Row y of the box; rows in order from 0.
  void write(int y, DepthCloud& cloud) {
    along_.advance(y);
    down_.advance(y);
    setNormals(y);
    const float rayY = rayY_[y];
    const std::size_t start = cloud.index(box_.left, box_.top + y);
    const std::uint8_t* person = cloud.person.data() + start;
    const std::uint8_t* end = person + box_.width();
    const std::uint8_t* first = findPixel(person, end, 1);
    while (first != end) {
      const std::uint8_t* last = findPixel(first, end, 0);
      const auto x = static_cast<int>(first - person);
      writeRun(
          {x, static_cast<int>(last - first), start + static_cast<std::size_t>(x), rayY}, cloud);
      first = findPixel(last, end, 1);
    }
  }

 private:
  static float slopeLimit(int reach, double focal) {
    constexpr float kMaxTangent = 2.5F;  // of the angle between normal and ray: 68°
    return kMaxTangent * static_cast<float>(reach) / static_cast<float>(focal);
  }

  /// Pixels of the person side by side.
  struct Run {
    int x = 0;  ///< of the first, in the box
    int count = 0;
    std::size_t pixel = 0;  ///< the first, in the image
    float rayY = 0.0F;
  };

  void writeRun(const Run& run, DepthCloud& cloud) const {
    float* __restrict points = cloud.points.data() + 3 * run.pixel;
    float* __restrict normals = cloud.normals.data() + 3 * run.pixel;
    const float* depth = cloud.depth.data() + run.pixel;
    const float* rayX = rayX_.data() + run.x;
    const float* nx = normals_.col(0).data() + run.x;
    const float* ny = normals_.col(1).data() + run.x;
    const float* nz = normals_.col(2).data() + run.x;
    for (int i = 0; i < run.count; ++i) {
      points[3 * i] = rayX[i] * depth[i];
      points[3 * i + 1] = run.rayY * depth[i];
      points[3 * i + 2] = depth[i];
      normals[3 * i] = nx[i];
      normals[3 * i + 1] = ny[i];
      normals[3 * i + 2] = nz[i];
    }
  }

  /// From inverse depth per pixel to the normal (see withSurface): with c < 0 for a normal towards
  /// the camera, hence the signs.
  void setNormals(int y) {
    const Eigen::Map<const Eigen::ArrayXf> inverse(inverse_.row(y), box_.width());
    auto nx = normals_.col(0);
    auto ny = normals_.col(1);
    auto nz = normals_.col(2);
    nx = -scale_.x() * along_.mean();
    ny = -scale_.y() * down_.mean();
    nz = -rayX_ * nx - rayY_[y] * ny - inverse;
    // Beside the person all parts may be 0.
    const auto length = (nx.square() + ny.square() + nz.square()).sqrt().max(1e-30F);
    toUnit_ = along_.isKnown() * down_.isKnown() / length;
    nx *= toUnit_;
    ny *= toUnit_;
    nz *= toUnit_;
  }

  const InverseDepth& inverse_;
  Box box_;
  Eigen::Array2f scale_;  // fx, fy over 2 · reach
  WindowedDifference along_, down_;
  Eigen::ArrayXf rayX_, rayY_;  // of the box' columns and rows
  Eigen::ArrayX3f normals_;     // of a row, part by part
  Eigen::ArrayXf toUnit_;
};

/// Memory's speed is what limits: what the person still covers is written only once. Masks differ
/// in few places; where blocks of them are the same there is nothing to do.
void clearWherePersonLeft(const std::vector<std::uint8_t>& formerPerson, DepthCloud& cloud) {
  constexpr std::size_t kBlock = 64;
  for (std::size_t begin = 0; begin < formerPerson.size(); begin += kBlock) {
    const std::size_t end = std::min(begin + kBlock, formerPerson.size());
    if (std::memcmp(formerPerson.data() + begin, cloud.person.data() + begin, end - begin) == 0)
      continue;
    for (std::size_t pixel = begin; pixel < end; ++pixel) {
      if (formerPerson[pixel] <= cloud.person[pixel])
        continue;
      cloud.points.col(pixel).setZero();
      cloud.normals.col(pixel).setZero();
    }
  }
}

}  // namespace

void NormalOptions::validate() const {
  if (!(baseline > 0.0F && std::isfinite(baseline)))
    throw std::invalid_argument("NormalOptions: baseline must be positive");
}

DepthCloud withSurface(
    DepthCloud cloud,
    const avatar::Camera& camera,
    const NormalOptions& options,
    const std::vector<std::uint8_t>& formerPerson) {
  options.validate();
  const auto numPixels = static_cast<Eigen::Index>(cloud.depth.size());
  const bool known = formerPerson.empty() || formerPerson.size() == cloud.person.size();
  if (cloud.points.cols() != numPixels || cloud.normals.cols() != numPixels || !known) {
    cloud.points.setZero(3, numPixels);
    cloud.normals.setZero(3, numPixels);
  } else {
    clearWherePersonLeft(formerPerson, cloud);
  }
  const Box box = boxOfPerson(cloud);
  if (box.width() <= 0)
    return cloud;
  const InverseDepth inverse(cloud, box);
  const int reach = reachFor(options, camera.fx, inverse.mean());
  SurfaceRows rows(inverse, box, camera, reach);
  for (int y = 0; y < box.height(); ++y)
    rows.write(y, cloud);
  return cloud;
}

}  // namespace simulcap
