#pragma once

#include <string>
#include <vector>

namespace simulcap {

/// What a JSON value of a scene file may be.
struct ValueType {
  enum class Kind { kBoolean, kInteger, kNumber, kText, kChoice, kList, kRecord, kAnyOf };

  Kind kind = Kind::kBoolean;
  double min = 0.0, max = 0.0;       ///< integer, number: smallest and largest value
  int minItems = 0, maxItems = 0;    ///< list
  std::string pattern;               ///< text: ECMAScript regular expression, or empty
  std::vector<std::string> choices;  ///< choice
  std::vector<ValueType> parts;      ///< list: its items' type; any of: the alternatives
  std::string record;                ///< record: its name in the table
};

/// One key of an object.
struct SceneField {
  std::string key;
  ValueType type;
  std::string unit;  ///< "m", "N/m", …; empty: none
  bool required = false;
  std::string defaultJson;   ///< empty: required, or absent means something that isn't a value
  std::string defaultWords;  ///< then what absent means, for readers
  std::string example;       ///< text: a valid value
  std::string needs;         ///< another key of the object that must be there too; or empty
  std::string meaning;       ///< one sentence
};

/// One kind of object.
struct SceneRecord {
  std::string name;
  std::string meaning;
  std::vector<SceneField> fields;
  std::vector<std::vector<std::string>> exactlyOneOf;  ///< groups of keys
  std::vector<std::vector<std::string>> atMostOneOf;

  /// nullptr when the object has no such key.
  const SceneField* find(const std::string& key) const;
};

/// Every key a scene file may have, made from scene_fields.h.
struct SceneTable {
  std::vector<SceneRecord> records;  ///< the scene itself first, parts after what holds them

  /// Throws std::invalid_argument for an unknown name.
  const SceneRecord& record(const std::string& name) const;

  const SceneRecord& root() const { return records.front(); }
};

const SceneTable& sceneTable();

/// For messages and documents: "a number from 0 to 1", "one of soft, middle, hard".
std::string inWords(const ValueType& type);

/// A number as short as it is exact: "0.02", "-9.81", "1000000".
std::string shortNumber(double value);

}  // namespace simulcap
