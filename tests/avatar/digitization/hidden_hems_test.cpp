#include "avatar/digitization/hidden_hems.h"

#include "avatar/body_pose.h"
#include "avatar/default_body/embedded_body.h"
#include "avatar/digitization/limbs.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <stdexcept>
#include <vector>

namespace avatar {
namespace {

/// A body as the surface of somebody in a T-shirt whose sleeves end in planes across the arms.
class HiddenHemsTest : public testing::Test {
 protected:
  HiddenHemsTest() {
    for (std::size_t v = 0; v < limbs_.size(); ++v) {
      const Eigen::Vector3d point = body_.vertices.col(static_cast<Eigen::Index>(v));
      const bool isArm = limbs_[v] != kTrunkAndLegs;
      truth_.push_back(!isArm || beyondHem(limbs_[v], point) < 0.0 ? kUpperLabel : kSkinLabel);
    }
  }

  /// How far beyond the hem's plane along the arm [m]; the plane leans by a fifth.
  double beyondHem(Limb arm, const Eigen::Vector3d& point) const {
    const LimbAxis& axis = axes_[arm];
    return axis.along(point) - 0.14 - 0.2 * axis.across(point).x();
  }

  /// Seen often but for what is lower than so much about the arm's axis [m].
  OuterSurface seenAbove(double level) const {
    OuterSurface surface;
    surface.mesh = {body_.vertices, model_.faces};
    for (std::size_t v = 0; v < limbs_.size(); ++v) {
      LabelCounts counts = {};
      if (!isHidden(v, level))
        counts[truth_[v] - 1U] = 50;
      surface.labels.push_back(counts);
    }
    return surface;
  }

  /// The underside of an arm.
  bool isHidden(std::size_t v, double level) const {
    if (limbs_[v] == kTrunkAndLegs)
      return false;
    const LimbAxis& axis = axes_[limbs_[v]];
    const Eigen::Vector3d point = body_.vertices.col(static_cast<Eigen::Index>(v));
    const Eigen::Vector3d onAxis = axis.start + axis.along(point) * axis.direction;
    return axis.along(point) > 0.0 && point.y() - onAxis.y() < level;
  }

  /// The truth but for the hidden vertices of arms: these have one label.
  std::vector<std::uint8_t> guessed(SurfaceLabel label, double level) const {
    std::vector<std::uint8_t> labels = truth_;
    for (std::size_t v = 0; v < labels.size(); ++v) {
      if (isHidden(v, level))
        labels[v] = label;
    }
    return labels;
  }

  /// The most that a vertex with a wrong label is from the hem [m]; 0 when all are right.
  double farthestWrong(const std::vector<std::uint8_t>& labels) const {
    double farthest = 0.0;
    for (std::size_t v = 0; v < labels.size(); ++v) {
      const Eigen::Vector3d point = body_.vertices.col(static_cast<Eigen::Index>(v));
      if (labels[v] != truth_[v])
        farthest = std::max(farthest, std::abs(beyondHem(limbs_[v], point)));
    }
    return farthest;
  }

  const BodyModel& model_ = defaultBody();
  DressingBody body_ = standForDressing(model_, Eigen::VectorXd::Zero(model_.numBetas()));
  std::vector<Limb> limbs_ = limbsOfSurface(body_.mesh(), body_);
  std::array<LimbAxis, kNumLimbs> axes_ = limbAxes(body_);
  std::vector<std::uint8_t> truth_;
};

TEST_F(HiddenHemsTest, ContinuesTheHemThatWasSeen) {
  constexpr double kLevel = -0.01;
  const OuterSurface surface = seenAbove(kLevel);
  // A slit up to the armpit, and a sleeve that runs on to the hand.
  for (const SurfaceLabel guess : {kSkinLabel, kUpperLabel}) {
    const std::vector<std::uint8_t> labels = guessed(guess, kLevel);
    ASSERT_GT(farthestWrong(labels), 0.1);
    // The hem is known to half of the body's edges, 2 cm long here.
    EXPECT_LT(farthestWrong(withHiddenHems(surface, labels, body_)), 0.015);
  }
}

TEST_F(HiddenHemsTest, LeavesWhatWasSeenAlone) {
  EXPECT_EQ(withHiddenHems(seenAbove(-1.0), truth_, body_), truth_);
}

TEST_F(HiddenHemsTest, GuessesNothingFromLessThanHalfAHem) {
  constexpr double kLevel = 0.03;
  const std::vector<std::uint8_t> labels = guessed(kUpperLabel, kLevel);
  EXPECT_EQ(withHiddenHems(seenAbove(kLevel), labels, body_), labels);
}

TEST_F(HiddenHemsTest, RefusesLabelsOfAnotherSurface) {
  EXPECT_THROW(withHiddenHems(seenAbove(-1.0), {kSkinLabel}, body_), std::invalid_argument);
  EXPECT_THROW(
      withHiddenHems(seenAbove(-1.0), truth_, body_, {.leastSeen = 0.0}), std::invalid_argument);
}

}  // namespace
}  // namespace avatar
