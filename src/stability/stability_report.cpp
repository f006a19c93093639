#include "src/stability/stability_report.h"

#include "src/output/text_table.h"

#include <nlohmann/json.hpp>

#include <algorithm>
#include <utility>

namespace simulcap {
namespace {

using Json = nlohmann::ordered_json;

constexpr double kPaperSubstep = 1.0 / 3000.0;  // [s]

std::string describe(const GridCloth& cloth) {
  return "k " + roundedText(cloth.stretch, 3) + ", w " + roundedText(cloth.torsion, 3) + ", " +
         roundedText(1e3 * cloth.vertexMass, 3) + " g, " + roundedText(1e3 * cloth.edgeLength, 3) +
         " mm";
}

Json limitJson(const ObservedLimit& limit, double predicted) {
  Json trials = Json::array();
  for (const SubstepTrial& trial : limit.trials)
    trials.push_back(
        {{"substep_ms", 1e3 * trial.substep},
         {"held", trial.held},
         {"least_altitude", trial.leastAltitude}});
  return {
      {"limit_ms", 1e3 * limit.substep},
      {"ratio", limit.substep / predicted},
      {"trials", std::move(trials)}};
}

Json findingJson(const GridFinding& finding) {
  Json json = {
      {"stretch_k", finding.cloth.stretch},
      {"torsion_w", finding.cloth.torsion},
      {"vertex_mass_kg", finding.cloth.vertexMass},
      {"edge_length_m", finding.cloth.edgeLength},
      {"predicted_ms", 1e3 * finding.predicted},
      {"accepted_ms", 1e3 * finding.accepted()},
      {"shaken", limitJson(finding.shaken, finding.predicted)},
      {"hanging", limitJson(finding.hanging, finding.predicted)},
      {"collapsed", finding.collapsed()},
      {"error", finding.error()},
      {"accepted_held", finding.acceptedHeld()}};
  if (finding.drop)
    json["drop"] = {
        {"substeps_per_frame", finding.drop->substeps},
        {"frames_redone", finding.drop->redone},
        {"frames_given_up", finding.drop->givenUp}};
  return json;
}

Json extremeJson(const ExtremeResult& result) {
  const ExtremeOutcome& outcome = result.outcome;
  Json json = {
      {"name", result.name},
      {"what", result.what},
      {"verdict", nameOf(outcome.verdict)},
      {"expected", nameOf(result.expected)},
      {"passed", result.passed()},
      {"reason", outcome.reason},
      {"vertices", outcome.vertices},
      {"frames", outcome.frames},
      {"substeps_per_frame", outcome.asked},
      {"most_substeps", outcome.substeps},
      {"frames_redone", outcome.redone},
      {"frames_given_up", outcome.givenUp},
      {"strain", {{"max", outcome.largestStrain}, {"end", outcome.finalStrain}}},
      {"seconds", result.seconds}};
  if (outcome.underSkin)
    json["vertices_under_skin"] = *outcome.underSkin;
  return json;
}

double worstError(const StabilityReport& report) {
  double worst = 0.0;
  for (const GridFinding& finding : report.findings)
    worst = std::max(worst, finding.error());
  return worst;
}

std::string gridText(const StabilityReport& report) {
  int held = 0;
  int collapsed = 0;
  int dropped = 0;
  int redone = 0;
  for (const GridFinding& finding : report.findings) {
    held += finding.acceptedHeld() ? 1 : 0;
    collapsed += finding.collapsed() ? 1 : 0;
    dropped += finding.drop ? 1 : 0;
    redone += finding.drop ? finding.drop->redone : 0;
  }
  const std::string cloths = std::to_string(report.findings.size());
  return "Grid: " + std::to_string(held) + " of " + cloths +
         " cloths hold whatever pre-flight accepts (0.9 of the predicted limit); the observed "
         "limit is within\n" +
         fixedText(100.0 * worstError(report), 1) + " % of the prediction (" +
         std::to_string(collapsed) + " hanging ones left out, whose triangles collapse). " +
         std::to_string(dropped) + " large sheets dropped: " + std::to_string(redone) +
         " frames redone.\n";
}

/// The cell of the cloth with the given place in the grid's lists.
HeatCell cellOf(const GridFinding& finding) {
  HeatCell cell;
  cell.value = 1e3 * finding.shaken.substep;
  cell.lines = {
      roundedText(cell.value, 3),
      fixedText(finding.shaken.substep / finding.predicted, 2) + " " +
          fixedText(finding.hanging.substep / finding.predicted, 2) +
          (finding.collapsed() ? "c" : "")};
  cell.marked = !finding.acceptedHeld();
  return cell;
}

}  // namespace

std::vector<std::string> failures(const StabilityReport& report) {
  std::vector<std::string> lines;
  for (const GridFinding& finding : report.findings) {
    if (!finding.acceptedHeld())
      lines.push_back(describe(finding.cloth) + ": what pre-flight accepts blew up");
    if (!(finding.error() <= kLargestGridError))
      lines.push_back(
          describe(finding.cloth) + ": the observed limit is " +
          fixedText(100.0 * finding.error(), 1) + " % from the predicted one");
  }
  for (const ExtremeResult& result : report.extremes)
    if (!result.passed())
      lines.push_back(
          result.name + ": " + nameOf(result.outcome.verdict) + " instead of " +
          nameOf(result.expected) + ": " + result.outcome.reason);
  return lines;
}

std::string stabilityJson(const StabilityReport& report) {
  Json json = {
      {"program", report.program},
      {"machine", {{"cpu", report.cpu}, {"threads", report.threads}}},
      {"calibration_gflops", report.calibrationGflops},
      {"grid_seconds", report.gridSeconds},
      {"largest_grid_error", worstError(report)},
      {"failures", failures(report)}};
  json["grid"] = Json::array();
  for (const GridFinding& finding : report.findings)
    json["grid"].push_back(findingJson(finding));
  json["extreme_cases"] = Json::array();
  for (const ExtremeResult& result : report.extremes)
    json["extreme_cases"].push_back(extremeJson(result));
  return json.dump(1) + "\n";
}

std::string stabilityTable(const StabilityReport& report) {
  std::vector<std::vector<std::string>> rows = {
      {"extreme case",
       "verdict",
       "vertices",
       "frames",
       "substeps",
       "most",
       "redone",
       "given up",
       "strain max %",
       "end %",
       "s"}};
  std::string reasons;
  for (const ExtremeResult& result : report.extremes) {
    const ExtremeOutcome& outcome = result.outcome;
    rows.push_back(
        {result.what,
         std::string(nameOf(outcome.verdict)) + (result.passed() ? "" : " (!)"),
         std::to_string(outcome.vertices),
         std::to_string(outcome.frames),
         std::to_string(outcome.asked),
         std::to_string(outcome.substeps),
         std::to_string(outcome.redone),
         std::to_string(outcome.givenUp),
         fixedText(100.0 * outcome.largestStrain, 1),
         fixedText(100.0 * outcome.finalStrain, 1),
         fixedText(result.seconds, 1)});
    if (!outcome.reason.empty())
      reasons += result.what + ": " + outcome.reason + "\n";
  }
  return alignedColumns(rows) + "\n" + reasons + "\n" + gridText(report);
}

HeatMap stabilityMap(const StabilityReport& report) {
  const StabilityGrid& grid = report.grid;
  HeatMap map;
  map.title = "Largest stable substep [ms], semi-implicit Euler";
  map.valueTitle = "observed limit [ms]";
  map.rowTitle = "w";
  map.columnTitle = "k [N/m];  w in N m/rad";
  for (const double w : grid.torsion)
    map.rowLabels.push_back(roundedText(w, 3));
  for (const double k : grid.stretch)
    map.columnLabels.push_back(roundedText(k, 3));
  const std::size_t cells = grid.torsion.size() * grid.stretch.size();
  for (std::size_t first = 0; first + cells <= report.findings.size(); first += cells) {
    const GridCloth& cloth = report.findings[first].cloth;
    HeatPanel panel{
        .title = roundedText(1e3 * cloth.vertexMass, 3) + " g per vertex, edges of " +
                 roundedText(1e3 * cloth.edgeLength, 3) + " mm",
        .cells = {}};
    for (std::size_t i = first; i < first + cells; ++i)
      panel.cells.push_back(cellOf(report.findings[i]));
    map.panels.push_back(std::move(panel));
  }
  map.panelsPerRow = std::min(2, std::max(1, static_cast<int>(map.panels.size())));
  map.contour = 1e3 * kPaperSubstep;
  map.notes = {
      "In a cell: the limit observed [ms]; below it this limit and that of a swinging sheet, as "
      "parts of the prediction.",
      "c: triangles of the swinging sheet collapse. Framed: what pre-flight accepts blew up.",
      "Red line: beyond it the paper's substep of 0.33 ms is unstable."};
  return map;
}

}  // namespace simulcap
