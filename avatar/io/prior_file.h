#pragma once

#include "avatar/mixture_fit.h"
#include "avatar/pose_prior.h"

#include <string>
#include <vector>

namespace avatar {

/// Reads a mixture exported from SMPLify or written by us: `means` (K, 69), `covars` (K, 69, 69),
/// `weights` (K). Throws FileError naming file, key, expected and found; covariances that are not
/// symmetric positive definite are refused.
GaussianMixture readPrior(const std::string& path);

/// Writes the same keys (float32). Throws FileError when the file can't be written.
void writePrior(const std::string& path, const GaussianMixture& mixture);

/// The mixture that comes with the program, fitted by fitPriorFromFolder() to CMU motion capture
/// (data/cmu_pose_prior.txt says how).
GaussianMixture builtInPrior();

struct PriorFolderOptions {
  MixtureFitOptions fit;
  double framesPerSecond = 10.0;  ///< clips are thinned to this rate, 1 … 240
};

/// What a folder of clips gave.
struct PriorFolderFit {
  MixtureFit fit;
  std::vector<std::string> usedFiles;     ///< sorted
  std::vector<int> posesPerFile;          ///< poses taken, before mirroring
  std::vector<std::string> skippedFiles;  ///< "file: reason"
};

/// Fits a pose prior to every .bvh and .npz motion below a folder. Calibration frames (T-pose) and
/// poses far beyond the joint limits are left out. Throws FileError when the folder can't be read
/// or holds too few poses.
PriorFolderFit fitPriorFromFolder(
    const std::string& folder, const PriorFolderOptions& options = {});

}  // namespace avatar
