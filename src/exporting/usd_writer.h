#pragma once

#include "avatar/io/atomic_file.h"

#include <Eigen/Core>

#include <array>
#include <charconv>
#include <set>
#include <string>
#include <string_view>
#include <type_traits>
#include <vector>

namespace simulcap {

/// A number with the fewest digits that bring it back.
template <typename Number>
std::string usdNumber(Number value) {
  std::array<char, 32> digits{};
  return {digits.data(), std::to_chars(digits.data(), digits.data() + digits.size(), value).ptr};
}

/// Numbers, or vectors of them in round brackets, one after the other.
template <typename Items>
std::string usdList(const Items& items, char opening = '[', char closing = ']') {
  std::string text(1, opening);
  for (const auto& item : items) {
    if (text.size() > 1)
      text += ", ";
    if constexpr (std::is_arithmetic_v<std::remove_cvref_t<decltype(item)>>)
      text += usdNumber(item);
    else
      text += usdList(item, '(', ')');
  }
  return text + closing;
}

/// (x, y, z) of every column.
template <typename Matrix>
std::string usdColumns(const Matrix& matrix) {
  return usdList(matrix.colwise());
}

/// USD multiplies rows from the left: its rows are our columns.
inline std::string usdTransform(const Eigen::Matrix4d& matrix) {
  return usdList(matrix.colwise(), '(', ')');
}

/// A name that USD takes and that wasn't there before.
inline std::string usdName(const std::string& name, std::set<std::string>& taken) {
  std::string valid = name;
  for (char& c : valid)
    if (std::string_view("abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789_")
            .find(c) == std::string_view::npos)
      c = '_';
  if (valid.empty() || (valid.front() >= '0' && valid.front() <= '9'))
    valid.insert(0, 1, '_');
  while (!taken.insert(valid).second)
    valid += '_';
  return valid;
}

/// Prims nested in each other, and their properties.
class UsdWriter {
 public:
  explicit UsdWriter(const std::string& path) : file_(path) {}

  void line(const std::string& text) { file_.append(indent_ + text + "\n"); }

  void openPrim(
      const std::string& type,
      const std::string& name,
      const std::vector<std::string>& metadata = {}) {
    describe("def " + type + " \"" + name + "\"", metadata);
    line("{");
    indent_ += "    ";
  }

  void openSamples(const std::string& declaration) {
    line(declaration + ".timeSamples = {");
    indent_ += "    ";
  }

  /// Of a prim or of samples.
  void close() {
    indent_.resize(indent_.size() - 4);
    line("}");
  }

  /// A property, or the head of a prim, and what is said about it in brackets.
  void describe(const std::string& text, const std::vector<std::string>& metadata) {
    line(metadata.empty() ? text : text + (text.empty() ? "(" : " ("));
    for (const std::string& entry : metadata)
      line("    " + entry);
    if (!metadata.empty())
      line(")");
  }

  void finish() { file_.commit(); }

 private:
  avatar::AtomicFileWriter file_;
  std::string indent_;
};

}  // namespace simulcap
