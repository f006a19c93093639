#pragma once

#include "avatar/io/atomic_file.h"

#include <Eigen/Core>

#include <cstdint>
#include <fstream>
#include <string>

namespace simulcap {

/// Where the frames of a point cache lie in time.
struct Pc2Timing {
  float startFrame = 0.0F;  ///< frame number of the first sample
  float sampleRate = 1.0F;  ///< frames from one sample to the next, > 0
};

/// Writes a PC2 point cache, one mesh's vertices frame by frame: 32 bytes of header, then 32-bit
/// floats. Blender and others expect Z up, so that (x, y, z) is written as (x, −z, y). Keeps one
/// frame in memory. The file appears at finish(), whole, or never.
class Pc2Writer {
 public:
  /// Throws avatar::FileError when the file can't be written, std::invalid_argument for no points
  /// or a sample rate that isn't positive.
  Pc2Writer(const std::string& path, int numPoints, const Pc2Timing& timing = {});

  /// Vertices 3 × numPoints [m], Y up. Throws std::invalid_argument for another number of them or
  /// ones that aren't finite, avatar::FileError when the disk is full.
  void append(const Eigen::Ref<const Eigen::Matrix3Xf>& vertices);

  int numFrames() const { return numFrames_; }

  /// Throws avatar::FileError.
  void finish();

 private:
  avatar::AtomicFileWriter file_;
  Eigen::Matrix3Xf zUp_;  ///< the frame being written
  int numFrames_ = 0;
};

/// Reads what Pc2Writer writes, and other Z-up PC2 files, frame by frame.
class Pc2Reader {
 public:
  /// Throws avatar::FileError for a file that is missing, no PC2 cache or truncated.
  explicit Pc2Reader(std::string path);

  int numPoints() const { return numPoints_; }

  int numFrames() const { return numFrames_; }

  const Pc2Timing& timing() const { return timing_; }

  /// Vertices of a frame, 3 × numPoints, Y up. Throws std::out_of_range for a frame that isn't
  /// there, avatar::FileError when it can't be read.
  Eigen::Matrix3Xf frame(int index);

 private:
  std::string path_;
  std::ifstream file_;
  Pc2Timing timing_;
  int numPoints_ = 0;
  int numFrames_ = 0;
};

}  // namespace simulcap
