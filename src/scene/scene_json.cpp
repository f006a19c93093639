#include "src/scene/scene_json.h"

#include <nlohmann/json.hpp>

#include <algorithm>
#include <utility>
#include <vector>

namespace simulcap {
namespace {

using Json = nlohmann::json;

/// "line 3, column 7" of a byte, counted from 1 in characters (UTF-8 continuations don't count).
std::string lineAndColumn(const std::string& text, std::size_t numBytes) {
  const std::size_t last = std::min(numBytes, text.size());
  const std::size_t position = last > 0 ? last - 1 : 0;
  const auto begin = text.begin();
  const auto here = begin + static_cast<std::ptrdiff_t>(position);
  const auto line = std::count(begin, here, '\n') + 1;
  const std::size_t newline = position > 0 ? text.rfind('\n', position - 1) : std::string::npos;
  const auto lineBegin = newline == std::string::npos ? begin : begin + newline + 1;
  const auto column = std::count_if(lineBegin, here, [](char c) { return (c & 0xC0) != 0x80; }) + 1;
  return "line " + std::to_string(line) + ", column " + std::to_string(column);
}

/// The library's message without its own number and position.
std::string withoutPrefix(const std::string& message) {
  const std::size_t syntax = message.find("syntax error");
  const std::size_t bracket = message.find("] ");
  if (syntax != std::string::npos)
    return message.substr(syntax);
  return bracket == std::string::npos ? message : message.substr(bracket + 2);
}

/// Builds the document and refuses keys that are there already: the library would keep the last.
class SceneSax : public nlohmann::json_sax<Json> {
 public:
  explicit SceneSax(const std::string& text) : text_(text) {}

  Json take() { return std::move(root_); }

  bool null() override { return add(nullptr); }

  bool boolean(bool value) override { return add(value); }

  bool number_integer(number_integer_t value) override { return add(value); }

  bool number_unsigned(number_unsigned_t value) override { return add(value); }

  bool number_float(number_float_t value, const string_t&) override { return add(value); }

  bool string(string_t& value) override { return add(std::move(value)); }

  bool binary(binary_t& value) override { return add(std::move(value)); }

  bool start_object(std::size_t) override { return open(Json::object()); }

  bool start_array(std::size_t) override { return open(Json::array()); }

  bool end_object() override { return close(); }

  bool end_array() override { return close(); }

  bool key(string_t& name) override {
    Level& level = levels_.back();
    level.key = name;
    if (level.value.contains(name))
      throw SceneProblem(path(), "appears twice in the same object; remove one");
    return true;
  }

  bool parse_error(
      std::size_t position, const std::string&, const nlohmann::detail::exception& error) override {
    throw SceneProblem(lineAndColumn(text_, position), withoutPrefix(error.what()));
  }

 private:
  struct Level {
    Json value;
    std::string key;  ///< of the object's member being read
  };

  bool open(Json container) {
    // Deeper than any scene; also keeps what walks the document from recursing too far.
    constexpr std::size_t kMaxDepth = 32;
    if (levels_.size() == kMaxDepth)
      throw SceneProblem(path(), "is nested too deep for a scene");
    levels_.push_back({std::move(container), ""});
    return true;
  }

  bool close() {
    Json finished = std::move(levels_.back().value);
    levels_.pop_back();
    return add(std::move(finished));
  }

  bool add(Json value) {
    if (levels_.empty())
      root_ = std::move(value);
    else if (levels_.back().value.is_array())
      levels_.back().value.push_back(std::move(value));
    else
      levels_.back().value[levels_.back().key] = std::move(value);
    return true;
  }

  std::string path() const {
    std::string result;
    for (const Level& level : levels_)
      result = level.value.is_array() ? indexPath(result, level.value.size())
                                      : joinPath(result, level.key);
    return result;
  }

  const std::string& text_;
  Json root_;
  std::vector<Level> levels_;
};

}  // namespace

std::string joinPath(const std::string& path, const std::string& key) {
  return path.empty() ? key : path + "." + key;
}

std::string indexPath(const std::string& path, std::size_t index) {
  return path + "[" + std::to_string(index) + "]";
}

Json parseSceneJson(const std::string& text) {
  constexpr bool kStrict = true;
  constexpr bool kIgnoreComments = true;
  SceneSax handler(text);
  Json::sax_parse(text, &handler, Json::input_format_t::json, kStrict, kIgnoreComments);
  return handler.take();
}

}  // namespace simulcap
