#pragma once

#include <Eigen/Core>

#include <string>
#include <variant>
#include <vector>

namespace simulcap {

/// A line along points, open or closed; a closed one may be filled.
struct DrawnLine {
  std::vector<Eigen::Vector2d> points;
  Eigen::Vector3d color = {0.0, 0.0, 0.0};  ///< display values in [0, 1]
  double width = 1.0;                       ///< of the stroke, ≥ 0; 0: none
  bool closed = false;
  bool filled = false;                    ///< in fillColor
  Eigen::Vector3d fillColor = {1, 1, 1};  ///< display values in [0, 1]
};

enum class TextAnchor { kStart, kMiddle, kEnd };

/// One line of ASCII text.
struct DrawnText {
  Eigen::Vector2d position = {0.0, 0.0};  ///< of the anchor on the baseline
  std::string text;
  double height = 10.0;  ///< of a capital letter
  TextAnchor anchor = TextAnchor::kStart;
  Eigen::Vector3d color = {0.15, 0.15, 0.15};  ///< display values in [0, 1]
};

/// A picture of lines and text on white. Units are the pixels of a screen, x right, y down; later
/// items lie over earlier ones.
struct Drawing {
  int width = 0;
  int height = 0;
  std::vector<std::variant<DrawnLine, DrawnText>> items;
};

/// "#rrggbb".
std::string htmlColor(const Eigen::Vector3d& color);

/// With & < > " ' as XML writes them.
std::string xmlEscaped(const std::string& text);

/// As a whole SVG file, every number to a hundredth. Throws std::invalid_argument for a coordinate
/// that isn't finite.
std::string svg(const Drawing& drawing);

}  // namespace simulcap
