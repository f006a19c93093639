#include "src/evaluation/metrics_file.h"

#include "avatar/io/atomic_file.h"
#include "avatar/io/file_error.h"

#include <nlohmann/json.hpp>

#include <cstdio>
#include <filesystem>
#include <fstream>

namespace simulcap {
namespace {

/// `unit` with a space before it, or empty.
std::string line(const std::string& name, double value, int decimals, const char* unit) {
  char text[160];
  std::snprintf(text, sizeof text, "%-28s %9.*f%s\n", name.c_str(), decimals, value, unit);
  return text;
}

std::string distributionLine(const std::string& name, const nlohmann::json& values) {
  char text[160];
  std::snprintf(
      text,
      sizeof text,
      "%-28s %9.2f %9.2f %9.2f %9.2f\n",
      name.c_str(),
      values.at("mean").get<double>(),
      values.at("median").get<double>(),
      values.at("p95").get<double>(),
      values.at("max").get<double>());
  return text;
}

std::string ownLines(const nlohmann::json& figures) {
  std::string lines;
  if (const auto strain = figures.find("edge_strain"); strain != figures.end())
    for (const char* key : {"mean", "p95", "max"})
      lines +=
          line(std::string("edge_strain ") + key, 100.0 * strain->at(key).get<double>(), 2, " %");
  if (const auto inside = figures.find("penetration"); inside != figures.end()) {
    lines += line("penetration fraction", 100.0 * inside->at("fraction").get<double>(), 3, " %");
    lines += line("penetration max", inside->at("max_mm").get<double>(), 2, " mm");
  }
  if (const auto jitter = figures.find("jitter_mm_per_frame"); jitter != figures.end())
    for (const auto& [key, value] : jitter->items())
      lines += line("jitter " + key, value.get<double>(), 3, " mm/frame");
  return lines;
}

}  // namespace

void mergeMetrics(const std::string& path, const nlohmann::json& figures) {
  nlohmann::json metrics = nlohmann::json::object();
  if (std::filesystem::exists(path)) {
    std::ifstream file(path, std::ios::binary);
    metrics = nlohmann::json::parse(file, nullptr, false);
    if (!metrics.is_object())
      throw avatar::FileError(
          path, "", "is no JSON object; remove it, and its other figures with it");
  }
  metrics.merge_patch(figures);
  avatar::writeFileAtomically(path, metrics.dump(1) + "\n");
}

std::string evaluationTable(const nlohmann::json& figures) {
  std::string table;
  if (const auto truth = figures.find("ground_truth"); truth != figures.end()) {
    char header[160];
    std::snprintf(
        header,
        sizeof header,
        "%-28s %9s %9s %9s %9s\n",
        "against the truth [mm]",
        "mean",
        "median",
        "p95",
        "max");
    table += header;
    for (const auto& [name, values] : truth->items())
      if (values.contains("p95"))
        table += distributionLine(name, values);
    if (const auto iou = truth->find("segmentation_iou"); iou != truth->end())
      for (const auto& [name, value] : iou->items())
        table += line("segmentation_iou " + name, value.get<double>(), 3, "");
  }
  return table + ownLines(figures);
}

}  // namespace simulcap
