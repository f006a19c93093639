#include "avatar/default_body/embedded_body.h"
#include "avatar/io/avatar_file.h"
#include "src/capture/tracked_recording.h"
#include "src/capture_session.h"
#include "tests/benchmarks/benchmark.h"

#include <algorithm>
#include <cstddef>
#include <cstdio>
#include <cstdlib>
#include <time.h>
#include <vector>

namespace {

using namespace simulcap;  // NOLINT(google-build-using-namespace)

/// Least of all runs [ms].
struct FrameCost {
  double simulation = 1e9, fitting = 1e9;  ///< wall time
  double processor = 1e9;                  ///< of all threads; other programs don't count

  double wall() const { return simulation + fitting; }
};

double processorMs() {
  timespec time = {};
  clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &time);
  return 1e3 * static_cast<double>(time.tv_sec) + 1e-6 * static_cast<double>(time.tv_nsec);
}

/// One run over the frames; every frame's cost replaces a higher one of an earlier run.
void captureAll(
    const CapturePerson& person,
    const avatar::Camera& camera,
    const std::vector<ObservedFrame>& frames,
    const CaptureOptions& options,
    int threads,
    std::vector<FrameCost>& costs) {
  CaptureSession session(person, camera, options, threads);
  session.dress(frames.front().body.pose);
  for (std::size_t i = 0; i < frames.size(); ++i) {
    const double start = processorMs();
    const FrameTimes times = session.processFrame(frames[i]).times;
    costs[i].processor = std::min(costs[i].processor, processorMs() - start);
    costs[i].simulation = std::min(costs[i].simulation, times.simulation);
    costs[i].fitting = std::min(costs[i].fitting, times.fitting);
  }
}

/// Mean over the frames [ms].
FrameCost meanOf(const std::vector<FrameCost>& costs) {
  FrameCost mean = {0.0, 0.0, 0.0};
  const auto count = static_cast<double>(costs.size());
  for (const FrameCost& cost : costs) {
    mean.simulation += cost.simulation / count;
    mean.fitting += cost.fitting / count;
    mean.processor += cost.processor / count;
  }
  return mean;
}

}  // namespace

/// Time of the clothes of a captured frame: the mean over frames of the least of several equal
/// runs. Bodies are tracked beforehand.
/// THREADS 0: with one and with two. With "literal", in the paper's own way.
///   capture_benchmark RECORDING AVATAR [FIRST [FRAMES [RUNS [THREADS [literal]]]]]
int main(int argc, char** argv) {
  if (argc < 3) {
    std::fprintf(
        stderr,
        "usage: capture_benchmark RECORDING AVATAR [FIRST [FRAMES [RUNS [THREADS [literal]]]]]\n");
    return 2;
  }
  const auto number = [&](int i, int otherwise) {
    return argc > i ? std::atoi(argv[i]) : otherwise;
  };
  const avatar::LayeredAvatar dressed = avatar::readAvatar(argv[2]);
  const avatar::BodyModel model = avatar::loadBody(dressed.body.model);
  const CapturePerson person{model, dressed};
  TrackedRecording recording(
      argv[1],
      {.model = model,
       .betas = dressed.body.betas,
       .outer = outerLayer(draped(person, 1)),
       .poses = {}},
      {.first = number(3, 0), .count = number(4, 24)});
  std::vector<ObservedFrame> frames;
  for (auto frame = recording.next(); frame; frame = recording.next()) {
    frames.push_back(frame->observed);
  }
  if (frames.empty()) {
    std::fprintf(stderr, "capture_benchmark: nobody was found\n");
    return 1;
  }
  const CaptureOptions options = argc > 7 ? CaptureOptions::literal() : CaptureOptions{};
  const int only = number(6, 0);
  benchmark::reportCalibration();
  for (int threads = only > 0 ? only : 1; threads <= (only > 0 ? only : 2); ++threads) {
    std::vector<FrameCost> costs(frames.size());
    for (int run = 0; run < number(5, 3); ++run) {
      captureAll(person, recording.camera(), frames, options, threads, costs);
    }
    const FrameCost mean = meanOf(costs);
    std::printf(
        "%d threads: simulation %6.2f, fitting %6.2f, together %6.2f ms per frame; %6.2f ms of "
        "processor time\n",
        threads,
        mean.simulation,
        mean.fitting,
        mean.wall(),
        mean.processor);
  }
  benchmark::reportCalibration();
  return 0;
}
