#pragma once

#include "src/exporting/export_source.h"

#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace simulcap {

/// Writes one format and names the files it wrote, as paths. Throws avatar::FileError when they
/// can't be written.
using ExportFunction = std::vector<std::string> (*)(const ExportSource&, const ExportPlace&);

struct ExportFormat {
  std::string_view name;
  std::string_view extension;  ///< of its main file, with the dot; empty: always a folder
  bool needsPerformance = false;
  std::string_view help;
  ExportFunction write = nullptr;
};

/// Every format of `simulcap export --to`; another one is another entry.
std::span<const ExportFormat> exportFormats();

std::vector<std::string> exportGlb(const ExportSource& source, const ExportPlace& place);
std::vector<std::string> exportObj(const ExportSource& source, const ExportPlace& place);
std::vector<std::string> exportPc2(const ExportSource& source, const ExportPlace& place);
std::vector<std::string> exportUsd(const ExportSource& source, const ExportPlace& place);
std::vector<std::string> exportBullet(const ExportSource& source, const ExportPlace& place);
std::vector<std::string> exportGodot(const ExportSource& source, const ExportPlace& place);
std::vector<std::string> exportUnity(const ExportSource& source, const ExportPlace& place);
std::vector<std::string> exportUnreal(const ExportSource& source, const ExportPlace& place);

}  // namespace simulcap
