#pragma once

#include <nlohmann/json.hpp>

#include <cmath>
#include <regex>
#include <stdexcept>
#include <string>
#include <vector>

namespace simulcap::test {

/// The part of JSON Schema (draft-07) that scenes/scene.schema.json uses, written from its
/// specification. A keyword it doesn't know is a std::logic_error: nothing is passed unchecked.
class JsonSchema {
 public:
  using Json = nlohmann::json;

  explicit JsonSchema(Json schema) : schema_(std::move(schema)) {}

  bool accepts(const Json& value) const { return accepts(schema_, value); }

 private:
  static bool accepts(const Json& schema, const Json& value) {
    for (const auto& [keyword, argument] : schema.items()) {
      if (!holds(keyword, argument, schema, value))
        return false;
    }
    return true;
  }

  static bool holds(
      const std::string& keyword, const Json& argument, const Json& schema, const Json& value) {
    if (keyword == "$schema" || keyword == "title" || keyword == "description" ||
        keyword == "default")
      return true;
    if (keyword == "type")
      return hasType(argument, value);
    if (keyword == "enum")
      return std::find(argument.begin(), argument.end(), value) != argument.end();
    if (keyword == "allOf" || keyword == "anyOf" || keyword == "oneOf")
      return combines(keyword, argument, value);
    if (keyword == "not")
      return !accepts(argument, value);
    // The rest speaks of one type of value and allows all others.
    if (value.is_number())
      return numberHolds(keyword, argument, value.get<double>());
    if (value.is_string())
      return textHolds(keyword, argument, value.get<std::string>());
    if (value.is_array())
      return arrayHolds(keyword, argument, value);
    return !value.is_object() || objectHolds(keyword, argument, schema, value);
  }

  static bool hasType(const std::string& type, const Json& value) {
    if (type == "integer")
      return value.is_number() && value.get<double>() == std::floor(value.get<double>());
    if (type == "number")
      return value.is_number();
    if (type != "object" && type != "array" && type != "string" && type != "boolean")
      throw std::logic_error("unknown type " + type);
    return value.type_name() == type;
  }

  static bool combines(const std::string& keyword, const Json& schemas, const Json& value) {
    std::size_t count = 0;
    for (const Json& schema : schemas)
      count += accepts(schema, value) ? 1 : 0;
    if (keyword == "oneOf")
      return count == 1;
    return keyword == "anyOf" ? count > 0 : count == schemas.size();
  }

  static bool numberHolds(const std::string& keyword, const Json& argument, double value) {
    if (keyword == "minimum")
      return value >= argument.get<double>();
    if (keyword == "maximum")
      return value <= argument.get<double>();
    return isForOthers(keyword);
  }

  /// Lengths are counted in bytes here: enough for minLength 1.
  static bool textHolds(
      const std::string& keyword, const Json& argument, const std::string& value) {
    if (keyword == "minLength")
      return value.size() >= argument.get<std::size_t>();
    if (keyword == "pattern")
      return std::regex_search(value, std::regex(argument.get<std::string>()));
    return isForOthers(keyword);
  }

  static bool arrayHolds(const std::string& keyword, const Json& argument, const Json& value) {
    if (keyword == "minItems")
      return value.size() >= argument.get<std::size_t>();
    if (keyword == "maxItems")
      return value.size() <= argument.get<std::size_t>();
    if (keyword != "items")
      return isForOthers(keyword);
    return std::all_of(
        value.begin(), value.end(), [&](const Json& item) { return accepts(argument, item); });
  }

  static bool objectHolds(
      const std::string& keyword, const Json& argument, const Json& schema, const Json& value) {
    if (keyword == "required")
      return hasAll(argument, value);
    if (keyword == "properties") {
      for (const auto& [key, member] : value.items()) {
        if (argument.contains(key) && !accepts(argument[key], member))
          return false;
      }
      return true;
    }
    if (keyword == "additionalProperties") {
      for (const auto& [key, member] : value.items()) {
        if (!schema.contains("properties") || !schema["properties"].contains(key))
          return argument.get<bool>();
      }
      return true;
    }
    if (keyword == "dependencies") {
      for (const auto& [key, needed] : argument.items()) {
        if (value.contains(key) && !hasAll(needed, value))
          return false;
      }
      return true;
    }
    return isForOthers(keyword);
  }

  static bool hasAll(const Json& keys, const Json& value) {
    return std::all_of(keys.begin(), keys.end(), [&](const Json& key) {
      return value.contains(key.get<std::string>());
    });
  }

  static bool isForOthers(const std::string& keyword) {
    static const std::vector<std::string> kKnown = {
        "minimum",
        "maximum",
        "minLength",
        "pattern",
        "minItems",
        "maxItems",
        "items",
        "required",
        "properties",
        "additionalProperties",
        "dependencies"};
    if (std::find(kKnown.begin(), kKnown.end(), keyword) == kKnown.end())
      throw std::logic_error("unknown keyword " + keyword);
    return true;
  }

  Json schema_;
};

}  // namespace simulcap::test
