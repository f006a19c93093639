#include "src/tracking/depth_view.h"

#include <algorithm>
#include <cmath>

namespace simulcap {
namespace {

constexpr int kCell = 4;    // [px] of the table of nearest pixels
constexpr int kReach = 20;  // cells around the person's box

double squaredLength(const Eigen::Vector2i& v) {
  return v.cast<double>().squaredNorm();
}

}  // namespace

DepthView::DepthView(const DepthCloud& cloud, const avatar::Camera& camera, int numPixelSamples)
    : cloud_(cloud), camera_(camera) {
  for (int y = 0; y < cloud.height; ++y) {
    for (int x = 0; x < cloud.width; ++x) {
      if (cloud.person[cloud.index(x, y)] != 0) {
        ++numPersonPixels_;
        box_.extend(Eigen::Vector2i(x, y));
      }
    }
  }
  if (numPersonPixels_ == 0) {
    return;
  }
  const double stride =
      std::max(1.0, std::sqrt(static_cast<double>(numPersonPixels_) / numPixelSamples));
  for (double gridY = box_.min().y(); gridY <= box_.max().y(); gridY += stride) {
    for (double gridX = box_.min().x(); gridX <= box_.max().x(); gridX += stride) {
      const int x = static_cast<int>(gridX);
      const int y = static_cast<int>(gridY);
      const std::size_t i = cloud.index(x, y);
      if (cloud.person[i] != 0) {
        const auto column = static_cast<Eigen::Index>(i);
        pixels_.push_back(
            {cloud.points.col(column).cast<double>(),
             cloud.normals.col(column).cast<double>(),
             Eigen::Vector2d(x, y),
             cloud.labels.empty() ? std::uint8_t{kBackground} : cloud.labels[i]});
      }
    }
  }
  buildNearestTable();
}

// Danielsson's two sweeps carry the nearest person pixel from cell to cell (8SED): exact but for
// rare cells, whose error is below one cell.
void DepthView::buildNearestTable() {
  tableBox_.extend((box_.min() / kCell - Eigen::Vector2i::Constant(kReach)).eval());
  tableBox_.extend((box_.max() / kCell + Eigen::Vector2i::Constant(kReach)).eval());
  const int width = tableBox_.sizes().x() + 1;
  const int height = tableBox_.sizes().y() + 1;
  const Eigen::Vector2i none = Eigen::Vector2i::Constant(-1);
  nearest_.assign(static_cast<std::size_t>(width) * static_cast<std::size_t>(height), none);
  const auto cell = [&](int cx, int cy) -> Eigen::Vector2i& {
    return nearest_
        [static_cast<std::size_t>(cy) * static_cast<std::size_t>(width) +
         static_cast<std::size_t>(cx)];
  };
  const auto centre = [&](int cx, int cy) -> Eigen::Vector2i {
    return kCell * (tableBox_.min() + Eigen::Vector2i(cx, cy)) +
           Eigen::Vector2i::Constant(kCell / 2);
  };
  for (int y = box_.min().y(); y <= box_.max().y(); ++y) {
    for (int x = box_.min().x(); x <= box_.max().x(); ++x) {
      if (cloud_.person[cloud_.index(x, y)] == 0) {
        continue;
      }
      const Eigen::Vector2i pixel(x, y);
      const Eigen::Vector2i c = pixel / kCell - tableBox_.min();
      Eigen::Vector2i& best = cell(c.x(), c.y());
      const Eigen::Vector2i middle = centre(c.x(), c.y());
      if (best.x() < 0 || squaredLength(pixel - middle) < squaredLength(best - middle)) {
        best = pixel;
      }
    }
  }
  const auto relax = [&](int cx, int cy, int dx, int dy) {
    const int nx = cx + dx;
    const int ny = cy + dy;
    if (nx < 0 || ny < 0 || nx >= width || ny >= height || cell(nx, ny).x() < 0) {
      return;
    }
    Eigen::Vector2i& best = cell(cx, cy);
    const Eigen::Vector2i middle = centre(cx, cy);
    if (best.x() < 0 || squaredLength(cell(nx, ny) - middle) < squaredLength(best - middle)) {
      best = cell(nx, ny);
    }
  };
  const auto sweepRow = [&](int cy, int fromRow) {
    for (int cx = 0; cx < width; ++cx) {
      relax(cx, cy, -1, fromRow);
      relax(cx, cy, 0, fromRow);
      relax(cx, cy, 1, fromRow);
      relax(cx, cy, -1, 0);
    }
    for (int cx = width - 1; cx >= 0; --cx) {
      relax(cx, cy, 1, 0);
    }
  };
  for (int cy = 0; cy < height; ++cy) {
    sweepRow(cy, -1);
  }
  for (int cy = height - 1; cy >= 0; --cy) {
    sweepRow(cy, 1);
  }
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
