#include "avatar/digitization/garment_cut.h"

#include "avatar/default_body/embedded_body.h"
#include "avatar/digitization/between_legs.h"
#include "avatar/geometry/adjacency.h"
#include "avatar/geometry/polygonise.h"
#include "tests/support/primitive_meshes.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>

namespace avatar {
namespace {

bool isNowhere(const Eigen::Vector3d&) {
  return false;
}

/// A tube about the y axis whose radius grows from 0.15 to 0.20 m within 2 cm around y = 0.5, as
/// where a shirt ends above trousers; the skin is a tube of 0.13 m.
struct SteppedTube {
  OuterSurface surface;
  std::vector<std::uint8_t> labels;
  TriangleMesh skin = upright(test::cylinder(0.13, 1.0, 48, 40));

  static TriangleMesh upright(TriangleMesh mesh) {
    const Eigen::Matrix3Xd alongZ = mesh.vertices;
    mesh.vertices.row(1) = alongZ.row(2);
    mesh.vertices.row(2) = -alongZ.row(1);
    return mesh;
  }

  SteppedTube() {
    surface.mesh = upright(test::cylinder(0.15, 1.0, 48, 200));  // rows of 5 mm
    for (auto p : surface.mesh.vertices.colwise()) {
      const double share = std::clamp((p.y() - 0.49) / 0.02, 0.0, 1.0);
      const double scale = (0.15 + 0.05 * share) / 0.15;
      p.x() *= scale;
      p.z() *= scale;
      labels.push_back(p.y() > 0.5 ? kUpperLabel : kLowerLabel);
    }
  }
};

TEST(FabricLabels, TheStepUnderAHemIsNoFabric) {
  const SteppedTube tube;
  const std::vector<std::uint8_t> fabric =
      fabricLabels(tube.surface, tube.labels, SignedDistance(tube.skin), isNowhere);
  for (std::size_t v = 0; v < fabric.size(); ++v) {
    const double y = tube.surface.mesh.vertices(1, static_cast<Eigen::Index>(v));
    if (y > 0.493 && y < 0.507) {
      EXPECT_EQ(fabric[v], kNoLabel) << y;
    }
    if (y > 0.52) {
      EXPECT_EQ(fabric[v], kUpperLabel) << y;
    }
    if (y > 0.48 && y < 0.49) {
      EXPECT_EQ(fabric[v], kNoLabel) << "cut two centimetres from the upper garment, at " << y;
    }
    if (y < 0.46) {
      EXPECT_EQ(fabric[v], kLowerLabel) << y;
    }
  }
}

/// A tube of 0.15 m about the y axis in columns of 5 mm and rows of 1 cm, in cloth above y = 0.5,
/// about skin of 0.13 m.
struct ClothedTube {
  OuterSurface surface;
  std::vector<std::uint8_t> labels;

  ClothedTube() {
    surface.mesh = SteppedTube::upright(test::cylinder(0.15, 1.0, 192, 100));
    for (const auto& p : surface.mesh.vertices.colwise())
      labels.push_back(p.y() > 0.5 ? kUpperLabel : kSkinLabel);
  }

  /// From the direction of x, along the tube [m].
  double across(std::size_t v) const {
    const auto p = surface.mesh.vertices.col(static_cast<Eigen::Index>(v));
    return 0.15 * std::atan2(p.z(), p.x());
  }

  double height(std::size_t v) const {
    return surface.mesh.vertices(1, static_cast<Eigen::Index>(v));
  }

  std::vector<std::uint8_t> fabric() const {
    const TriangleMesh skin = SteppedTube::upright(test::cylinder(0.13, 1.0, 48, 40));
    return fabricLabels(surface, labels, SignedDistance(skin), isNowhere);
  }
};

TEST(FabricLabels, LooseEndsAreNoFabricButStrapsAre) {
  ClothedTube tube;
  const auto isTongue = [&](std::size_t v) {
    return std::abs(tube.across(v) - 0.2) < 0.011 && tube.height(v) > 0.4 && tube.height(v) < 0.505;
  };
  const auto isStrap = [&](std::size_t v) {
    return std::abs(tube.across(v) + 0.2) < 0.011 && tube.height(v) > 0.2 && tube.height(v) < 0.505;
  };
  for (std::size_t v = 0; v < tube.labels.size(); ++v) {
    if (isTongue(v) || isStrap(v) || tube.height(v) < 0.205)
      tube.labels[v] = kUpperLabel;
  }
  const std::vector<std::uint8_t> fabric = tube.fabric();
  for (std::size_t v = 0; v < fabric.size(); ++v) {
    // A tongue stays where it is rooted.
    if (!isTongue(v) || tube.height(v) > 0.495)
      EXPECT_EQ(fabric[v], tube.labels[v]) << tube.across(v) << " " << tube.height(v);
    else
      EXPECT_EQ(fabric[v], kNoLabel) << tube.across(v) << " " << tube.height(v);
  }
}

TEST(FabricLabels, AFoldFromTheHemUpIsNoSlit) {
  ClothedTube tube;
  // Cloth of one half lies 2 cm further out, and the wall between the halves stands across skin.
  for (std::size_t v = 0; v < tube.labels.size(); ++v) {
    const double share = std::clamp(0.5 + tube.across(v) / 0.009, 0.0, 1.0);
    auto p = tube.surface.mesh.vertices.col(static_cast<Eigen::Index>(v));
    p.x() *= 1.0 + 0.13 * share;
    p.z() *= 1.0 + 0.13 * share;
  }
  EXPECT_EQ(tube.fabric(), tube.labels);
}

/// Two legs in wide trousers under a shirt that ends at y = 0.5 m. Above y = 0.2 m the trouser legs
/// go over into each other, in front and behind, like a web.
struct WebbedLegs {
  OuterSurface surface;
  std::vector<std::uint8_t> labels;
  TriangleMesh skin = around([](const Eigen::Vector3d& p) { return legs(p, 0.05); });

  static constexpr double kApart = 0.07;  // of each leg's axis from the middle [m]

  static double legs(const Eigen::Vector3d& p, double radius) {
    return std::hypot(std::abs(p.x()) - kApart, p.z()) - radius;
  }

  static TriangleMesh around(const std::function<double(const Eigen::Vector3d&)>& distance) {
    const Eigen::AlignedBox3d box(Eigen::Vector3d(-0.3, 0.0, -0.2), Eigen::Vector3d(0.3, 0.7, 0.2));
    return polygonise(distance, {.box = box, .cellSize = 0.008});
  }

  WebbedLegs() {
    surface.mesh = around([](const Eigen::Vector3d& p) {
      const double web = std::max({std::abs(p.x()) - kApart, std::abs(p.z()) - 0.03, 0.2 - p.y()});
      const double trousers = std::min(legs(p, 0.065), web);
      const double shirt = std::max(std::hypot(p.x(), 1.2 * p.z()) - 0.17, 0.5 - p.y());
      return std::min(trousers, shirt);
    });
    for (const auto& p : surface.mesh.vertices.colwise())
      labels.push_back(p.y() > 0.5 ? kUpperLabel : kLowerLabel);
  }

  /// Share of the web, a little beneath the shirt, that is fabric.
  double webOfFabric(const std::function<bool(const Eigen::Vector3d&)>& betweenLegs) const {
    const std::vector<std::uint8_t> fabric =
        fabricLabels(surface, labels, SignedDistance(skin), betweenLegs);
    int total = 0;
    int kept = 0;
    for (std::size_t v = 0; v < fabric.size(); ++v) {
      const auto p = surface.mesh.vertices.col(static_cast<Eigen::Index>(v));
      if (std::abs(p.x()) > 0.01 || p.y() < 0.25 || p.y() > 0.45)
        continue;
      ++total;
      kept += fabric[v] == kLowerLabel ? 1 : 0;
    }
    return static_cast<double>(kept) / std::max(1, total);
  }
};

TEST(FabricLabels, WhatJoinsTrouserLegsIsFabricThoughItStandsAcrossTheSkin) {
  const WebbedLegs legs;
  EXPECT_LT(legs.webOfFabric(isNowhere), 0.1) << "as the step under the shirt's hem, it isn't";
  EXPECT_GT(
      legs.webOfFabric([](const Eigen::Vector3d& p) { return std::abs(p.x()) < 0.03; }), 0.99);
}

TEST(BetweenLegs, IsWhereOneLegsSkinIsOppositeTheOthers) {
  const BodyModel& model = defaultBody();
  const DressingBody body = standForDressing(model, Eigen::VectorXd::Zero(model.numBetas()));
  const BetweenLegs between(body);
  const Eigen::Vector3d left = 0.5 * (body.joints.col(kLeftHip) + body.joints.col(kLeftKnee));
  const Eigen::Vector3d right = 0.5 * (body.joints.col(kRightHip) + body.joints.col(kRightKnee));
  const Eigen::Vector3d middle = 0.5 * (left + right);
  EXPECT_TRUE(between.contains(middle));
  EXPECT_FALSE(between.contains(middle + Eigen::Vector3d(0.0, 0.0, 0.12))) << "before the thighs";
  EXPECT_FALSE(between.contains(middle - Eigen::Vector3d(0.0, 0.0, 0.12))) << "behind them";
  EXPECT_FALSE(between.contains(left + Eigen::Vector3d(0.12, 0.0, 0.0))) << "beside them";
  EXPECT_FALSE(between.contains(body.joints.col(kSpine1))) << "above them";
}

TEST(WithoutPinches, LeavesAManifold) {
  // Two tetrahedra that share a vertex, and a fin at an edge of one.
  TriangleMesh mesh;
  mesh.vertices.resize(3, 8);
  mesh.vertices << 0, 1, 0, 0, -1, 0, 0, 1,  //
      0, 0, 1, 0, 0, -1, 0, 1,               //
      0, 0, 0, 1, 0, 0, -1, 0;
  mesh.faces.resize(3, 9);
  mesh.faces << 0, 0, 0, 1, 0, 0, 0, 4, 1,  //
      2, 1, 3, 2, 5, 4, 6, 5, 2,            //
      1, 3, 2, 3, 4, 6, 5, 6, 7;
  const TriangleMesh clean = withoutPinches(mesh);
  EXPECT_TRUE(topology(clean.faces, clean.numVertices()).manifold());
  EXPECT_LT(clean.numFaces(), mesh.numFaces());
  const TriangleMesh ball = test::icosphere(1.0, 1);
  EXPECT_EQ(withoutPinches(ball).faces, ball.faces);
}

}  // namespace
}  // namespace avatar
