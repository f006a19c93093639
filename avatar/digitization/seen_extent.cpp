#include "avatar/digitization/seen_extent.h"

#include "avatar/digitization/limbs.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <optional>
#include <stdexcept>
#include <string>

namespace avatar {
namespace {

/// Vertices of a limb's surface sorted by direction around its axis and by place along it.
class LimbMap {
 public:
  explicit LimbMap(const LimbAxis& axis) : axis_(axis) {
    for (auto& direction : cells_)
      direction.resize(static_cast<std::size_t>(std::ceil(axis.end / kStep)) + 1);
  }

  void add(const Eigen::Vector3d& point, bool seen) {
    const double place = axis_.along(point);
    if (place < 0.0 || place > axis_.end)
      return;
    const auto direction = static_cast<std::size_t>(axis_.turn(point) * kDirections) % kDirections;
    Cell& cell = cells_[direction][static_cast<std::size_t>(place / kStep)];
    ++cell.count;
    cell.seen += seen ? 1 : 0;
  }

  /// The level to which all but a share of the directions were seen; nothing when that is the end.
  std::optional<double> limit(const SeenExtentOptions& options) const {
    std::vector<double> ends;
    for (const auto& direction : cells_) {
      if (const double end = seenEnd(direction, options.seenShare); end > 0.0)
        ends.push_back(end);
    }
    if (ends.empty())
      return std::nullopt;
    const auto place = static_cast<std::size_t>(options.gaps * static_cast<double>(ends.size()));
    std::nth_element(ends.begin(), ends.begin() + static_cast<std::ptrdiff_t>(place), ends.end());
    const double level = ends[place] - options.frayed;
    constexpr double kMargin = 0.02;  // an ankle's or wrist's place isn't known better [m]
    return ends[place] < axis_.end - kMargin ? std::optional(level) : std::nullopt;
  }

 private:
  static constexpr double kStep = 0.01;  // [m]
  static constexpr std::size_t kDirections = 24;

  struct Cell {
    int count = 0;
    int seen = 0;
  };

  /// The end of the furthest stretch of three cells that was seen, or of the limb where hardly any
  /// surface lies beyond, as between the legs; 0: none was seen.
  static double seenEnd(const std::vector<Cell>& cells, double share) {
    constexpr long kFewCells = 8;
    const auto isSurface = [](const Cell& cell) { return cell.count > 0; };
    for (std::size_t end = cells.size(); end >= 3; --end) {
      int count = 0;
      int seen = 0;
      for (std::size_t i = end - 3; i < end; ++i) {
        count += cells[i].count;
        seen += cells[i].seen;
      }
      if (cells[end - 1].seen == 0 || seen < share * count)
        continue;
      const auto beyond = cells.begin() + static_cast<std::ptrdiff_t>(end);
      const bool toItsEnd = std::count_if(beyond, cells.end(), isSurface) < kFewCells;
      return kStep * static_cast<double>(toItsEnd ? cells.size() : end);
    }
    return 0.0;
  }

  LimbAxis axis_;
  std::array<std::vector<Cell>, kDirections> cells_;
};

/// What the unseen vertices beyond a limit are taken for: the sum over the ring before it.
void continueLabels(
    OuterSurface& surface, const std::vector<Limb>& limbs, Limb limb, double ringWidth) {
  std::array<long, kNumSurfaceLabels> sum = {};
  for (std::size_t v = 0; v < limbs.size(); ++v) {
    const double past = surface.pastSeen[static_cast<Eigen::Index>(v)];
    if (limbs[v] != limb || past > 0.0 || past < -ringWidth)
      continue;
    for (std::size_t label = 0; label < sum.size(); ++label)
      sum[label] += surface.labels[v][label];
  }
  const long most = std::max(1L, *std::max_element(sum.begin(), sum.end()));
  constexpr long kSure = 100;  // as if seen in so many frames
  LabelCounts counts = {};
  for (std::size_t label = 0; label < sum.size(); ++label)
    counts[label] = static_cast<std::uint16_t>(sum[label] * kSure / most);
  for (std::size_t v = 0; v < limbs.size(); ++v) {
    if (limbs[v] == limb && surface.pastSeen[static_cast<Eigen::Index>(v)] > 0.0 &&
        !surface.seen[v])
      surface.labels[v] = counts;
  }
}

}  // namespace

void SeenExtentOptions::validate() const {
  const auto demand = [](bool holds, const char* what) {
    if (!holds)
      throw std::invalid_argument(std::string("SeenExtentOptions: ") + what);
  };
  demand(seenShare > 0.0 && seenShare <= 1.0, "seenShare is expected in (0, 1]");
  demand(gaps >= 0.0 && gaps < 1.0, "gaps is expected in [0, 1)");
  demand(frayed >= 0.0 && frayed <= 0.2, "frayed is expected in 0 … 0.2 m");
}

OuterSurface withSeenExtent(
    OuterSurface surface, const DressingBody& body, const SeenExtentOptions& options) {
  options.validate();
  constexpr double kRing = 0.05;  // before a limit [m]
  constexpr double kFar = 1.0;    // beyond the end of a limb without limit [m]
  const std::vector<Limb> limbs = limbsOfSurface(surface.mesh, body);
  const std::array<LimbAxis, kNumLimbs> axes = limbAxes(body);
  surface.pastSeen.resize(surface.mesh.numVertices());
  for (const Limb limb : {kTrunkAndLegs, kLeftArm, kRightArm}) {
    LimbMap map(axes[limb]);
    for (std::size_t v = 0; v < limbs.size(); ++v) {
      if (limbs[v] == limb)
        map.add(surface.mesh.vertices.col(static_cast<Eigen::Index>(v)), surface.seen[v]);
    }
    const std::optional<double> limit = map.limit(options);
    const double level = limit.value_or(axes[limb].end + kFar);
    for (std::size_t v = 0; v < limbs.size(); ++v) {
      const auto column = static_cast<Eigen::Index>(v);
      if (limbs[v] == limb)
        surface.pastSeen[column] = axes[limb].along(surface.mesh.vertices.col(column)) - level;
    }
    if (limit)
      continueLabels(surface, limbs, limb, kRing);
  }
  return surface;
}

}  // namespace avatar
