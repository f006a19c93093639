#include "src/comparison/capture_comparison_report.h"

#include "src/output/text_table.h"

#include <array>
#include <optional>

namespace simulcap {
namespace {

using Json = nlohmann::ordered_json;

/// A figure of metrics.json as a column of the table.
struct Column {
  const char* csvName = "";  ///< with its unit
  const char* title = "";
  const char* pointer = "";  ///< where it is (RFC 6901)
  double scale = 1.0;
  int decimals = 2;
};

constexpr std::array<Column, 12> kColumns = {{
    {"simulation_ms", "sim ms", "/timing_ms/cloth_simulation/median", 1.0, 1},
    {"fit_ms", "fit ms", "/timing_ms/depth_fitting/median", 1.0, 1},
    {"depth_error_before_fit_median_mm", "depth before", "/depth_error_before_fit_mm/median"},
    {"depth_error_median_mm", "depth", "/depth_error_mm/median"},
    {"garment_visible_median_mm", "seen med", "/ground_truth/garment_visible_mm/median"},
    {"garment_visible_mean_mm", "seen mean", "/ground_truth/garment_visible_mm/mean"},
    {"garment_hidden_mean_mm", "hidden mean", "/ground_truth/garment_hidden_mm/mean"},
    {"edge_strain_p95_percent", "strain p95 %", "/edge_strain/p95", 100.0, 1},
    {"edge_strain_max_percent", "max %", "/edge_strain/max", 100.0, 0},
    {"under_skin_percent", "under skin %", "/penetration/fraction", 100.0, 3},
    {"jitter_visible_mm_per_frame", "jitter seen", "/jitter_mm_per_frame/visible"},
    {"jitter_hidden_mm_per_frame", "hidden", "/jitter_mm_per_frame/hidden"},
}};

std::optional<double> figureAt(const TrialResult& trial, const char* pointer) {
  const nlohmann::json::json_pointer path(pointer);
  if (!trial.metrics.contains(path))
    return std::nullopt;
  return trial.metrics.at(path).get<double>();
}

Json settingsJson(const CaptureOptions& options) {
  return {
      {"method", captureMethodNames()[static_cast<std::size_t>(options.method)]},
      {"longest_substep_s", options.longestSubstep},
      {"fit_rounds", options.fitRounds},
      {"fit_iterations", options.fitIterations},
      {"fit_substep_s", options.fitSubstep},
      {"force", options.force.mode == bullet_ext::DepthForceMode::kLiteral ? "literal" : "tapered"},
      {"steadiness_gain", options.steadiness.gain},
      {"blend_radius_m", options.view.blendRadius},
      {"depth_gate_m", options.targets.gate}};
}

/// Simulation and fit of a frame [ms].
double clothMilliseconds(const TrialResult& trial) {
  return figureAt(trial, "/timing_ms/cloth_simulation/median").value_or(0.0) +
         figureAt(trial, "/timing_ms/depth_fitting/median").value_or(0.0);
}

/// What the plot shows: against the truth where there is one.
const char* errorPointer(const CaptureComparisonReport& report) {
  const char* const kTrue = "/ground_truth/garment_visible_mm/median";
  for (const TrialResult& trial : report.trials) {
    if (!figureAt(trial, kTrue))
      return "/depth_error_mm/median";
  }
  return kTrue;
}

}  // namespace

std::string captureComparisonJson(const CaptureComparisonReport& report) {
  Json json = {
      {"program", report.program},
      {"sequence", report.sequence},
      {"avatar", report.avatar},
      {"frames", report.frames},
      {"machine", {{"cpu", report.cpu}, {"threads", report.threads}}},
      {"calibration_gflops", report.calibrationGflops}};
  json["runs"] = Json::array();
  for (const TrialResult& trial : report.trials) {
    Json run = {
        {"solver", trial.name},
        {"series", trial.series},
        {"settings", settingsJson(trial.options)},
        {"wall_ms_per_frame", clothMilliseconds(trial)}};
    for (const char* key :
         {"timing_ms",
          "depth_error_before_fit_mm",
          "depth_error_mm",
          "depth_targets",
          "edge_strain",
          "penetration",
          "jitter_mm_per_frame",
          "ground_truth"}) {
      if (trial.metrics.contains(key))
        run[key] = trial.metrics.at(key);
    }
    json["runs"].push_back(std::move(run));
  }
  if (!report.tracking.empty())
    json["tracking"] = trackingJson(report.tracking);
  return json.dump(1) + "\n";
}

std::string captureComparisonCsv(const CaptureComparisonReport& report) {
  std::string text = "run,series";
  for (const Column& column : kColumns)
    text += std::string(",") + column.csvName;
  text += "\n";
  for (const TrialResult& trial : report.trials) {
    text += trial.name + "," + trial.series;
    for (const Column& column : kColumns) {
      const std::optional<double> value = figureAt(trial, column.pointer);
      text += "," + (value ? roundedText(column.scale * *value, 6) : std::string());
    }
    text += "\n";
  }
  return text;
}

std::string captureComparisonTable(const CaptureComparisonReport& report) {
  std::vector<std::vector<std::string>> rows = {{"[mm]"}};
  for (const Column& column : kColumns)
    rows.front().emplace_back(column.title);
  for (const TrialResult& trial : report.trials) {
    std::vector<std::string> row = {trial.name};
    row.reserve(kColumns.size() + 1);
    for (const Column& column : kColumns) {
      const std::optional<double> value = figureAt(trial, column.pointer);
      row.push_back(value ? fixedText(column.scale * *value, column.decimals) : "-");
    }
    rows.push_back(std::move(row));
  }
  return alignedColumns(rows);
}

Plot captureComparisonPlot(const CaptureComparisonReport& report) {
  static const std::array<Eigen::Vector3d, 3> kColors = {
      Eigen::Vector3d(0.00, 0.45, 0.70),
      Eigen::Vector3d(0.84, 0.37, 0.00),
      Eigen::Vector3d(0.00, 0.62, 0.45)};
  const char* const pointer = errorPointer(report);
  Plot plot;
  plot.title = "Captures of " + report.sequence + ", " + std::to_string(report.frames) + " frames";
  plot.x = {"wall time of simulation and fit per frame [ms], median", AxisScale::kLogarithmic};
  plot.y = {
      std::string(pointer).starts_with("/ground_truth")
          ? "distance of visible clothes from the truth [mm], median"
          : "distance of visible clothes from the depth [mm], median",
      AxisScale::kLogarithmic};
  for (const TrialResult& trial : report.trials) {
    const std::size_t known = plot.series.size();
    if (known == 0 || plot.series.back().name != trial.series)
      plot.series.push_back(
          {.name = trial.series,
           .color = kColors[known % kColors.size()],
           .marker = known == 0 ? PlotMarker::kCircle : PlotMarker::kSquare,
           .connected = known != 0,
           .points = {}});
    if (const std::optional<double> error = figureAt(trial, pointer))
      plot.series.back().points.push_back({clothMilliseconds(trial), *error, trial.name});
  }
  return plot;
}

}  // namespace simulcap
