#include "bullet_ext/core/contact_kernels.h"
#include "bullet_ext/core/continuous_collision.h"
#include "bullet_ext/core/element_index.h"
#include "bullet_ext/core/wide_kernels.h"

#include <Eigen/Core>
#include <gtest/gtest.h>

#include <cstddef>
#include <cstdint>
#include <random>
#include <vector>

namespace bullet_ext {
namespace {

constexpr int kBlocks = 200;
constexpr int kPairs = kBlocks * kContactLanes;

/// Of row k of pair i.
std::size_t placeOf(std::size_t i, std::size_t k) {
  return (i / kContactLanes * 4 + k) * kContactLanes + i % kContactLanes;
}

/// Pairs of a centimetre, some of which are flat, parallel, degenerate or meet.
struct Pairs {
  Eigen::Matrix4Xf positions = Eigen::Matrix4Xf::Zero(4, 4 * kPairs);
  std::vector<std::int32_t> vertices = std::vector<std::int32_t>(4 * kPairs);

  Pairs() {
    std::mt19937 random(7);
    std::uniform_real_distribution<float> coordinate(-0.01F, 0.01F);
    for (int i = 0; i < kPairs; ++i) {
      auto x = positions.middleCols<4>(4 * i);
      x.topRows<3>() = Eigen::Matrix<float, 3, 4>::NullaryExpr([&] { return coordinate(random); });
      if (i % 5 == 1)
        x.row(2).setConstant(0.003F);
      if (i % 7 == 2)
        x.col(3) = x.col(2) + (x.col(1) - x.col(0));
      if (i % 11 == 3)
        x.col(3) = x.col(2);
      x.row(0).array() += 1.0F;  // the precision of positions a metre from the origin
      for (int k = 0; k < 4; ++k)
        vertices[placeOf(at(i), at(k))] = 4 * i + k;
    }
  }

  Eigen::Matrix4Xf offsets(const ContactKernels& kernels, PairKind kind) const {
    std::vector<float> rows(4 * kPairs);
    (kind == PairKind::kVertexTriangle ? kernels.vertexTriangleOffsets : kernels.edgeEdgeOffsets)(
        positions.data(), vertices.data(), kBlocks, rows.data());
    Eigen::Matrix4Xf result(4, kPairs);
    for (int i = 0; i < kPairs; ++i)
      for (int k = 0; k < 4; ++k)
        result(k, i) = rows[placeOf(at(i), at(k))];
    return result;
  }
};

class PairOffsets : public testing::TestWithParam<PairKind> {};

TEST_P(PairOffsets, areThoseOfTheClosestPoints) {
  const Pairs pairs;
  const Eigen::Matrix4Xf offsets = pairs.offsets(portableContactKernels(), GetParam());
  constexpr double kRounding = 1e-6;  // [m], of positions a metre from the origin
  constexpr double kExtent = 0.07;    // [m], of two diagonals of the cube that they are in
  for (int i = 0; i < kPairs; ++i) {
    const PairPoints<double> x = pairs.positions.middleCols<4>(4 * i).topRows<3>().cast<double>();
    const ClosestPoints<double> closest = closestPoints(GetParam(), x);
    const Eigen::Vector3d offset = offsets.col(i).head<3>().cast<double>();
    EXPECT_NEAR(offsets(3, i), closest.distance, kRounding) << i;
    EXPECT_NEAR(offset.norm(), closest.distance, kRounding) << i;
    if (closest.distance < 1e-4)
      continue;  // no direction is left within rounding
    // It is the normal, which separates the elements by their distance: tilted by rounding, it
    // loses so much of their extent.
    const double lost = kRounding * (1.0 + kExtent / closest.distance);
    EXPECT_GT(separation<double>(GetParam(), x, offset.normalized()), closest.distance - lost) << i;
  }
}

TEST_P(PairOffsets, areTheSameBytesInBothKernels) {
  if (!wideKernelsSupported())
    GTEST_SKIP() << "no AVX2";
  const Pairs pairs;
  EXPECT_EQ(
      pairs.offsets(portableContactKernels(), GetParam()),
      pairs.offsets(wideContactKernels(), GetParam()));
}

INSTANTIATE_TEST_SUITE_P(
    Of,
    PairOffsets,
    testing::Values(PairKind::kVertexTriangle, PairKind::kEdgeEdge),
    [](const auto& tested) {
      return tested.param == PairKind::kVertexTriangle ? "vertexTriangle" : "edgeEdge";
    });

}  // namespace
}  // namespace bullet_ext
