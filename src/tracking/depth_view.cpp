#include "src/tracking/depth_view.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <iterator>
#include <utility>

namespace simulcap {
namespace {

constexpr int kCell = 4;    // [px] of the table of nearest pixels
constexpr int kReach = 20;  // cells around the person's box

double squaredLength(const Eigen::Vector2i& v) {
  return v.cast<double>().squaredNorm();
}

/// Per cell of a coarse image a pixel, the nearest one to the cell's centre that was offered.
class NearestPixels {
 public:
  explicit NearestPixels(const Eigen::AlignedBox2i& cells)
      : first_(cells.min()),
        width_(cells.sizes().x() + 1),
        height_(cells.sizes().y() + 1),
        nearest_(
            static_cast<std::size_t>(width_) * static_cast<std::size_t>(height_),
            Eigen::Vector2i::Constant(-1)) {}

  void offer(const Eigen::Vector2i& pixel) {
    const Eigen::Vector2i c = pixel / kCell - first_;
    offer(c.x(), c.y(), pixel);
  }

  /// Danielsson's two sweeps carry the nearest pixel from cell to cell (8SED): exact but for rare
  /// cells, whose error is below one cell.
  void sweep() {
    for (int cy = 0; cy < height_; ++cy)
      sweepRow(cy, -1);
    for (int cy = height_ - 1; cy >= 0; --cy)
      sweepRow(cy, 1);
  }

  std::vector<Eigen::Vector2i> take() { return std::move(nearest_); }

 private:
  Eigen::Vector2i& at(int cx, int cy) {
    return nearest_
        [static_cast<std::size_t>(cy) * static_cast<std::size_t>(width_) +
         static_cast<std::size_t>(cx)];
  }

  void offer(int cx, int cy, const Eigen::Vector2i& pixel) {
    const Eigen::Vector2i middle =
        kCell * (first_ + Eigen::Vector2i(cx, cy)) + Eigen::Vector2i::Constant(kCell / 2);
    Eigen::Vector2i& best = at(cx, cy);
    if (best.x() < 0 || squaredLength(pixel - middle) < squaredLength(best - middle))
      best = pixel;
  }

  /// Offers a cell what its neighbour has.
  void relax(int cx, int cy, int dx, int dy) {
    const int nx = cx + dx;
    const int ny = cy + dy;
    if (nx >= 0 && ny >= 0 && nx < width_ && ny < height_ && at(nx, ny).x() >= 0)
      offer(cx, cy, at(nx, ny));
  }

  void sweepRow(int cy, int fromRow) {
    for (int cx = 0; cx < width_; ++cx) {
      relax(cx, cy, -1, fromRow);
      relax(cx, cy, 0, fromRow);
      relax(cx, cy, 1, fromRow);
      relax(cx, cy, -1, 0);
    }
    for (int cx = width_ - 1; cx >= 0; --cx)
      relax(cx, cy, 1, 0);
  }

  Eigen::Vector2i first_;
  int width_;
  int height_;
  std::vector<Eigen::Vector2i> nearest_;
};

}  // namespace

DepthView::DepthView(const DepthCloud& cloud, const avatar::Camera& camera, int numPixelSamples)
    : cloud_(cloud), camera_(camera) {
  const auto isPerson = [&](int x, int y) { return cloud.person[cloud.index(x, y)] != 0; };
  for (int y = 0; y < cloud.height; ++y)
    countRow(y);
  if (numPersonPixels_ == 0)
    return;
  const double stride =
      std::max(1.0, std::sqrt(static_cast<double>(numPersonPixels_) / numPixelSamples));
  const auto along = [&](int axis, int step) {
    return box_.min()[axis] + static_cast<int>(step * stride);
  };
  for (int row = 0; along(1, row) <= box_.max().y(); ++row) {
    for (int column = 0; along(0, column) <= box_.max().x(); ++column)
      if (isPerson(along(0, column), along(1, row)))
        pixels_.push_back(sampleAt(along(0, column), along(1, row)));
  }
  buildNearestTable();
}

void DepthView::countRow(int y) {
  const auto isSet = [](std::uint8_t person) { return person != 0; };
  const auto begin = cloud_.person.begin() + static_cast<std::ptrdiff_t>(cloud_.index(0, y));
  const auto end = begin + cloud_.width;
  const auto first = std::find_if(begin, end, isSet);
  if (first == end)
    return;
  const auto last =
      std::find_if(std::make_reverse_iterator(end), std::make_reverse_iterator(first), isSet);
  numPersonPixels_ += static_cast<int>(std::count_if(first, end, isSet));
  box_.extend(Eigen::Vector2i(static_cast<int>(first - begin), y));
  box_.extend(Eigen::Vector2i(static_cast<int>(last.base() - begin) - 1, y));
}

DepthView::PixelSample DepthView::sampleAt(int x, int y) const {
  const std::size_t i = cloud_.index(x, y);
  const auto column = static_cast<Eigen::Index>(i);
  return {
      cloud_.points.col(column).cast<double>(),
      cloud_.normals.col(column).cast<double>(),
      Eigen::Vector2d(x, y),
      cloud_.labels.empty() ? std::uint8_t{kBackground} : cloud_.labels[i]};
}

void DepthView::buildNearestTable() {
  tableBox_.extend((box_.min() / kCell - Eigen::Vector2i::Constant(kReach)).eval());
  tableBox_.extend((box_.max() / kCell + Eigen::Vector2i::Constant(kReach)).eval());
  NearestPixels table(tableBox_);
  for (int y = box_.min().y(); y <= box_.max().y(); ++y) {
    for (int x = box_.min().x(); x <= box_.max().x(); ++x)
      if (cloud_.person[cloud_.index(x, y)] != 0)
        table.offer({x, y});
  }
  table.sweep();
  nearest_ = table.take();
}

Eigen::Vector2i DepthView::nearestPersonPixel(int x, int y) const {
  const Eigen::Vector2i c(
      static_cast<int>(std::floor(static_cast<double>(x) / kCell)),
      static_cast<int>(std::floor(static_cast<double>(y) / kCell)));
  if (numPersonPixels_ == 0 || !tableBox_.contains(c)) {
    return Eigen::Vector2i::Constant(-1);
  }
  const Eigen::Vector2i offset = c - tableBox_.min();
  const int width = tableBox_.sizes().x() + 1;
  return nearest_
      [static_cast<std::size_t>(offset.y()) * static_cast<std::size_t>(width) +
       static_cast<std::size_t>(offset.x())];
}

}  // namespace simulcap
