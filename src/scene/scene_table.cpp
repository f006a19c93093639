#include "src/scene/scene_table.h"

#include "src/scene/scene_fields.h"

#include <nlohmann/json.hpp>

#include <algorithm>
#include <charconv>
#include <limits>
#include <stdexcept>
#include <utility>

namespace simulcap {

std::string valuePerMaterial(double avatar::ClothParameters::*value) {
  std::string words;
  for (const std::string_view name : bullet_ext::kPaperMaterials) {
    const std::string material(name);
    words +=
        (words.empty() ? "" : ", ") + material + " " + shortNumber(paperCloth(material).*value);
  }
  return words;
}

namespace {

using OrderedJson = nlohmann::ordered_json;
using Kind = ValueType::Kind;

ValueType numberType(Kind kind, const FieldText& text) {
  return {.kind = kind, .min = text.min, .max = text.max};
}

ValueType textType(const FieldText& text) {
  if (!text.choices.empty())
    return {.kind = Kind::kChoice, .choices = text.choices};
  return {.kind = Kind::kText, .pattern = text.pattern};
}

ValueType listOf(ValueType item, int minItems, int maxItems) {
  return {.kind = Kind::kList, .minItems = minItems, .maxItems = maxItems, .parts = {item}};
}

ValueType anyOf(std::vector<ValueType> alternatives) {
  return {.kind = Kind::kAnyOf, .parts = std::move(alternatives)};
}

/// Visitor of scene_fields.h: every part becomes a record, every member a field.
class TableBuilder {
 public:
  SceneTable build() {
    Scene scene;
    addRecord(scene);
    return std::move(table_);
  }

  void record(const std::string& name, const std::string& meaning) {
    current().name = name;
    current().meaning = meaning;
  }

  template <class Member>
  void field(const std::string& key, const Member& member, const FieldText& text) {
    SceneField field{.key = key, .type = type(member, text), .unit = text.unit};
    field.required = text.required;
    field.defaultWords = text.defaultWords;
    field.example = text.example;
    field.needs = text.needs;
    field.meaning = text.meaning;
    if (!text.required && text.defaultWords.empty())
      field.defaultJson = defaultValue(member).dump();
    current().fields.push_back(std::move(field));
  }

  template <class... Parts>
  void oneOf(
      const std::variant<Parts...>& member,
      const std::array<Alternative, sizeof...(Parts)>& alternatives) {
    static_cast<void>(member);
    std::vector<std::string> keys;
    std::size_t index = 0;
    (addAlternative<Parts>(alternatives[index++], keys), ...);
    const bool needed = keys.size() == sizeof...(Parts);
    (needed ? current().exactlyOneOf : current().atMostOneOf).push_back(keys);
  }

  void atMostOneOf(const std::vector<std::string>& keys) { current().atMostOneOf.push_back(keys); }

 private:
  SceneRecord& current() { return table_.records[open_.back()]; }

  /// Parts that are used in two places are the same record.
  template <class Part>
  std::string addRecord(Part& part) {
    open_.push_back(table_.records.size());
    table_.records.emplace_back();
    describe(*this, part);
    std::string name = current().name;
    const auto named = [&](const SceneRecord& other) { return other.name == name; };
    if (std::count_if(table_.records.begin(), table_.records.end(), named) > 1)
      table_.records.pop_back();
    open_.pop_back();
    return name;
  }

  template <class Part>
  void addAlternative(const Alternative& alternative, std::vector<std::string>& keys) {
    if (alternative.key.empty())
      return;
    keys.push_back(alternative.key);
    if constexpr (!std::is_same_v<Part, StaticMotion>) {
      FieldText text{.meaning = alternative.meaning};
      text.defaultWords = "–";
      field(alternative.key, Part(), text);
    }
  }

  static ValueType type(bool, const FieldText&) { return {.kind = Kind::kBoolean}; }

  static ValueType type(int, const FieldText& text) { return numberType(Kind::kInteger, text); }

  static ValueType type(std::uint32_t, const FieldText& text) {
    return numberType(Kind::kInteger, text);
  }

  static ValueType type(double, const FieldText& text) { return numberType(Kind::kNumber, text); }

  static ValueType type(const std::string&, const FieldText& text) { return textType(text); }

  static ValueType type(const Eigen::Vector3d&, const FieldText& text) {
    return listOf(numberType(Kind::kNumber, text), 3, 3);
  }

  /// A whole number, or a word that stands for "absent".
  static ValueType type(const std::optional<int>&, const FieldText& text) {
    const ValueType number = numberType(Kind::kInteger, text);
    return text.choices.empty() ? number : anyOf({number, textType(text)});
  }

  static ValueType type(const std::vector<std::string>&, const FieldText& text) {
    const ValueType one = textType(text);
    return anyOf({one, listOf(one, text.minItems, text.maxItems)});
  }

  static ValueType type(
      const std::variant<std::vector<double>, std::string>&, const FieldText& text) {
    return anyOf(
        {textType(text), listOf(numberType(Kind::kNumber, text), text.minItems, text.maxItems)});
  }

  static ValueType type(const std::vector<Pin>&, const FieldText& text) {
    const ValueType pin = anyOf({textType(text), numberType(Kind::kInteger, text)});
    return listOf(pin, text.minItems, text.maxItems);
  }

  template <class Value>
  ValueType type(const std::optional<Value>&, const FieldText& text) {
    return type(Value(), text);
  }

  template <class Part>
  ValueType type(const std::vector<Part>&, const FieldText& text) {
    return listOf(type(Part(), text), text.minItems, text.maxItems);
  }

  /// Enumerations and parts.
  template <class Value>
  ValueType type(Value value, const FieldText&) {
    if constexpr (std::is_enum_v<Value>) {
      ValueType result{.kind = Kind::kChoice};
      for (const auto& [name, choice] : choiceNames(value))
        result.choices.push_back(name);
      return result;
    } else {
      return {.kind = Kind::kRecord, .record = addRecord(value)};
    }
  }

  /// Whole numbers without a fraction, as a person would write them.
  static OrderedJson defaultValue(double value) {
    const auto whole = static_cast<std::int64_t>(value);
    return static_cast<double>(whole) == value ? OrderedJson(whole) : OrderedJson(value);
  }

  static OrderedJson defaultValue(const Eigen::Vector3d& value) {
    return {defaultValue(value.x()), defaultValue(value.y()), defaultValue(value.z())};
  }

  static OrderedJson defaultValue(const std::variant<std::vector<double>, std::string>& value) {
    return std::get<std::vector<double>>(value);
  }

  /// Absent by default, although a word says it too.
  static OrderedJson defaultValue(const std::optional<int>&) { return "auto"; }

  template <class Value>
  static OrderedJson defaultValue(const Value& value) {
    if constexpr (std::is_enum_v<Value>) {
      for (const auto& [name, choice] : choiceNames(value)) {
        if (choice == value)
          return name;
      }
      return {};
    } else if constexpr (std::is_constructible_v<OrderedJson, Value>) {
      return value;
    } else {
      throw std::logic_error("scene_fields.h: a part needs defaultWords");
    }
  }

  SceneTable table_;
  std::vector<std::size_t> open_;  ///< records being described, outermost first
};

std::string listInWords(const ValueType& type) {
  const ValueType& item = type.parts.front();
  const std::string items = inWords(item);
  if (type.minItems == type.maxItems)
    return "a list of " + std::to_string(type.minItems) + " items, each " + items;
  const std::string from = type.minItems > 0 ? std::to_string(type.minItems) + " to " : "up to ";
  return "a list of " + from + std::to_string(type.maxItems) + " items, each " + items;
}

}  // namespace

std::string shortNumber(double value) {
  char text[32];
  const auto result = std::to_chars(text, text + sizeof text, value);
  std::string shortest(text, result.ptr);
  if (shortest.find('e') == std::string::npos)
    return shortest;
  const auto fixed = std::to_chars(text, text + sizeof text, value, std::chars_format::fixed);
  return fixed.ec == std::errc() ? std::string(text, fixed.ptr) : shortest;
}

std::string inWords(const ValueType& type) {
  const std::string range = " from " + shortNumber(type.min) + " to " + shortNumber(type.max);
  std::string words;
  switch (type.kind) {
    case Kind::kBoolean:
      return "true or false";
    case Kind::kInteger:
      return "a whole number" + range;
    case Kind::kNumber:
      return "a number" + range;
    case Kind::kText:
      return type.pattern.empty() ? "a text" : "a text like " + type.pattern;
    case Kind::kRecord:
      return "an object with the keys of `" + type.record + "`";
    case Kind::kList:
      return listInWords(type);
    case Kind::kChoice:
      for (const std::string& choice : type.choices)
        words += (words.empty() ? "" : ", ") + choice;
      return type.choices.size() == 1 ? words : "one of " + words;
    case Kind::kAnyOf:
      for (const ValueType& alternative : type.parts)
        words += (words.empty() ? "" : ", or ") + inWords(alternative);
      return words;
  }
  throw std::invalid_argument("inWords: unknown kind of value");
}

const SceneField* SceneRecord::find(const std::string& key) const {
  for (const SceneField& field : fields) {
    if (field.key == key)
      return &field;
  }
  return nullptr;
}

const SceneRecord& SceneTable::record(const std::string& name) const {
  for (const SceneRecord& record : records) {
    if (record.name == name)
      return record;
  }
  throw std::invalid_argument("SceneTable: no record is called " + name);
}

const SceneTable& sceneTable() {
  static const SceneTable kTable = TableBuilder().build();
  return kTable;
}

}  // namespace simulcap
