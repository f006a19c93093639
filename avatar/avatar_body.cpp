#include "avatar/avatar_body.h"

#include "avatar/body_capsules.h"
#include "avatar/body_pose.h"
#include "avatar/skinning.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <stdexcept>

namespace avatar {
namespace {

using SkinningWeights = Eigen::SparseMatrix<double, Eigen::RowMajor>;

constexpr double kWeightUnits = 0x1p24;  // units of 2⁻²⁴ in a weight of 1
constexpr int kNumSharedJoints = 22;     // of SMPL that SMPL+H and SMPL-X begin with

struct JointWeight {
  int joint = 0;
  double weight = 0.0;
  std::int64_t units = 0;
};

std::vector<JointWeight> largestWeights(const SkinningWeights& weights, int row, int count) {
  std::vector<JointWeight> entries;
  for (SkinningWeights::InnerIterator it(weights, row); it; ++it) {
    if (!(it.value() >= 0.0) || !std::isfinite(it.value())) {
      throw std::invalid_argument(
          "limitedWeights: row " + std::to_string(row) + " has a negative or non-finite weight");
    }
    entries.push_back({static_cast<int>(it.col()), it.value()});
  }
  std::stable_sort(entries.begin(), entries.end(), [](const auto& a, const auto& b) {
    return a.weight > b.weight;
  });
  if (std::ssize(entries) > count) {
    entries.resize(static_cast<std::size_t>(count));
  }
  return entries;
}

/// Shares the units by the largest-remainder method, so that they add up exactly.
void distributeUnits(std::vector<JointWeight>& entries, int row) {
  double sum = 0.0;
  for (const JointWeight& entry : entries) {
    sum += entry.weight;
  }
  if (!(sum > 0.0) || !std::isfinite(sum)) {
    throw std::invalid_argument(
        "limitedWeights: row " + std::to_string(row) + " has no weight to share");
  }
  auto left = static_cast<std::int64_t>(kWeightUnits);
  for (JointWeight& entry : entries) {
    entry.weight *= kWeightUnits / sum;
    entry.units = static_cast<std::int64_t>(entry.weight);
    left -= entry.units;
  }
  std::stable_sort(entries.begin(), entries.end(), [](const auto& a, const auto& b) {
    return a.weight - static_cast<double>(a.units) > b.weight - static_cast<double>(b.units);
  });
  for (std::size_t i = 0; left > 0; i = (i + 1) % entries.size(), --left) {
    ++entries[i].units;
  }
  std::erase_if(entries, [](const JointWeight& entry) { return entry.units == 0; });
}

}  // namespace

SkinningWeights limitedWeights(const SkinningWeights& weights, int maxPerRow) {
  if (maxPerRow < 1) {
    throw std::invalid_argument("limitedWeights: maxPerRow must be at least 1");
  }
  std::vector<Eigen::Triplet<double>> kept;
  for (int row = 0; row < weights.rows(); ++row) {
    std::vector<JointWeight> entries = largestWeights(weights, row, maxPerRow);
    distributeUnits(entries, row);
    for (const JointWeight& entry : entries) {
      kept.emplace_back(row, entry.joint, static_cast<double>(entry.units) / kWeightUnits);
    }
  }
  SkinningWeights limited(weights.rows(), weights.cols());
  limited.setFromTriplets(kept.begin(), kept.end());
  return limited;
}

Eigen::Matrix3Xd roundedToFloat(const Eigen::Matrix3Xd& points) {
  return points.cast<float>().cast<double>();
}

std::vector<std::string> jointNames(int numJoints) {
  std::vector<std::string> names;
  names.reserve(static_cast<std::size_t>(std::max(numJoints, 0)));
  const int numKnown = numJoints == kNumSmplJoints ? kNumSmplJoints : kNumSharedJoints;
  for (int joint = 0; joint < numJoints; ++joint) {
    names.push_back(
        joint < numKnown ? std::string(kSmplJointNames[static_cast<std::size_t>(joint)])
                         : "joint_" + std::to_string(joint));
  }
  return names;
}

AvatarBody makeAvatarBody(const BodyModel& model, const Eigen::VectorXd& betas) {
  const ShapedBody shaped = Skinning(model).shape(betas);
  AvatarBody body;
  body.model = model.name;
  body.betas = betas;
  body.mesh = {roundedToFloat(shaped.vertices), model.faces};
  body.joints = roundedToFloat(shaped.joints);
  body.parents = model.parents;
  body.skinningWeights = limitedWeights(model.skinningWeights);
  body.capsules = fitBodyCapsules(body);
  return body;
}

}  // namespace avatar
