#pragma once

#include <nlohmann/json_fwd.hpp>

#include <string>

namespace simulcap {

/// Puts figures into a metrics.json, which others may have begun: objects are merged key by key,
/// everything else is replaced. Written whole or not at all. Throws avatar::FileError when the file
/// there is no JSON object, or can't be written.
void mergeMetrics(const std::string& path, const nlohmann::json& figures);

/// Figures of an evaluation as a table with units, one line each.
std::string evaluationTable(const nlohmann::json& figures);

}  // namespace simulcap
