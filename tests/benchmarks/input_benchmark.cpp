// input_benchmark [RECORDING]: what a frame costs from decoded pictures to the person's points and
// normals, on one core, by stages; with a recording also its decoding, apart.

#include "src/input/depth_preparation.h"
#include "src/input/recording.h"
#include "tests/benchmarks/benchmark.h"
#include "tests/src/input/synthetic_room.h"

#include <algorithm>
#include <exception>

namespace {

using namespace simulcap;

constexpr int kRepeats = 60;

/// A person at 2.6 m (or half a person at 1.1 m) before a wall, 640 × 480.
RgbdFrame syntheticFrame(avatar::Camera& camera, bool close) {
  camera = test::roomCamera();
  if (close)
    camera.cameraFromWorld = avatar::lookAt({0.0, 1.3, 1.1}, {0.0, 1.3, 0.0});
  camera = scaledResolution(camera, 2);
  test::Room room{.camera = camera};
  room.addFloor();
  room.addWall(-1.5);
  room.addPerson(avatar::makeClip("turn").frames.front(), Eigen::Vector3d::Zero());
  return picture(room).frame;
}

void reportStages(const RgbdFrame& frame, const avatar::Camera& camera) {
  const auto numPixels = static_cast<double>(frame.depth.size());
  DepthPreparation prepare(camera);
  DepthCloud cloud = prepare(frame);
  const CoarseDepth coarse = coarseDepth(cloud.depth, camera);
  const SceneLayout layout = findLayout(coarse);
  PersonTracker tracker(layout);
  const auto cells = tracker.next(coarse);
  const auto time = [&](const char* name, const auto& stage) {
    benchmark::report(
        name, benchmark::measure(kRepeats, [&] { benchmark::keep(stage()); }), numPixels);
  };
  time("  clean", [&] { return cleanDepth(frame.depth, frame.width, frame.height); });
  time("  coarse", [&] { return coarseDepth(cloud.depth, camera); });
  time("  person's cells", [&] { return tracker.next(coarse); });
  const auto timeInPlace = [&](const char* name, const auto& stage) {
    const auto timing = benchmark::measure(kRepeats, [&] { cloud = stage(std::move(cloud)); });
    benchmark::report(name, timing, numPixels);
  };
  timeInPlace("  person's pixels", [&](DepthCloud c) {
    return withPerson(std::move(c), camera, coarse, cells, layout.floor);
  });
  timeInPlace("  points, normals", [&](DepthCloud c) { return withSurface(std::move(c), camera); });
  timeInPlace("  all", [&](DepthCloud c) { return prepare(frame, std::move(c)); });
  time("  all, in new memory", [&] { return prepare(frame); });
  benchmark::report(
      "  (floor and walls, first frame only)",
      benchmark::measure(3, [&] { benchmark::keep(findLayout(coarse)); }),
      numPixels);
}

void reportRecording(const std::string& folder) {
  constexpr int kMaxFrames = 100;
  const auto source = openRecording(folder);
  DepthPreparation prepare(source->info().camera);
  std::vector<double> decode;
  std::vector<double> preparation;
  DepthCloud cloud;
  for (int i = 0; i < kMaxFrames; ++i) {
    std::optional<RgbdFrame> frame;
    decode.push_back(1e3 * benchmark::measure(1, [&] { frame = source->next(); }).minSeconds);
    if (!frame)
      break;
    preparation.push_back(
        1e3 * benchmark::measure(1, [&] { cloud = prepare(*frame, std::move(cloud)); }).minSeconds);
  }
  std::sort(decode.begin(), decode.end());
  std::sort(preparation.begin(), preparation.end());
  std::printf(
      "%s: decoding median %.2f ms; preparation min %.2f ms, median %.2f ms\n",
      folder.c_str(),
      decode[decode.size() / 2],
      preparation.front(),
      preparation[preparation.size() / 2]);
}

}  // namespace

int main(int argc, char** argv) {
  try {
    benchmark::reportCalibration();
    for (const bool close : {false, true}) {
      avatar::Camera camera;
      const RgbdFrame frame = syntheticFrame(camera, close);
      std::printf(close ? "half a person, 1.1 m\n" : "whole person, 2.6 m\n");
      reportStages(frame, camera);
    }
    if (argc > 1)
      reportRecording(argv[1]);
  } catch (const std::exception& error) {
    std::fprintf(stderr, "%s\n", error.what());
    return 1;
  }
  return 0;
}
