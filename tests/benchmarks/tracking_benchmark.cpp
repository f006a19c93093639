// Tracks built-in clips of a person in loose clothes as a Kinect sees them: error and time.
//   tracking_benchmark [SECONDS [SEEDS [CLIP …]]]

#include "avatar/axis_angle.h"
#include "avatar/default_body/embedded_body.h"
#include "avatar/io/prior_file.h"
#include "avatar/motion_clips.h"
#include "src/tracking/body_tracker.h"
#include "src/tracking/depth_matches.h"
#include "src/tracking/match_quality.h"
#include "src/tracking/pose_solver.h"
#include "src/tracking/surface_visibility.h"
#include "tests/benchmarks/benchmark.h"
#include "tests/src/tracking/clothed_sequence.h"

#include <cmath>
#include <cstdlib>
#include <ctime>
#include <numbers>
#include <numeric>

namespace {

using namespace simulcap;  // NOLINT(google-build-using-namespace)

avatar::Camera kinect() {
  avatar::Camera camera{
      .width = 640, .height = 480, .fx = 525.0, .fy = 525.0, .cx = 319.5, .cy = 239.5};
  camera.cameraFromWorld =
      avatar::lookAt(Eigen::Vector3d(0.3, 1.2, 2.8), Eigen::Vector3d(0.0, 0.9, 0.0));
  return camera;
}

/// Processor time of one call [s]: on a busy machine steps of many milliseconds never run
/// undisturbed.
template <typename Function>
double processorSeconds(const Function& function) {
  const std::clock_t start = std::clock();
  function();
  return static_cast<double>(std::clock() - start) / CLOCKS_PER_SEC;
}

benchmark::Timing processorTime(int repeats, const auto& function) {
  std::vector<double> seconds;
  for (int i = 0; i < repeats; ++i)
    seconds.push_back(processorSeconds(function));
  std::sort(seconds.begin(), seconds.end());
  return {seconds.front(), seconds[seconds.size() / 2]};
}

struct Score {
  std::vector<double> joints;   // [m], one per frame and joint
  std::vector<double> yaws;     // |tracked − true| of the pelvis, one per frame [rad]
  std::vector<double> seconds;  // one per frame but the first
  int lost = 0;
  int silent = 0;  // frames with a joint more than 80 mm off that nothing warned of
};

double quantile(std::vector<double> values, double share) {
  if (values.empty())
    return 0.0;
  std::sort(values.begin(), values.end());
  return values[static_cast<std::size_t>(share * static_cast<double>(values.size() - 1))];
}

double mean(const std::vector<double>& values) {
  return std::accumulate(values.begin(), values.end(), 0.0) /
         static_cast<double>(std::max<std::size_t>(1, values.size()));
}

double yawOf(const avatar::BodyPose& pose) {
  const Eigen::Matrix3d root =
      avatar::quaternionFromAxisAngle(pose.jointRotations.head<3>()).toRotationMatrix();
  return std::atan2(root(0, 2), root(2, 2));
}

struct Take {
  std::string clip;
  double seconds = 0.0;
  std::uint32_t seed = 0;
  bool knownBetas = false;
};

void add(const Score& from, Score& to) {
  to.joints.insert(to.joints.end(), from.joints.begin(), from.joints.end());
  to.yaws.insert(to.yaws.end(), from.yaws.begin(), from.yaws.end());
  to.seconds.insert(to.seconds.end(), from.seconds.begin(), from.seconds.end());
  to.lost += from.lost;
  to.silent += from.silent;
}

void compare(
    const avatar::BodyPose& truth,
    const TrackedBody& tracked,
    const Eigen::Matrix3Xd& offsets,
    Score& score) {
  bool silent = false;
  for (int j = 0; j < avatar::kNumSmplJoints; ++j) {
    const double error = offsets.col(j).norm();
    score.joints.push_back(error);
    constexpr double kFarOff = 0.08;  // [m]
    silent |= error > kFarOff && !tracked.jointLost[static_cast<std::size_t>(j)];
  }
  score.silent += silent ? 1 : 0;
  score.lost += tracked.status == TrackingStatus::kLost ? 1 : 0;
  score.yaws.push_back(
      std::abs(std::remainder(yawOf(truth) - yawOf(tracked.pose), 2.0 * std::numbers::pi)));
}

Score track(const Take& take) {
  const avatar::BodyModel& model = avatar::defaultBody();
  constexpr double kLooseness = 0.018;  // [m]
  const test::ClothedPerson person(model, take.seed, kLooseness, 0.7);
  avatar::ClipOptions clip{.seconds = take.seconds};
  clip.body = person.skeleton();
  const avatar::Motion motion = avatar::makeClip(take.clip, clip);
  const avatar::Camera camera = kinect();
  BodyTracker tracker(model, camera);
  if (take.knownBetas)
    tracker.setBetas(person.betas());
  const avatar::Skinning skinning(model);
  Score score;
  for (std::size_t i = 0; i < motion.frames.size(); ++i) {
    const avatar::BodyPose& truth = motion.frames[i];
    const DepthCloud cloud = person.cloud(
        truth,
        camera,
        {{.model = SensorModel::kKinectV1, .seed = take.seed}, static_cast<std::uint32_t>(i)});
    TrackedBody tracked;
    const double seconds = processorSeconds(
        [&] { tracked = tracker.track(cloud, static_cast<double>(i) / motion.framesPerSecond); });
    if (i > 0)
      score.seconds.push_back(seconds);
    const auto joints = skinning.pose(skinning.shape(tracker.betas()), tracked.pose).joints;
    const Eigen::Matrix3Xd off = joints - person.joints(truth);
    compare(truth, tracked, off, score);
  }
  return score;
}

void print(const std::string& name, const Score& score) {
  constexpr double kDegrees = 180.0 / std::numbers::pi;
  std::printf(
      "%-24s joints mean %5.1f  p95 %5.1f  max %5.1f mm   yaw mean %4.1f  max %4.1f deg   "
      "lost %d  silent %d   median %6.2f ms\n",
      name.c_str(),
      1e3 * mean(score.joints),
      1e3 * quantile(score.joints, 0.95),
      1e3 * quantile(score.joints, 1.0),
      kDegrees * mean(score.yaws),
      kDegrees * quantile(score.yaws, 1.0),
      score.lost,
      score.silent,
      1e3 * quantile(score.seconds, 0.5));
  std::fflush(stdout);
}

/// The parts of one Gauss–Newton step, and what is done once per frame.
void stages() {
  const avatar::BodyModel& model = avatar::defaultBody();
  const test::ClothedPerson person(model, 1, 0.018, 0.0);
  const avatar::Camera camera = kinect();
  BodyParameters at{avatar::aPose(), Eigen::VectorXd::Zero(10)};
  at.pose.translation.y() = -person.skeleton().floorHeight;
  const DepthCloud cloud = person.cloud(at.pose, camera, {});
  const TrackerOptions options;
  const TrackedSurface surface(model, options.numSamples);
  const PoseRegularizer regularizer(avatar::PosePrior(avatar::builtInPrior()));
  const DepthView view(cloud, camera, options.numDepthSamples);
  const std::vector<std::uint8_t> visible = visibleSamples(surface, at, camera);
  const PosedSamples posed = surface.pose(at, false);
  const PosedSamples shaped = surface.pose(at, true);
  const auto constraints = depthMatches(surface, posed, visible, view, {});
  const auto stage = [](const char* name, const auto& function) {
    benchmark::report(name, processorTime(60, function));
  };
  stage("depth view", [&] { benchmark::keep(DepthView(cloud, camera, options.numDepthSamples)); });
  stage("visibility", [&] { benchmark::keep(visibleSamples(surface, at, camera)); });
  stage("posing the samples", [&] { benchmark::keep(surface.pose(at, false)); });
  stage("posing, with betas", [&] { benchmark::keep(surface.pose(at, true)); });
  stage("matches", [&] { benchmark::keep(depthMatches(surface, posed, visible, view, {})); });
  stage("equations", [&] { benchmark::keep(treeEquations(surface, posed, constraints)); });
  stage("equations, with betas", [&] {
    benchmark::keep(treeEquations(surface, shaped, constraints));
  });
  stage("regularization", [&] {
    avatar::NormalEquations equations(TrackingLayout::kBetas);
    benchmark::keep(regularizer.add(at, at.pose, {}, equations));
  });
  stage("quality", [&] { benchmark::keep(matchQuality(surface, posed, visible, view)); });
  BodyParameters off = at;
  off.pose.translation += Eigen::Vector3d(0.02, 0.0, 0.02);
  off.pose.jointRotations.segment<3>(3 * avatar::kLeftShoulder).z() += 0.2;
  stage("six steps", [&] { benchmark::keep(solvePose(surface, regularizer, view, off, {})); });
  PoseSolverOptions shapeToo;
  shapeToo.betas = {at.betas, Eigen::MatrixXd::Identity(10, 10)};
  stage("six steps, with betas", [&] {
    benchmark::keep(solvePose(surface, regularizer, view, off, shapeToo));
  });
  std::printf("(%zu constraints of %zu samples)\n", constraints.size(), surface.samples().size());
}

}  // namespace

int main(int argc, char** argv) {
  const double seconds = argc > 1 ? std::atof(argv[1]) : 2.0;
  const auto seeds = static_cast<std::uint32_t>(argc > 2 ? std::atoi(argv[2]) : 2);
  std::vector<std::string> clips(argv + std::min(argc, 3), argv + argc);
  if (clips.empty())
    clips = {"walk_in_place", "turn", "arm_raise", "jumping_jack"};
  benchmark::reportCalibration();
  stages();
  for (const bool knownBetas : {true, false}) {
    Score all;
    for (const std::string& clip : clips) {
      Score score;
      for (std::uint32_t seed = 1; seed <= seeds; ++seed)
        add(track({clip, seconds, seed, knownBetas}), score);
      print(clip + (knownBetas ? ", betas known" : ", betas found"), score);
      add(score, all);
    }
    print(knownBetas ? "all, betas known" : "all, betas found", all);
  }
  benchmark::reportCalibration();
  return 0;
}
