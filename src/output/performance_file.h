#pragma once

#include "avatar/body_pose.h"
#include "avatar/io/npy_file_writer.h"

#include <Eigen/Core>

#include <array>
#include <cstdint>
#include <string>
#include <vector>

namespace simulcap {

/// What is the same in every frame of a performance.
struct PerformanceLayout {
  struct Garment {
    std::string name;  ///< letters, digits, _ and -; unique
    int numVertices = 0;
    Eigen::Matrix3Xi faces;  ///< 3 × F, F > 0, vertex indices
  };

  double framesPerSecond = 30.0;
  Eigen::VectorXd betas;  ///< shape of the body; may be empty
  std::vector<Garment> garments;
  bool jointDeviations = false;  ///< frames have them: their body was tracked
};

struct PerformanceFrame {
  struct Garment {
    Eigen::Matrix3Xf vertices;             ///< 3 × numVertices [m], in the world
    std::vector<std::uint8_t> provenance;  ///< numVertices: 0 simulated … 255 fitted to depth
  };

  avatar::BodyPose pose;          ///< 24 joints
  std::vector<Garment> garments;  ///< in the layout's order
  /// Number within the recording that was captured, which may lack frames; −1: its own row.
  int recordingIndex = -1;
  /// How far each joint may be from its place [m], infinite where nobody knows; written where the
  /// layout has them.
  std::array<float, avatar::kNumSmplJoints> jointDeviations = {};
};

enum class PerformanceStart {
  kNew,      ///< drops what an interrupted run has left
  kContinue  ///< goes on after its last whole frame; starts anew when there is nothing
};

/// Writes performance.npz frame by frame: AMASS's keys (poses, trans, betas, mocap_framerate,
/// up_axis) with frame_index (T) int32, the
/// frames' numbers within the recording, joint_deviation (T, 24) float32 where there are any, and,
/// per garment, garment_<name> (T, V, 3) float32, provenance_<name> (T, V) uint8 and faces_<name>
/// (F, 3) int32. Memory doesn't grow with the frames.
///
/// Until finish() the arrays lie in the folder PATH.parts; the file appears at its end, whole, and
/// the folder goes. A run that ends before leaves the folder, with every frame that was appended,
/// for one with kContinue, which comes to the same bytes as one that was never interrupted.
class PerformanceWriter {
 public:
  /// Throws std::invalid_argument for a layout that can't be, avatar::FileError when the folder
  /// can't be written or, with kContinue, holds a performance of another layout.
  PerformanceWriter(
      std::string path, PerformanceLayout layout, PerformanceStart start = PerformanceStart::kNew);

  /// Goes on after the first `numFrames` frames of an interrupted run, as kContinue does. Throws
  /// avatar::FileError when there aren't as many.
  PerformanceWriter(std::string path, PerformanceLayout layout, std::int64_t numFrames);

  /// Throws std::invalid_argument for a frame that doesn't fit the layout or isn't finite,
  /// avatar::FileError when the disk is full.
  void append(const PerformanceFrame& frame);

  /// Frames so far, those of the run that is continued included.
  std::int64_t numFrames() const { return numFrames_; }

  /// Throws std::invalid_argument when there is no frame, avatar::FileError.
  void finish();

 private:
  struct Part {
    std::string key;  ///< in the .npz
    avatar::NpyRows rows;
  };

  std::vector<Part> parts() const;
  avatar::NpzArrays constants() const;
  std::string partPath(const std::string& key) const;
  void begin();
  /// False when there is nothing to go on from.
  bool resume(std::int64_t mostFrames);
  void requireSameLayout() const;
  void requireFits(const PerformanceFrame& frame) const;

  std::string path_;
  std::string folder_;
  PerformanceLayout layout_;
  std::vector<avatar::NpyFileWriter> files_;  ///< as parts()
  std::int64_t numFrames_ = 0;
};

}  // namespace simulcap
