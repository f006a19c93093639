#pragma once

#include "src/evaluation/cloth_metrics.h"

#include <nlohmann/json.hpp>

#include <optional>
#include <string>
#include <string_view>

namespace simulcap {

/// Figures over the frames that a report shows.
class FrameSeries {
 public:
  /// A frame begins; what is not added to it stays empty. `number`: within the recording.
  void begin(int number);

  /// One curve of a plot; a plot holds curves of one unit.
  void add(const std::string& plot, const std::string& curve, double value);

  /// Median and 95th percentile; nothing without values.
  void add(const std::string& plot, const Distribution& values, double scale = 1.0);

  /// Curves of the plot "timing_ms" from timing.csv: a line of names, "frame" first, then a line of
  /// milliseconds per frame. Throws avatar::FileError.
  void addTiming(const std::string& path, std::string_view csv);

  /// {"numbers":[…],"plots":{PLOT:{CURVE:[value or null per frame]}}}.
  nlohmann::json json() const;

 private:
  nlohmann::json& curve(const std::string& plot, const std::string& name);

  nlohmann::json numbers_ = nlohmann::json::array();
  nlohmann::json plots_ = nlohmann::json::object();
};

}  // namespace simulcap
