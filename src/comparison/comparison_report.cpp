#include "src/comparison/comparison_report.h"

#include "src/output/text_table.h"

#include <nlohmann/json.hpp>

#include <algorithm>
#include <array>
#include <cstdio>
#include <initializer_list>

namespace simulcap {
namespace {

using Json = nlohmann::ordered_json;

Json inMillimetres(const VertexError& error) {
  return {{"rms", 1e3 * error.rms}, {"max", 1e3 * error.max}};
}

const char* nameOf(ClothEnergy energy) {
  return energy == ClothEnergy::kPaper ? "paper" : "bending_links";
}

Json settingsJson(const SolverSettings& settings) {
  Json json = {
      {"series", settings.series},
      {"integrator", settings.integrator},
      {"threads", settings.threads},
      {"energy", nameOf(settings.energy)},
      {"meaning", settings.meaning}};
  if (!settings.kernels.empty())
    json["kernels"] = settings.kernels;
  if (settings.iterations > 0)
    json["iterations"] = settings.iterations;
  return json;
}

Json runJson(const RunResult& run) {
  Json json = {
      {"solver", run.settings.solver},
      {"settings", settingsJson(run.settings)},
      {"vertices", run.vertices},
      {"substeps_per_frame", run.settings.stepsPerFrame},
      {"frames", run.frames},
      {"wall_ms_per_frame", run.wallMilliseconds},
      {"cpu_ms_per_frame", run.cpuMilliseconds},
      {"ns_per_vertex_substep", run.nanosecondsPerVertexStep()},
      {"strain", {{"mean", run.meanStrain}, {"max", run.maxStrain}}},
      {"sag_mm", 1e3 * run.sag},
      {"stable", run.stable}};
  if (run.error)
    json["error_mm"] = inMillimetres(*run.error);
  if (run.distanceToPaper)
    json["distance_to_paper_mm"] = inMillimetres(*run.distanceToPaper);
  return json;
}

double seconds(const ComparisonReport& report, int frames) {
  return frames / report.framesPerSecond;
}

const Truth& paperTruth(const ComparisonReport& report) {
  return report.truths.at(ClothEnergy::kPaper);
}

double errorSeconds(const ComparisonReport& report) {
  return seconds(report, paperTruth(report).frame);
}

Json truthsJson(const ComparisonReport& report) {
  Json json = Json::array();
  for (const auto& [energy, truth] : report.truths)
    json.push_back(
        {{"energy", nameOf(energy)},
         {"solver", truth.solver},
         {"substeps_per_frame", truth.stepsPerFrame},
         {"extrapolated", true},
         {"at_seconds", seconds(report, truth.frame)},
         {"residual_mm", inMillimetres(truth.residual)}});
  return json;
}

struct SeriesStyle {
  Eigen::Vector3d color;
  PlotMarker marker;
};

/// Colours that people with any colour vision tell apart (Okabe and Ito 2008) and darker ones of
/// other hues, and markers, so that a print in grey can be read as well. By the order in which the
/// series appear.
SeriesStyle styleOf(std::size_t index) {
  static const std::array<Eigen::Vector3d, 9> kColors = {
      Eigen::Vector3d(0.00, 0.45, 0.70),
      Eigen::Vector3d(0.34, 0.71, 0.91),
      Eigen::Vector3d(0.00, 0.62, 0.45),
      Eigen::Vector3d(0.55, 0.55, 0.55),
      Eigen::Vector3d(0.10, 0.10, 0.10),
      Eigen::Vector3d(0.90, 0.62, 0.00),
      Eigen::Vector3d(0.84, 0.37, 0.00),
      Eigen::Vector3d(0.80, 0.47, 0.65),
      Eigen::Vector3d(0.45, 0.15, 0.45)};
  static const std::array<PlotMarker, 4> kMarkers = {
      PlotMarker::kCircle, PlotMarker::kSquare, PlotMarker::kTriangle, PlotMarker::kDiamond};
  return {kColors[index % kColors.size()], kMarkers[index % kMarkers.size()]};
}

bool isPictured(const RunResult& run) {
  return run.stable && run.error.has_value();
}

std::string listedUnstable(const ComparisonReport& report) {
  std::string text;
  std::string series;
  for (const RunResult& run : report.runs) {
    if (run.stable)
      continue;
    const bool isNew = run.settings.series != series;
    series = run.settings.series;
    text += isNew ? (text.empty() ? "Blew up: " : "; ") + series + " at " : std::string(", ");
    text += run.settings.label();
  }
  return text;
}

std::string csvQuoted(const std::string& text) {
  std::string result = "\"";
  for (const char c : text)
    result += c == '"' ? std::string("\"\"") : std::string(1, c);
  return result + "\"";
}

/// What the table's figures are measured against.
std::string truthText(const ComparisonReport& report) {
  const Truth& paper = paperTruth(report);
  std::string text = "Errors at " + fixedText(errorSeconds(report), 3) +
                     " s, strain and sag until " + fixedText(seconds(report, report.frames), 3) +
                     " s. The truth: " + paper.solver + ", " + std::to_string(paper.stepsPerFrame) +
                     " steps per frame and half as many,\nextrapolated; the two are " +
                     roundedText(1e3 * paper.residual.rms, 2) + " mm apart (rms).";
  const auto links = report.truths.find(ClothEnergy::kBendingLinks);
  if (links != report.truths.end())
    text +=
        "\n* Bends by links between second neighbours instead of hinges: measured against the "
        "truth of that\n  model, where the two runs are " +
        roundedText(1e3 * links->second.residual.rms, 2) + " mm apart.";
  return text;
}

}  // namespace

std::string comparisonJson(const ComparisonReport& report) {
  Json json = {
      {"program", report.program},
      {"scene", report.scene},
      {"machine", {{"cpu", report.cpu}, {"threads", report.threads}}},
      {"calibration_gflops", report.calibrationGflops},
      {"simulated_seconds", seconds(report, report.frames)},
      {"truths", truthsJson(report)}};
  json["left_out"] = Json::array();
  for (const LeftOutSolver& solver : report.leftOut)
    json["left_out"].push_back({{"solver", solver.name}, {"reason", solver.reason}});
  json["runs"] = Json::array();
  for (const RunResult& run : report.runs)
    json["runs"].push_back(runJson(run));
  return json.dump(1) + "\n";
}

std::string comparisonCsv(const ComparisonReport& report) {
  std::string text =
      "solver,series,integrator,kernels,threads,substeps_per_frame,iterations,vertices,"
      "wall_ms_per_frame,cpu_ms_per_frame,ns_per_vertex_substep,energy,error_rms_mm,error_max_mm,"
      "distance_to_paper_rms_mm,strain_mean,strain_max,sag_mm,stable\n";
  for (const RunResult& run : report.runs) {
    const SolverSettings& settings = run.settings;
    const std::vector<std::string> cells = {
        settings.solver,
        csvQuoted(settings.series),
        settings.integrator,
        settings.kernels,
        std::to_string(settings.threads),
        std::to_string(settings.stepsPerFrame),
        std::to_string(settings.iterations),
        std::to_string(run.vertices),
        roundedText(run.wallMilliseconds, 6),
        roundedText(run.cpuMilliseconds, 6),
        roundedText(run.nanosecondsPerVertexStep(), 6),
        nameOf(settings.energy),
        run.error ? roundedText(1e3 * run.error->rms, 6) : "",
        run.error ? roundedText(1e3 * run.error->max, 6) : "",
        run.distanceToPaper ? roundedText(1e3 * run.distanceToPaper->rms, 6) : "",
        roundedText(run.meanStrain, 6),
        roundedText(run.maxStrain, 6),
        roundedText(1e3 * run.sag, 6),
        run.stable ? "true" : "false"};
    for (std::size_t i = 0; i < cells.size(); ++i)
      text += cells[i] + (i + 1 < cells.size() ? "," : "\n");
  }
  return text;
}

std::string comparisonTable(const ComparisonReport& report) {
  std::vector<std::vector<std::string>> rows = {
      {"solver",
       "steps",
       "wall ms/frame",
       "cpu ms/frame",
       "ns/vertex/step",
       "rms mm",
       "max mm",
       "strain mean %",
       "max %",
       "sag mm"}};
  for (const RunResult& run : report.runs) {
    std::vector<std::string> row = {
        run.settings.series + (run.settings.energy == ClothEnergy::kPaper ? "" : " *"),
        run.settings.label(),
        fixedText(run.wallMilliseconds, 2),
        fixedText(run.cpuMilliseconds, 2),
        fixedText(run.nanosecondsPerVertexStep(), 1)};
    const std::string rms = run.error ? fixedText(1e3 * run.error->rms, 4) : "-";
    const std::string max = run.error ? fixedText(1e3 * run.error->max, 4) : "-";
    row.insert(row.end(), {rms, max});
    if (run.stable)
      row.insert(
          row.end(),
          {fixedText(100.0 * run.meanStrain, 2),
           fixedText(100.0 * run.maxStrain, 1),
           fixedText(1e3 * run.sag, 1)});
    else
      row.insert(row.end(), {"blew up", "", ""});
    rows.push_back(row);
  }
  return alignedColumns(rows) + truthText(report);
}

Plot comparisonPlot(const ComparisonReport& report) {
  Plot plot;
  const Eigen::Index vertices = report.runs.empty() ? 0 : report.runs.front().vertices;
  const std::size_t folder = report.scene.find_last_of('/');
  plot.title = "Error against run time: " +
               report.scene.substr(folder == std::string::npos ? 0 : folder + 1) + ", " +
               std::to_string(vertices) + " vertices, " + roundedText(report.framesPerSecond, 4) +
               " frames per second";
  plot.x = {"wall time per frame [ms], median", AxisScale::kLogarithmic};
  plot.y = {
      "RMS distance of vertices from the truth [mm], after " + fixedText(errorSeconds(report), 3) +
          " s",
      AxisScale::kLogarithmic};
  for (const RunResult& run : report.runs) {
    if (plot.series.empty() || plot.series.back().name != run.settings.series) {
      const SeriesStyle style = styleOf(plot.series.size());
      plot.series.push_back(
          {.name = run.settings.series,
           .color = style.color,
           .marker = style.marker,
           .hollow = run.settings.energy != ClothEnergy::kPaper,
           .points = {}});
    }
    if (isPictured(run))
      plot.series.back().points.push_back(
          {run.wallMilliseconds, 1e3 * run.error->rms, run.settings.label()});
  }
  std::erase_if(plot.series, [](const PlotSeries& series) { return series.points.empty(); });
  plot.notes = {
      "Beside the points: steps per frame, x iterations. Filled: the paper's springs and hinges. "
      "Hollow: links between second neighbours instead of hinges, measured against the converged "
      "solution of that model."};
  if (const std::string unstable = listedUnstable(report); !unstable.empty())
    plot.notes.push_back(unstable + ".");
  return plot;
}

}  // namespace simulcap
