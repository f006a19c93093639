#pragma once

#include "avatar/geometry/closest_point.h"
#include "avatar/geometry/mesh.h"

#include <Eigen/Core>

#include <cstdint>
#include <vector>

namespace simulcap {

/// A weighted distribution of values that are 0 or more, in constant memory: mean and maximum are
/// exact, quantiles to half a bin.
class Distribution {
 public:
  /// Bins of this width; values beyond the last one count as it.
  explicit Distribution(double binWidth) : binWidth_(binWidth) {}

  /// `weight` ≥ 0, for instance the area that a sample stands for; 0 leaves the value out.
  void add(double value, double weight = 1.0);

  bool empty() const { return totalWeight_ == 0.0; }

  double totalWeight() const { return totalWeight_; }

  double mean() const;

  double max() const { return max_; }

  /// The value below which a share of all lie, 0 … 1, by weight; 0 without
  /// values.
  double quantile(double share) const;

  /// Total weight, sum, maximum and the bins, to go on from later.
  std::vector<double> state() const;

  /// Throws std::invalid_argument for what is no state.
  void restore(const std::vector<double>& state);

 private:
  static constexpr int kNumBins = 20000;

  double binWidth_;
  std::vector<double> bins_ = std::vector<double>(kNumBins, 0.0);  // weights
  double totalWeight_ = 0.0;
  double sum_ = 0.0;
  double max_ = 0.0;
};

/// How far edges are from their rest lengths, relative, longer or shorter, over all frames.
class EdgeStrain {
 public:
  explicit EdgeStrain(const avatar::TriangleMesh& rest);

  /// 3 × V [m].
  void add(const Eigen::Matrix3Xd& vertices, Distribution& strains) const;

 private:
  Eigen::Matrix2Xi edges_;
  Eigen::VectorXd restLengths_;  // [m]
};

/// Vertices of garments under the skin, that is surrounded by it, over all frames. A posed body
/// intersects itself: in an armpit the skin that is nearest may have been pushed out of the back
/// and face the other way, with the cloth in plain air.
class Penetration {
 public:
  explicit Penetration(const avatar::MeshView& body)
      : vertices_(body.vertices), faces_(body.faces), skin_(body) {}

  /// The skin of the coming frame, 3 × V [m].
  void moveBody(const Eigen::Matrix3Xd& vertices) {
    vertices_ = vertices;
    skin_.refit(vertices);
  }

  void add(const Eigen::Matrix3Xd& cloth);

  std::int64_t vertices() const { return count_; }  ///< looked at

  std::int64_t inside() const { return inside_; }

  double deepest() const { return deepest_; }  ///< from the nearest skin [m]

 private:
  bool isUnderSkin(
      const Eigen::Vector3d& vertex, const avatar::SignedDistanceResult& nearest) const;

  Eigen::Matrix3Xd vertices_;  // of the body
  Eigen::Matrix3Xi faces_;
  avatar::SignedDistance skin_;
  std::int64_t count_ = 0;
  std::int64_t inside_ = 0;
  double deepest_ = 0.0;
};

}  // namespace simulcap
