#pragma once

#include "avatar/io/npz_row_reader.h"
#include "src/output/performance_file.h"

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

namespace simulcap {

/// Reads what PerformanceWriter wrote, frame by frame; memory doesn't grow with the frames.
class PerformanceReader {
 public:
  /// Throws avatar::FileError naming file and key: missing, of a wrong shape, arrays that don't fit
  /// together. Without frame_index a frame's number is its row, without provenance it is 0.
  explicit PerformanceReader(std::string path);

  const PerformanceLayout& layout() const { return layout_; }

  std::int64_t numFrames() const { return poses_.numRows(); }

  /// The next frame; nothing after the last one. Throws avatar::FileError for values that are not
  /// finite and frame numbers that don't increase.
  std::optional<PerformanceFrame> next();

 private:
  struct GarmentRows {
    avatar::NpzRowReader vertices;
    std::optional<avatar::NpzRowReader> provenance;
  };

  void readConstants();
  void addGarment(const std::string& name, const std::vector<std::string>& keys);
  PerformanceFrame::Garment readGarment(std::size_t garment);
  void requireRows(
      const avatar::NpzRowReader& rows,
      const std::string& key,
      const std::vector<std::int64_t>& rowShape) const;
  [[noreturn]] void fail(const std::string& key, const std::string& problem) const;

  std::string path_;
  PerformanceLayout layout_;
  avatar::NpzRowReader poses_, translations_;
  std::optional<avatar::NpzRowReader> indices_;
  std::vector<GarmentRows> garments_;
  int lastIndex_ = -1;
};

}  // namespace simulcap
