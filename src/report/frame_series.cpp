#include "src/report/frame_series.h"

#include "avatar/io/file_error.h"

#include <cmath>
#include <cstdlib>
#include <map>
#include <sstream>
#include <vector>

namespace simulcap {
namespace {

std::vector<std::string> cellsOf(const std::string& line) {
  std::vector<std::string> cells;
  std::istringstream text(line);
  for (std::string cell; std::getline(text, cell, ',');)
    cells.push_back(cell);
  return cells;
}

/// Not a number for what is none.
double numberOf(const std::string& cell) {
  char* end = nullptr;
  const double value = std::strtod(cell.c_str(), &end);
  return end != cell.c_str() && *end == '\0' ? value : std::nan("");
}

}  // namespace

void FrameSeries::begin(int number) {
  numbers_.push_back(number);
}

nlohmann::json& FrameSeries::curve(const std::string& plot, const std::string& name) {
  nlohmann::json& values = plots_[plot][name];
  while (values.size() < numbers_.size())
    values.push_back(nullptr);
  return values;
}

void FrameSeries::add(const std::string& plot, const std::string& name, double value) {
  if (std::isfinite(value))
    curve(plot, name).back() = value;
}

void FrameSeries::add(const std::string& plot, const Distribution& values, double scale) {
  if (values.empty())
    return;
  add(plot, "median", scale * values.quantile(0.5));
  add(plot, "p95", scale * values.quantile(0.95));
}

void FrameSeries::addTiming(const std::string& path, std::string_view csv) {
  std::istringstream text{std::string(csv)};
  std::string line;
  std::getline(text, line);
  const std::vector<std::string> names = cellsOf(line);
  if (names.size() < 2 || names.front() != "frame")
    throw avatar::FileError(
        path, "line 1", "expected frame,STAGE,…; write it anew or take it away");
  std::map<int, std::vector<double>> rows;
  for (int number = 2; std::getline(text, line); ++number) {
    std::vector<double> values;
    values.reserve(names.size());
    for (const std::string& cell : cellsOf(line))
      values.push_back(numberOf(cell));
    const bool whole = values.size() == names.size() && values.front() >= 0.0;
    if (!whole)
      throw avatar::FileError(
          path, "line " + std::to_string(number), "expected a frame number and its times [ms]");
    rows[static_cast<int>(values.front())] = std::move(values);
  }
  for (std::size_t frame = 0; frame < numbers_.size(); ++frame) {
    const auto row = rows.find(numbers_[frame].get<int>());
    if (row == rows.end())
      continue;
    for (std::size_t i = 1; i < names.size(); ++i)
      if (std::isfinite(row->second[i]))
        curve("timing_ms", names[i])[frame] = row->second[i];
  }
}

nlohmann::json FrameSeries::json() const {
  nlohmann::json plots = plots_;
  for (auto& plot : plots)
    for (auto& values : plot)
      while (values.size() < numbers_.size())
        values.push_back(nullptr);
  return {{"numbers", numbers_}, {"plots", std::move(plots)}};
}

}  // namespace simulcap
