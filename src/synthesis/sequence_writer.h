#pragma once

#include "avatar/body_pose.h"
#include "avatar/geometry/camera.h"
#include "avatar/geometry/shading.h"
#include "avatar/io/npy_file_writer.h"
#include "avatar/layered_avatar.h"

#include <Eigen/Core>

#include <cstdint>
#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <vector>

namespace simulcap {

/// A garment or the body in a sequence's truth.
struct TruthMesh {
  std::string name;  ///< of the file: "garment_upper", "body_vertices"
  Eigen::Index numVertices = 0;
  Eigen::Matrix3Xi faces;  ///< 3 × F
};

/// What is the same in every frame of a sequence.
struct SequenceLayout {
  avatar::Camera camera;
  avatar::Camera backCamera;
  double depthScale = 1000.0;  ///< raw units per metre
  double framesPerSecond = 30.0;
  std::optional<int> turnaroundFrames;
  std::string bodyModel = "default";  ///< that poses and betas are of: "default" or a file
  Eigen::VectorXd betas;
  std::vector<TruthMesh> meshes;
};

/// Pictures of one frame.
struct SequencePictures {
  std::vector<float> depth;  ///< W·H [m], 0 = no measurement
  avatar::ColorImage color;
  std::vector<std::uint8_t> labels;  ///< W·H
  std::vector<float> backDepth;      ///< W·H [m] of the back camera; empty: not in this frame
};

/// Throws avatar::FileError when there is something at the path that no sequence may replace.
void requireReplaceable(const std::filesystem::path& path);

/// Writes a sequence folder with its truth, in memory that doesn't grow with the frames. Until
/// finish() it lies in PATH.parts; then the folder appears, in the place of a former sequence.
class SequenceWriter {
 public:
  /// Throws avatar::FileError when the folder can't be written, or PATH holds something else than a
  /// sequence of this writer.
  SequenceWriter(std::filesystem::path path, SequenceLayout layout);

  /// May be called from several threads for different frames.
  void writePictures(int frame, const SequencePictures& pictures) const;

  /// Frames in their order: pose, and 3 × V [m] per mesh of the layout.
  void appendTruth(const avatar::BodyPose& pose, const std::vector<Eigen::Matrix3Xd>& vertices);

  void finish(const avatar::LayeredAvatar& avatar);

 private:
  void writeDescription() const;
  void writeTruth();
  std::filesystem::path rowsPath(const std::string& name) const;

  std::filesystem::path path_;
  std::filesystem::path parts_;
  SequenceLayout layout_;
  std::map<std::string, avatar::NpyFileWriter> rows_;
  int numFrames_ = 0;
};

}  // namespace simulcap
