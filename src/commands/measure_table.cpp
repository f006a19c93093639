#include "src/commands/measure_table.h"

#include <nlohmann/json.hpp>

#include <algorithm>
#include <cstdio>

namespace simulcap {
namespace {

/// Millimetres, tenths of a litre, of a kilogram and of a unit of body mass index.
int decimals(std::string_view unit) {
  if (unit == "m")
    return 3;
  return unit == "m^3" ? 4 : 1;
}

std::string padded(const std::string& text, std::size_t width) {
  return std::string(width - std::min(width, text.size()), ' ') + text;
}

std::string number(const avatar::MeasureRow& row) {
  char text[32];
  std::snprintf(text, sizeof text, "%.*f", decimals(row.unit), row.value);
  return text;
}

/// "chest girth" in "m" → "chest_girth_m"; "bmi" in "kg/m^2" → "bmi".
std::string jsonKey(const avatar::MeasureRow& row) {
  std::string key(row.name);
  std::replace(key.begin(), key.end(), ' ', '_');
  if (row.unit == "m^3")
    return key + "_m3";
  return row.unit.find('/') == std::string_view::npos ? key + "_" + std::string(row.unit) : key;
}

}  // namespace

MeasuredBody measured(
    const std::string& label, const avatar::BodyModel& model, const avatar::ShapedBody& body) {
  return {label, avatar::measureBody({body.vertices, model.faces}, body.joints)};
}

std::string measureTable(const std::vector<MeasuredBody>& bodies) {
  constexpr std::size_t kNameWidth = 28;
  constexpr std::size_t kMinimumWidth = 8;
  std::string table(kNameWidth, ' ');
  for (const MeasuredBody& body : bodies)
    table += "  " + padded(body.label, kMinimumWidth);
  if (bodies.empty())
    return table + "\n";
  const std::size_t numRows = avatar::measureRows(bodies.front().measures).size();
  for (std::size_t i = 0; i < numRows; ++i) {
    const avatar::MeasureRow first = avatar::measureRows(bodies.front().measures)[i];
    std::string line = std::string(first.name) + " [" + std::string(first.unit) + "]";
    line.resize(std::max(kNameWidth, line.size()), ' ');
    for (const MeasuredBody& body : bodies)
      line += "  " + padded(
                         number(avatar::measureRows(body.measures)[i]),
                         std::max(kMinimumWidth, body.label.size()));
    table += "\n" + line;
  }
  return table + "\n";
}

std::string measureJson(const std::vector<MeasuredBody>& bodies) {
  nlohmann::ordered_json all;
  for (const MeasuredBody& body : bodies) {
    nlohmann::ordered_json measures;
    for (const avatar::MeasureRow& row : avatar::measureRows(body.measures))
      measures[jsonKey(row)] = row.value;
    all[body.label] = measures;
  }
  return all.dump(1, ' ', false, nlohmann::ordered_json::error_handler_t::replace);
}

}  // namespace simulcap
