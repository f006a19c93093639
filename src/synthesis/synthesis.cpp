#include "src/synthesis/synthesis.h"

#include "avatar/geometry/measures.h"
#include "avatar/motion.h"
#include "src/program/parallel_for.h"
#include "src/simulation/scene_run.h"
#include "src/synthesis/capture_scenes.h"
#include "src/synthesis/depth_sensor.h"
#include "src/synthesis/render_frame.h"
#include "src/synthesis/room.h"
#include "src/synthesis/sequence_writer.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <future>
#include <mutex>
#include <numbers>
#include <utility>

namespace simulcap {
namespace {

/// One frame's surfaces, waiting to be rendered.
struct Moment {
  int frame = 0;
  Eigen::Matrix3Xd skin;                 // 3 × V [m]
  std::vector<Eigen::Matrix3Xd> cloths;  // in the stage's order
};

/// Kinect v1 gives whole millimetres; the others are kept to 0.2 mm.
double depthScale(const Scene& scene) {
  const bool kinect = scene.sensor && scene.sensor->model == SensorModel::kKinectV1;
  return kinect ? 1000.0 : 5000.0;
}

std::vector<double> headings(const Stage& stage) {
  std::vector<double> all;
  const auto& poses = stage.body->poses();
  for (auto i = static_cast<std::size_t>(stage.numPrerollFrames); i < poses.size(); ++i)
    all.push_back(avatar::heading(poses[i]));
  return all;
}

/// As others find it, wherever they are started: "default" or an absolute path.
std::string bodyModelName(const Scene& scene) {
  const std::string& model = scene.body->model;
  return model == "default" ? model : std::filesystem::absolute(model).string();
}

SequenceLayout layoutOf(const Scene& scene, const Stage& stage) {
  SequenceLayout layout;
  layout.camera = scene.camera->camera();
  layout.backCamera = backCamera(*scene.camera);
  layout.depthScale = depthScale(scene);
  layout.framesPerSecond = stage.framesPerSecond;
  layout.turnaroundFrames = turnaroundFrames(headings(stage));
  layout.bodyModel = bodyModelName(scene);
  layout.betas = stage.body->betas();
  layout.meshes.push_back(
      {"body_vertices", stage.body->model().numVertices(), stage.body->model().faces});
  for (const StagedCloth& cloth : stage.cloths)
    layout.meshes.push_back({"garment_" + cloth.name, cloth.rest.numVertices(), cloth.rest.faces});
  return layout;
}

/// All that the body ever touches, with room for clothes; every tenth frame tells enough.
Eigen::AlignedBox3d reach(const StagedBody& body) {
  constexpr int kStride = 10;
  constexpr double kMargin = 0.2;  // [m]
  Eigen::AlignedBox3d box;
  for (std::size_t i = 0; i < body.poses().size(); i += kStride) {
    const Eigen::Matrix3Xd skin = body.vertices(static_cast<int>(i));
    box.extend(skin.rowwise().minCoeff());
    box.extend(skin.rowwise().maxCoeff());
  }
  box.min().array() -= kMargin;
  box.max().array() += kMargin;
  return box;
}

/// Turns moments into pictures.
class Studio {
 public:
  Studio(const Scene& scene, const Stage& stage, const SequenceLayout& layout)
      : scene_(scene),
        stage_(stage),
        camera_(layout.camera),
        backCamera_(layout.backCamera),
        bodyColors_(bodyColors(stage.body->model(), stage.body->shaped(), scene.truth.seed)) {
    if (scene.room)
      room_ = makeRoom(
          scene.room->seed, {.person = reach(*stage.body), .camera = scene.camera->position});
  }

  SequencePictures pictures(const Moment& moment) const {
    const SceneSensor sensor = scene_.sensor.value_or(SceneSensor{});
    const auto frame = static_cast<std::uint32_t>(moment.frame);
    std::vector<VisibleMesh> meshes = person(moment);
    SequencePictures result;
    if (moment.frame % scene_.truth.backStride == 0)
      result.backDepth = renderDepth(meshes, backCamera_);
    for (const RoomThing& thing : room_.things)
      meshes.push_back({thing.mesh, kBackground, nullptr, thing.pattern});
    ExactFrame exact = renderFrame(meshes, camera_, {.lights = room_.lights});
    result.depth = applySensor(exact.depth, camera_, {sensor, frame});
    result.color = sensor.model == SensorModel::kIdeal
                       ? std::move(exact.color)
                       : photographed(exact.color, sensor.seed, frame);
    result.labels = std::move(exact.labels);
    return result;
  }

 private:
  std::vector<VisibleMesh> person(const Moment& moment) const {
    std::vector<VisibleMesh> meshes;
    meshes.push_back({{moment.skin, stage_.body->model().faces}, kSkin, &bodyColors_});
    for (std::size_t i = 0; i < stage_.cloths.size(); ++i) {
      const StagedCloth& cloth = stage_.cloths[i];
      meshes.push_back(
          {{moment.cloths[i], cloth.rest.faces},
           labelOf(cloth),
           nullptr,
           clothPattern(scene_.truth.seed, static_cast<std::uint32_t>(i)),
           &cloth.rest.vertices});
    }
    return meshes;
  }

  const Scene& scene_;
  const Stage& stage_;
  avatar::Camera camera_, backCamera_;
  Eigen::Matrix3Xd bodyColors_;
  Room room_;
};

Moment momentOf(const Stage& stage, const SceneRun& run, int staged) {
  Moment moment;
  moment.frame = staged - stage.numPrerollFrames;
  moment.skin = stage.body->vertices(staged);
  for (std::size_t i = 0; i < stage.cloths.size(); ++i)
    moment.cloths.push_back(run.vertices(static_cast<int>(i)));
  return moment;
}

/// Seconds since it was made.
class Stopwatch {
 public:
  double seconds() const {
    return std::chrono::duration<double>(std::chrono::steady_clock::now() - start_).count();
  }

 private:
  std::chrono::steady_clock::time_point start_ = std::chrono::steady_clock::now();
};

/// Makes and writes the pictures of moments while others are simulated: with several threads, one
/// batch at a time on threads of its own.
class Darkroom {
 public:
  Darkroom(const Studio& studio, SequenceWriter& writer, int threads)
      : studio_(studio), writer_(writer), threads_(threads) {}

  /// Waits for the batch before, and throws what that threw.
  void develop(std::vector<Moment> moments) {
    wait();
    const auto policy = threads_ > 1 ? std::launch::async : std::launch::deferred;
    running_ = std::async(policy, [this, batch = std::move(moments)] {
      parallelFor(static_cast<long>(batch.size()), std::max(1, threads_ - 1), [&](long i) {
        develop(batch[static_cast<std::size_t>(i)]);
      });
    });
    if (threads_ == 1)
      wait();
  }

  void wait() {
    if (running_.valid())
      running_.get();
  }

  /// Adds what it took so far; nothing may be running.
  void report(SynthesisTimes& times) const {
    times.picturing += picturing_;
    times.compressing += compressing_;
  }

 private:
  void develop(const Moment& moment) {
    const Stopwatch picturing;
    const SequencePictures pictures = studio_.pictures(moment);
    const double made = picturing.seconds();
    writer_.writePictures(moment.frame, pictures);
    const std::lock_guard lock(mutex_);
    picturing_ += made;
    compressing_ += picturing.seconds() - made;
  }

  const Studio& studio_;
  const SequenceWriter& writer_;
  int threads_;
  std::mutex mutex_;
  double picturing_ = 0.0, compressing_ = 0.0;  // [s]
  std::future<void> running_;                   // last, so that it ends before what it uses
};

/// Says which worn clothes haven't come to rest when frame 0 is reached.
void noteMovement(const Stage& stage, const SceneRun& run, std::vector<std::string>& notes) {
  constexpr double kRest = 0.01;  // a third of a millimetre per frame [m/s]
  for (std::size_t i = 0; i < stage.cloths.size(); ++i) {
    if (labelOf(stage.cloths[i]) == PixelLabel::kBackground)
      continue;
    const double speed = run.world().velocities(static_cast<int>(i)).colwise().norm().mean();
    if (speed <= kRest)
      continue;
    char text[160];
    std::snprintf(
        text,
        sizeof text,
        "'%s' still moves at %.0f mm/s when frame 0 is reached: give truth.settle_seconds more "
        "time",
        stage.cloths[i].name.c_str(),
        1000.0 * speed);
    notes.emplace_back(text);
  }
}

}  // namespace

avatar::Camera backCamera(const SceneCamera& camera) {
  SceneCamera back = camera;
  back.position = 2.0 * camera.target - camera.position;
  back.position.y() = camera.position.y();
  return back.camera();
}

std::optional<int> turnaroundFrames(const std::vector<double>& headings) {
  constexpr double kWholeTurn = 355.0 / 180.0 * std::numbers::pi;
  double turned = 0.0;
  for (std::size_t i = 1; i < headings.size(); ++i) {
    turned += std::remainder(headings[i] - headings[i - 1], 2.0 * std::numbers::pi);
    if (std::abs(turned) >= kWholeTurn)
      return static_cast<int>(i) + 1;
  }
  return std::nullopt;
}

SynthesisReport synthesize(
    const Scene& scene, const std::filesystem::path& sequence, const SynthesisOptions& options) {
  // Per frame, of clothes that are being put on: about critical damping of a soft skirt's swing, of
  // a second, which by itself would last for half a minute.
  constexpr double kPrerollMomentum = 0.7;
  constexpr std::size_t kBatch = 4;  // moments; two batches are in memory at a time
  requireReplaceable(sequence);      // before the minutes that it takes
  const Stopwatch preparing;
  CaptureScenes scenes = captureScenes(scene);
  const Stage told = setStage(scenes.told);
  const Stage stage = setTruthStage(scenes.truth);
  SceneTime time = scene.time.value_or(SceneTime{});
  time.substeps = truthSubsteps(stage, time);
  scenes.truth.time = time;
  const SequenceLayout layout = layoutOf(scenes.truth, stage);
  const Studio studio(scenes.truth, stage, layout);
  SceneRun run(scenes.truth, stage, std::max(1, options.threads - 1));
  SequenceWriter writer(sequence, layout);
  Darkroom darkroom(studio, writer, options.threads);
  SynthesisReport report{stage.numFrames, layout.turnaroundFrames, 0, told.notes, {}};
  report.times.preparing = preparing.seconds();
  const int total = stage.numPrerollFrames + stage.numFrames;
  std::vector<Moment> moments;
  for (int staged = 0; staged < total; ++staged) {
    const Stopwatch simulating;
    if (staged > 0 && !run.advance().stable)
      ++report.unstableFrames;
    if (staged + 1 == stage.numPrerollFrames)
      noteMovement(stage, run, report.notes);
    if (staged < stage.numPrerollFrames)
      run.calm(kPrerollMomentum);
    report.times.simulating += simulating.seconds();
    if (staged >= stage.numPrerollFrames) {
      moments.push_back(momentOf(stage, run, staged));
      std::vector<Eigen::Matrix3Xd> truth = {moments.back().skin};
      truth.insert(truth.end(), moments.back().cloths.begin(), moments.back().cloths.end());
      writer.appendTruth(stage.body->poses()[static_cast<std::size_t>(staged)], truth);
    }
    if (moments.size() == kBatch || staged + 1 == total)
      darkroom.develop(std::exchange(moments, {}));
    if (options.progress)
      options.progress(staged + 1, total);
  }
  darkroom.wait();
  darkroom.report(report.times);
  writer.finish(*told.avatar);
  return report;
}

}  // namespace simulcap
