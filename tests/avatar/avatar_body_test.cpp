#include "avatar/avatar_body.h"

#include "avatar/body_pose.h"
#include "tests/support/synthetic_body.h"

#include <gtest/gtest.h>

#include <limits>
#include <set>

namespace avatar {
namespace {

using Weights = Eigen::SparseMatrix<double, Eigen::RowMajor>;

Weights rowOf(const std::vector<double>& values) {
  Weights weights(1, static_cast<Eigen::Index>(values.size()));
  for (std::size_t i = 0; i < values.size(); ++i)
    weights.insert(0, static_cast<Eigen::Index>(i)) = values[i];
  weights.makeCompressed();
  return weights;
}

Weights randomWeights(int perRow) {
  test::Noise noise(7);
  return test::randomConvexRows(noise, 500, 24, perRow);
}

TEST(LimitedWeights, RowsSumToExactlyOneInFloatAndInAnyOrder) {
  const Weights limited = limitedWeights(randomWeights(9));
  for (int v = 0; v < limited.rows(); ++v) {
    std::vector<float> row;
    for (Weights::InnerIterator it(limited, v); it; ++it) {
      row.push_back(static_cast<float>(it.value()));
      EXPECT_EQ(static_cast<double>(row.back()), it.value());
    }
    EXPECT_LE(row.size(), 4u);
    float forward = 0.0F;
    float backward = 0.0F;
    for (std::size_t i = 0; i < row.size(); ++i) {
      forward += row[i];
      backward += row[row.size() - 1 - i];
    }
    EXPECT_EQ(forward, 1.0F);
    EXPECT_EQ(backward, 1.0F);
  }
}

TEST(LimitedWeights, KeepsTheLargestInProportion) {
  const Eigen::MatrixXd limited = limitedWeights(rowOf({0.1, 0.3, 0.02, 0.2, 0.08, 0.3}));
  const double kept = 0.1 + 0.3 + 0.2 + 0.3;
  const Eigen::RowVectorXd expected =
      (Eigen::RowVectorXd(6) << 0.1, 0.3, 0.0, 0.2, 0.0, 0.3).finished() / kept;
  EXPECT_LE((limited - expected).cwiseAbs().maxCoeff(), 0x1p-24);  // one unit of rounding
}

TEST(LimitedWeights, OfEqualWeightsTheLowerJointsStay) {
  const Eigen::MatrixXd limited = limitedWeights(rowOf({0.25, 0.25, 0.25, 0.25}), 2);
  EXPECT_EQ(limited, Eigen::RowVector4d(0.5, 0.5, 0.0, 0.0));
}

TEST(LimitedWeights, ChangesNothingTheSecondTime) {
  const Weights once = limitedWeights(randomWeights(7));
  const Weights twice = limitedWeights(once);
  EXPECT_EQ(Eigen::MatrixXd(once), Eigen::MatrixXd(twice));
  EXPECT_EQ(once.nonZeros(), twice.nonZeros());
}

TEST(LimitedWeights, RefusesWhatIsNoWeight) {
  EXPECT_THROW(limitedWeights(rowOf({0.5, -0.1})), std::invalid_argument);
  EXPECT_THROW(limitedWeights(rowOf({0.0, 0.0})), std::invalid_argument);
  EXPECT_THROW(
      limitedWeights(rowOf({1.0, std::numeric_limits<double>::quiet_NaN()})),
      std::invalid_argument);
  EXPECT_THROW(limitedWeights(rowOf({1.0}), 0), std::invalid_argument);
}

TEST(JointNames, AreSmplsWhereTheBodiesAgreeAndAllDifferent) {
  EXPECT_EQ(jointNames(24)[kLeftHand], "left_hand");
  for (const int count : {1, 22, 24, 52, 55, 300}) {
    const std::vector<std::string> names = jointNames(count);
    EXPECT_EQ(names[0], "pelvis");
    EXPECT_EQ(std::set<std::string>(names.begin(), names.end()).size(), names.size());
  }
  // Joint 22 of SMPL-X is the jaw: not the hand that it is of SMPL.
  EXPECT_EQ(jointNames(55)[kLeftHand], "joint_22");
}

}  // namespace
}  // namespace avatar
