#include "src/output/drawing.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <stdexcept>

namespace simulcap {
namespace {

// Height of a capital letter of the common sans-serif fonts, in units of their size.
constexpr double kCapitalHeight = 0.716;

std::string number(double value) {
  if (!std::isfinite(value))
    throw std::invalid_argument("svg: a coordinate is not finite");
  char text[32];
  std::snprintf(text, sizeof text, "%.2f", value);
  std::string result(text);
  result.erase(result.find_last_not_of('0') + 1);
  if (result.back() == '.')
    result.pop_back();
  return result;
}

std::string attribute(const std::string& name, const std::string& value) {
  return " " + name + "=\"" + value + "\"";
}

std::string element(const DrawnLine& line) {
  std::string points;
  for (const Eigen::Vector2d& point : line.points)
    points += (points.empty() ? "" : " ") + number(point.x()) + "," + number(point.y());
  std::string text = line.closed ? "<polygon" : "<polyline";
  text += attribute("points", points);
  text += attribute("fill", line.filled ? htmlColor(line.fillColor) : "none");
  if (line.width > 0.0)
    text += attribute("stroke", htmlColor(line.color)) +
            attribute("stroke-width", number(line.width)) + attribute("stroke-linejoin", "round");
  return text + "/>\n";
}

std::string element(const DrawnText& text) {
  static const char* const kAnchors[] = {"start", "middle", "end"};
  return "<text" + attribute("x", number(text.position.x())) +
         attribute("y", number(text.position.y())) +
         attribute("font-size", number(text.height / kCapitalHeight)) +
         attribute("text-anchor", kAnchors[static_cast<int>(text.anchor)]) +
         attribute("fill", htmlColor(text.color)) + ">" + xmlEscaped(text.text) + "</text>\n";
}

}  // namespace

std::string htmlColor(const Eigen::Vector3d& color) {
  const auto byte = [](double value) {
    return static_cast<int>(std::lround(255.0 * std::clamp(value, 0.0, 1.0)));
  };
  char text[32];
  std::snprintf(
      text, sizeof text, "#%02x%02x%02x", byte(color.x()), byte(color.y()), byte(color.z()));
  return text;
}

std::string xmlEscaped(const std::string& text) {
  std::string result;
  for (const char c : text) {
    switch (c) {
      case '&':
        result += "&amp;";
        break;
      case '<':
        result += "&lt;";
        break;
      case '>':
        result += "&gt;";
        break;
      case '"':
        result += "&quot;";
        break;
      case '\'':
        result += "&#39;";
        break;
      default:
        result += c;
    }
  }
  return result;
}

std::string svg(const Drawing& drawing) {
  const std::string width = std::to_string(drawing.width);
  const std::string height = std::to_string(drawing.height);
  std::string text = "<svg" + attribute("xmlns", "http://www.w3.org/2000/svg") +
                     attribute("width", width) + attribute("height", height) +
                     attribute("viewBox", "0 0 " + width + " " + height) +
                     attribute("font-family", "Helvetica, Arial, sans-serif") + ">\n<rect" +
                     attribute("width", width) + attribute("height", height) +
                     attribute("fill", "#ffffff") + "/>\n";
  for (const auto& item : drawing.items)
    text += std::visit([](const auto& drawn) { return element(drawn); }, item);
  return text + "</svg>\n";
}

}  // namespace simulcap
