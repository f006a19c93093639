#pragma once

#include <nlohmann/json_fwd.hpp>

#include <stdexcept>
#include <string>
#include <utility>

namespace simulcap {

/// What is wrong with a scene, and where: a JSON path like "garments[1].cloth.stretch_k", or
/// "line 3, column 7". The reader adds the file.
struct SceneProblem : std::runtime_error {
  SceneProblem(std::string path, const std::string& problem)
      : std::runtime_error(problem), where(std::move(path)) {}

  std::string where;
};

/// Parses JSON with // and /* */ comments. Throws SceneProblem for syntax errors, with line and
/// column, and for keys that appear twice in an object, with their path.
nlohmann::json parseSceneJson(const std::string& text);

/// "garments[1]" + "cloth" → "garments[1].cloth".
std::string joinPath(const std::string& path, const std::string& key);

/// "garments", 1 → "garments[1]".
std::string indexPath(const std::string& path, std::size_t index);

}  // namespace simulcap
