#include "src/scene/scene_check.h"

#include "src/scene/nearest_name.h"
#include "src/scene/scene_json.h"

#include <nlohmann/json.hpp>

#include <algorithm>
#include <cmath>
#include <regex>

namespace simulcap {
namespace {

using Json = nlohmann::json;
using Kind = ValueType::Kind;

/// What was found, as short as a line of a message may be.
std::string found(const Json& value) {
  if (value.is_object())
    return "an object";
  if (value.is_array())
    return "a list of " + std::to_string(value.size());
  constexpr std::size_t kLongest = 60;
  const std::string text = value.dump(-1, ' ', true);
  return text.size() <= kLongest ? text : text.substr(0, kLongest) + "…";
}

[[noreturn]] void fail(const std::string& path, const ValueType& type, const Json& value) {
  throw SceneProblem(path, "expected " + inWords(type) + "; found " + found(value));
}

std::vector<std::string> keysOf(const SceneRecord& record) {
  std::vector<std::string> keys;
  for (const SceneField& field : record.fields)
    keys.push_back(field.key);
  return keys;
}

std::string inWords(const std::vector<std::string>& keys) {
  std::string words;
  for (const std::string& key : keys)
    words += (words.empty() ? "" : ", ") + key;
  return words;
}

bool hasKindOf(const Json& value, const ValueType& type) {
  switch (type.kind) {
    case Kind::kBoolean:
      return value.is_boolean();
    case Kind::kInteger:
    case Kind::kNumber:
      return value.is_number();
    case Kind::kText:
    case Kind::kChoice:
      return value.is_string();
    case Kind::kList:
      return value.is_array();
    case Kind::kRecord:
      return value.is_object();
    case Kind::kAnyOf:
      return std::any_of(type.parts.begin(), type.parts.end(), [&](const ValueType& part) {
        return hasKindOf(value, part);
      });
  }
  return false;
}

class Checker {
 public:
  explicit Checker(const SceneTable& table) : table_(table) {}

  void checkRecord(const Json& object, const SceneRecord& record, const std::string& path) const {
    for (const auto& [key, value] : object.items()) {
      const SceneField* field = record.find(key);
      // Editors look for the schema's address there.
      const bool schema = path.empty() && key == "$schema" && value.is_string();
      if (field == nullptr && !schema)
        throw SceneProblem(joinPath(path, key), unknownKey(key, record));
      if (field != nullptr)
        checkField(value, *field, object, joinPath(path, key));
    }
    for (const SceneField& field : record.fields) {
      if (field.required && !object.contains(field.key))
        throw SceneProblem(
            joinPath(path, field.key), "is missing; expected " + simulcap::inWords(field.type));
    }
    checkGroups(object, record, path);
  }

 private:
  static std::string unknownKey(const std::string& key, const SceneRecord& record) {
    const std::vector<std::string> keys = keysOf(record);
    const std::string hint = didYouMean(key, keys);
    if (!hint.empty())
      return "unknown key" + hint;
    return keys.empty() ? "unknown key; " + record.name + " has none"
                        : "unknown key; " + record.name + " has " + inWords(keys);
  }

  void checkField(
      const Json& value,
      const SceneField& field,
      const Json& object,
      const std::string& path) const {
    if (!field.needs.empty() && !object.contains(field.needs))
      throw SceneProblem(path, "needs " + field.needs + " beside it");
    checkValue(value, field.type, path);
  }

  static void checkGroups(const Json& object, const SceneRecord& record, const std::string& path) {
    const auto count = [&](const std::vector<std::string>& keys) {
      return std::count_if(
          keys.begin(), keys.end(), [&](const std::string& key) { return object.contains(key); });
    };
    for (const auto& keys : record.exactlyOneOf) {
      if (count(keys) != 1)
        throw SceneProblem(
            path,
            "expected exactly one of " + inWords(keys) + "; found " + std::to_string(count(keys)));
    }
    for (const auto& keys : record.atMostOneOf) {
      if (count(keys) > 1)
        throw SceneProblem(path, "expected only one of " + inWords(keys) + "; found several");
    }
  }

  void checkValue(const Json& value, const ValueType& type, const std::string& path) const {
    if (!hasKindOf(value, type))
      fail(path, type, value);
    switch (type.kind) {
      case Kind::kInteger:
      case Kind::kNumber:
        return checkNumber(value, type, path);
      case Kind::kText:
      case Kind::kChoice:
        return checkText(value, type, path);
      case Kind::kList:
        return checkList(value, type, path);
      case Kind::kRecord:
        return checkRecord(value, table_.record(type.record), path);
      case Kind::kAnyOf:
        return checkAlternatives(value, type, path);
      case Kind::kBoolean:
        return;
    }
  }

  static void checkNumber(const Json& value, const ValueType& type, const std::string& path) {
    const auto number = value.get<double>();
    const bool whole = type.kind == Kind::kNumber || number == std::floor(number);
    if (!whole || !(number >= type.min && number <= type.max))
      fail(path, type, value);
  }

  static void checkText(const Json& value, const ValueType& type, const std::string& path) {
    const auto& text = value.get_ref<const std::string&>();
    const auto& choices = type.choices;
    if (type.kind == Kind::kChoice) {
      if (std::find(choices.begin(), choices.end(), text) == choices.end())
        throw SceneProblem(
            path,
            "expected " + simulcap::inWords(type) + "; found " + found(value) +
                didYouMean(text, choices));
      return;
    }
    // Longer than any path; also bounds what the regular expression has to do.
    constexpr std::size_t kLongest = 4096;
    const bool fits =
        !text.empty() && text.size() <= kLongest && text.find('\0') == std::string::npos;
    if (!fits || (!type.pattern.empty() && !std::regex_match(text, std::regex(type.pattern))))
      fail(path, type, value);
  }

  void checkList(const Json& value, const ValueType& type, const std::string& path) const {
    if (value.size() < static_cast<std::size_t>(type.minItems) ||
        value.size() > static_cast<std::size_t>(type.maxItems))
      fail(path, type, value);
    for (std::size_t i = 0; i < value.size(); ++i)
      checkValue(value[i], type.parts.front(), indexPath(path, i));
  }

  /// Alternatives differ in their JSON type, so that the value's decides which one was meant.
  void checkAlternatives(const Json& value, const ValueType& type, const std::string& path) const {
    for (const ValueType& alternative : type.parts) {
      if (hasKindOf(value, alternative))
        return checkValue(value, alternative, path);
    }
  }

  const SceneTable& table_;
};

}  // namespace

void checkAgainstTable(const Json& document, const SceneTable& table) {
  if (!document.is_object())
    throw SceneProblem("", "a scene is one JSON object {…}; found " + found(document));
  Checker(table).checkRecord(document, table.root(), "");
}

}  // namespace simulcap
