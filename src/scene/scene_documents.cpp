#include "src/scene/scene_documents.h"

#include <nlohmann/json.hpp>

#include <algorithm>

namespace simulcap {
namespace {

using OrderedJson = nlohmann::ordered_json;
using Kind = ValueType::Kind;

/// Whole numbers as such, so that the schema reads as a person would write it.
OrderedJson number(double value) {
  const auto whole = static_cast<std::int64_t>(value);
  return static_cast<double>(whole) == value ? OrderedJson(whole) : OrderedJson(value);
}

class SchemaWriter {
 public:
  explicit SchemaWriter(const SceneTable& table) : table_(table) {}

  OrderedJson record(const SceneRecord& record) const {
    OrderedJson schema = {{"type", "object"}, {"additionalProperties", false}};
    if (record.name == table_.root().name)
      schema["properties"]["$schema"] = {{"type", "string"}};
    for (const SceneField& field : record.fields) {
      schema["properties"][field.key] = this->field(field);
      if (field.required)
        schema["required"].push_back(field.key);
      if (!field.needs.empty())
        schema["dependencies"][field.key] = OrderedJson::array({field.needs});
    }
    addGroups(record, schema);
    return schema;
  }

 private:
  OrderedJson field(const SceneField& field) const {
    OrderedJson schema = {{"description", withUnit(field)}};
    schema.update(type(field.type));
    if (!field.defaultJson.empty())
      schema["default"] = OrderedJson::parse(field.defaultJson);
    return schema;
  }

  static std::string withUnit(const SceneField& field) {
    return field.meaning + (field.unit.empty() ? "" : " [" + field.unit + "]");
  }

  OrderedJson type(const ValueType& type) const {
    switch (type.kind) {
      case Kind::kBoolean:
        return {{"type", "boolean"}};
      case Kind::kInteger:
      case Kind::kNumber:
        return {
            {"type", type.kind == Kind::kInteger ? "integer" : "number"},
            {"minimum", number(type.min)},
            {"maximum", number(type.max)}};
      case Kind::kText:
        return text(type);
      case Kind::kChoice:
        return {{"enum", type.choices}};
      case Kind::kList:
        return {
            {"type", "array"},
            {"items", this->type(type.parts.front())},
            {"minItems", type.minItems},
            {"maxItems", type.maxItems}};
      case Kind::kRecord:
        return record(table_.record(type.record));
      case Kind::kAnyOf:
        return alternatives(type);
    }
    throw std::invalid_argument("sceneSchema: unknown kind of value");
  }

  static OrderedJson text(const ValueType& type) {
    OrderedJson schema = {{"type", "string"}, {"minLength", 1}};
    if (!type.pattern.empty())
      schema["pattern"] = type.pattern;
    return schema;
  }

  OrderedJson alternatives(const ValueType& type) const {
    OrderedJson schema;
    for (const ValueType& part : type.parts)
      schema["anyOf"].push_back(this->type(part));
    return schema;
  }

  static void addGroups(const SceneRecord& record, OrderedJson& schema) {
    for (const auto& keys : record.exactlyOneOf) {
      OrderedJson group;
      for (const std::string& key : keys)
        group["oneOf"].push_back({{"required", OrderedJson::array({key})}});
      schema["allOf"].push_back(group);
    }
    for (const auto& keys : record.atMostOneOf)
      excludeEachOther(keys, schema);
  }

  static void excludeEachOther(const std::vector<std::string>& keys, OrderedJson& schema) {
    for (std::size_t i = 0; i < keys.size(); ++i) {
      for (std::size_t j = i + 1; j < keys.size(); ++j) {
        OrderedJson both;
        both["not"]["required"] = {keys[i], keys[j]};
        schema["allOf"].push_back(both);
      }
    }
  }

  const SceneTable& table_;
};

std::string rangeInWords(const ValueType& type) {
  std::string range = shortNumber(type.min) + " … " + shortNumber(type.max);
  std::string words;
  switch (type.kind) {
    case Kind::kBoolean:
      return "`true`, `false`";
    case Kind::kInteger:
      return range + ", whole";
    case Kind::kNumber:
      return range;
    case Kind::kText:
      return "text";
    case Kind::kRecord:
      return "[" + type.record + "](#" + type.record + ")";
    case Kind::kChoice:
      for (const std::string& choice : type.choices)
        words += (words.empty() ? "`" : ", `") + choice + "`";
      return words;
    case Kind::kList:
      words = type.minItems == type.maxItems ? std::to_string(type.minItems) + " of " : "list of ";
      return words + rangeInWords(type.parts.front());
    case Kind::kAnyOf:
      for (const ValueType& part : type.parts)
        words += (words.empty() ? "" : "; or ") + rangeInWords(part);
      return words;
  }
  throw std::invalid_argument("sceneKeyTables: unknown kind of value");
}

std::string defaultInWords(const SceneField& field) {
  if (field.required)
    return "**required**";
  if (field.defaultJson.empty())
    return field.defaultWords;
  std::string text = field.defaultJson;
  if (text.front() == '"')
    return "`" + text.substr(1, text.size() - 2) + "`";
  for (std::size_t comma = text.find(','); comma != std::string::npos;
       comma = text.find(',', comma + 2))
    text.insert(comma + 1, " ");
  return text;
}

std::string groupSentence(const std::string& words, const std::vector<std::string>& keys) {
  std::string names;
  for (const std::string& key : keys)
    names += (names.empty() ? "`" : ", `") + key + "`";
  return words + " of " + names + ".";
}

std::string section(const SceneRecord& record) {
  std::string text = "### " + record.name + "\n\n" + record.meaning;
  for (const auto& keys : record.exactlyOneOf)
    text += " " + groupSentence("Exactly one", keys);
  for (const auto& keys : record.atMostOneOf)
    text += " " + groupSentence("At most one", keys);
  text += "\n\n";
  if (record.fields.empty())
    return text;
  text += "| key | unit | default | values | |\n|---|---|---|---|---|\n";
  for (const SceneField& field : record.fields) {
    const std::string needs = field.needs.empty() ? "" : " Needs `" + field.needs + "`.";
    text += "| `" + field.key + "` | " + field.unit + " | " + defaultInWords(field) + " | " +
            rangeInWords(field.type) + " | " + field.meaning + needs + " |\n";
  }
  return text + "\n";
}

}  // namespace

std::string sceneSchema(const SceneTable& table) {
  OrderedJson schema = {
      {"$schema", "http://json-schema.org/draft-07/schema#"},
      {"title", "simulcap scene"},
      {"description", "Made from src/scene/scene_fields.h by make_scene_docs; see README.md."}};
  schema.update(SchemaWriter(table).record(table.root()));
  return schema.dump(1) + "\n";
}

std::string sceneKeyTables(const SceneTable& table) {
  std::string text;
  for (const SceneRecord& record : table.records)
    text += section(record);
  text.pop_back();
  return text;
}

}  // namespace simulcap
