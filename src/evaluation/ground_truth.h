#pragma once

#include "avatar/body_model.h"
#include "avatar/geometry/camera.h"
#include "avatar/geometry/mesh.h"
#include "avatar/io/npz_row_reader.h"
#include "avatar/motion.h"
#include "avatar/skinning.h"

#include <Eigen/Core>

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

namespace simulcap {

/// The truth of one frame, in the camera's frame [m].
struct TrueFrame {
  Eigen::Matrix3Xd body;                   ///< 3 × V; no columns: not known
  Eigen::Matrix3Xd joints;                 ///< 3 × 24; no columns: not known
  std::vector<Eigen::Matrix3Xd> garments;  ///< 3 × V each, in the order of garments()
};

/// Reads the truth of a sequence, SEQ/gt, frame by frame; memory doesn't grow with the frames but
/// for the poses (600 bytes each).
class GroundTruth {
 public:
  struct Garment {
    std::string name;
    Eigen::Matrix3Xi faces;  ///< 3 × F
  };

  /// `bodyModel`: "default" or a file, the model that gt/body.npz is of; empty when it isn't known:
  /// then there are no joints, and a body only where gt/body_vertices.npz holds it with its faces.
  /// Throws avatar::FileError for files that are missing, damaged or don't fit together.
  GroundTruth(const std::string& folder, const std::string& bodyModel);

  /// Of the sequence, as the truth's files are; cameraFromWorld is applied to all positions.
  const avatar::Camera& camera() const { return camera_; }

  std::int64_t numFrames() const { return numFrames_; }

  const std::vector<Garment>& garments() const { return garments_; }

  /// 3 × F; no columns when there is no body.
  const Eigen::Matrix3Xi& bodyFaces() const { return bodyFaces_; }

  /// Null when the model isn't known.
  const avatar::BodyModel* bodyModel() const { return model_.get(); }

  /// Is the body read from gt/body_vertices.npz, apart from any model?
  bool hasBodyVertices() const { return bodyRows_.has_value(); }

  /// The body as the model has it in the frame last read, in the camera's frame; no columns
  /// without a model.
  Eigen::Matrix3Xd modelledBody() const;

  /// Frame `number` ≥ those asked for before. Throws avatar::FileError for values that are not
  /// finite, std::out_of_range beyond the last frame.
  TrueFrame frame(int number);

  /// W·H PixelLabel of gt/labels; empty without that file. Throws avatar::FileError for a picture
  /// of another size.
  std::vector<std::uint8_t> labels(int number) const;

 private:
  void readBody(const std::string& bodyModel);
  void readBodyVertices();
  void addGarment(const std::string& name);
  Eigen::Matrix3Xd row(avatar::NpzRowReader& rows, const std::string& file, int number);

  std::string folder_;
  avatar::Camera camera_;
  std::int64_t numFrames_ = -1;
  std::vector<Garment> garments_;
  std::vector<avatar::NpzRowReader> garmentRows_;
  std::optional<avatar::NpzRowReader> bodyRows_;
  Eigen::Matrix3Xi bodyFaces_;
  std::optional<avatar::Motion> motion_;
  std::unique_ptr<avatar::BodyModel> model_;
  std::unique_ptr<avatar::Skinning> skinning_;  // refers to *model_
  avatar::ShapedBody shaped_;
  avatar::SkinnedBody posed_;  // of the frame last read
};

/// Is the truth's body of this model? Where the truth has vertices of its own, the model's must lie
/// on them, to the soft tissue that a truth may add; else the garments must lie outside the body.
/// Always, where there is neither. Throws avatar::FileError.
bool isTrueBodyModel(const std::string& folder, const std::string& bodyModel);

struct TrueBodyModel {
  std::string name;     ///< "default" or a file; empty: not known
  std::string problem;  ///< why it isn't known, in one line; else empty
};

/// The body model of a truth: as given, else as the truth says, else that of the avatar where the
/// truth's body is of it.
TrueBodyModel trueBodyModel(
    const std::string& folder, const std::string& given, const std::string& ofAvatar);

/// The text `model` of gt/body.npz: the body model that the truth was made with, if it says so.
std::string trueBodyModelName(const std::string& folder);

}  // namespace simulcap
