// Loops over the table of keys: whatever key is added to scene_fields.h is tested here as it
// stands.
#include "src/scene/scene_table.h"

#include "avatar/io/file_error.h"
#include "src/scene/scene_check.h"
#include "src/scene/scene_documents.h"
#include "src/scene/scene_file.h"
#include "src/scene/scene_json.h"
#include "tests/support/json_schema.h"
#include "tests/support/temporary_folder.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <fstream>
#include <functional>
#include <set>

namespace simulcap {
namespace {

using nlohmann::json;
using Kind = ValueType::Kind;

/// A key of the format and how to get there: the fields from the scene down to it.
using Chain = std::vector<const SceneField*>;

/// The record that a field's value is, or a list of; nullptr for values without keys.
const SceneRecord* recordOf(const ValueType& type) {
  const ValueType& item = type.kind == Kind::kList ? type.parts.front() : type;
  return item.kind == Kind::kRecord ? &sceneTable().record(item.record) : nullptr;
}

void forEachKey(
    const SceneRecord& record, Chain& chain, const std::function<void(const Chain&)>& use) {
  for (const SceneField& field : record.fields) {
    chain.push_back(&field);
    use(chain);
    if (const SceneRecord* part = recordOf(field.type))
      forEachKey(*part, chain, use);
    chain.pop_back();
  }
}

void forEachKey(const std::function<void(const Chain&)>& use) {
  Chain chain;
  forEachKey(sceneTable().root(), chain, use);
}

std::string pathOf(const Chain& chain) {
  std::string path;
  for (const SceneField* field : chain) {
    path = joinPath(path, field->key);
    if (field != chain.back() && field->type.kind == Kind::kList)
      path = indexPath(path, 0);
  }
  return path;
}

json::json_pointer pointerTo(const Chain& chain) {
  json::json_pointer pointer;
  for (const SceneField* field : chain) {
    pointer /= field->key;
    if (field != chain.back() && field->type.kind == Kind::kList)
      pointer /= std::size_t{0};
  }
  return pointer;
}

json objectWith(const SceneRecord& record, const SceneField* wanted, const json* value);

/// Some value that is allowed.
json sample(const ValueType& type, const std::string& example) {
  switch (type.kind) {
    case Kind::kBoolean:
      return true;
    case Kind::kInteger:
      return std::floor((type.min + type.max) / 2.0);
    case Kind::kNumber:
      return (type.min + type.max) / 2.0;
    case Kind::kText:
      return example;
    case Kind::kChoice:
      return type.choices.front();
    case Kind::kList:
      return std::vector<json>(
          static_cast<std::size_t>(std::max(1, type.minItems)),
          sample(type.parts.front(), example));
    case Kind::kRecord:
      return objectWith(sceneTable().record(type.record), nullptr, nullptr);
    case Kind::kAnyOf:
      // Choices come with conditions: names of pins fit one kind of cloth.
      return sample(
          type.parts.front().kind == Kind::kChoice ? type.parts.back() : type.parts.front(),
          example);
  }
  return {};
}

json sample(const SceneField& field) {
  return field.defaultJson.empty() ? sample(field.type, field.example)
                                   : json::parse(field.defaultJson);
}

/// The smallest object of this kind, with the wanted key (and its value, else a sample).
json objectWith(const SceneRecord& record, const SceneField* wanted, const json* value) {
  json object = json::object();
  const auto add = [&](const SceneField& field) {
    object[field.key] = &field == wanted && value != nullptr ? *value : sample(field);
  };
  for (const SceneField& field : record.fields) {
    if (field.required || &field == wanted)
      add(field);
  }
  if (wanted != nullptr && !wanted->needs.empty())
    add(*record.find(wanted->needs));
  for (const auto& keys : record.exactlyOneOf) {
    if (std::none_of(keys.begin(), keys.end(), [&](const auto& k) { return object.contains(k); }))
      add(*record.find(keys.front()));
  }
  return object;
}

/// A valid scene that has the key.
json sceneWith(const Chain& chain) {
  json value = sample(*chain.back());
  for (std::size_t i = chain.size(); i-- > 0;) {
    const SceneRecord& owner = i == 0 ? sceneTable().root() : *recordOf(chain[i - 1]->type);
    value = objectWith(owner, chain[i], &value);
    if (i > 0 && chain[i - 1]->type.kind == Kind::kList)
      value = json::array({value});
  }
  // Garments of the wardrobe are cut for a body; a time without length ends with the motion.
  if (!value.contains("body"))
    value["body"] = {{"motion", "walk"}};
  return value;
}

bool allows(const ValueType& type, const json& value) {
  if (type.kind == Kind::kAnyOf)
    return std::any_of(type.parts.begin(), type.parts.end(), [&](const auto& part) {
      return allows(part, value);
    });
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
    default:
      return value.is_object();
  }
}

/// What is not allowed in the place of a value, with what its path grows by.
using Wrong = std::pair<json, std::string>;

void addWrong(const ValueType& type, const json& valid, std::vector<Wrong>& wrong) {
  switch (type.kind) {
    case Kind::kInteger:
      wrong.emplace_back(type.min + 0.5, "");
      [[fallthrough]];
    case Kind::kNumber:
      for (const double value : {type.min - 1.0, type.max + 1.0, 1e300, -1e300})
        wrong.emplace_back(value, "");
      return;
    case Kind::kText:
      wrong.emplace_back("", "");
      if (!type.pattern.empty())
        wrong.emplace_back("a b", "");
      return;
    case Kind::kChoice:
      wrong.emplace_back(type.choices.front() + "x", "");
      return;
    case Kind::kList: {
      std::vector<Wrong> items;
      addWrong(type.parts.front(), {}, items);
      items.emplace_back(nullptr, "");
      const auto length = static_cast<std::size_t>(std::max(1, type.minItems));
      for (const auto& [item, path] : items)
        wrong.emplace_back(std::vector<json>(length, item), "[0]" + path);
      const json item = sample(type.parts.front(), "walk");
      wrong.emplace_back(std::vector<json>(static_cast<std::size_t>(type.maxItems) + 1, item), "");
      return;
    }
    case Kind::kAnyOf:
      for (const ValueType& part : type.parts)
        addWrong(part, valid, wrong);
      return;
    default:
      return;
  }
}

std::vector<Wrong> wrongValues(const SceneField& field, const json& valid) {
  std::vector<Wrong> wrong;
  for (const json& value :
       {json(nullptr), json(true), json(1), json("text"), json::array(), json::object()}) {
    if (!allows(field.type, value))
      wrong.emplace_back(value, "");
  }
  addWrong(field.type, valid, wrong);
  return wrong;
}

class SceneTableTest : public ::testing::Test {
 protected:
  SceneTableTest() {
    for (const char* name : {"garment.obj", "body.npz"})
      std::ofstream(folder_.path(name)) << "only its existence counts here";
  }

  /// "" or what reading it ends with, without the file's name.
  std::string errorOf(const json& document) const {
    const std::string path = folder_.path("scene.json");
    std::ofstream(path) << document.dump();
    try {
      readScene(path);
    } catch (const avatar::FileError& error) {
      return std::string(error.what()).substr(path.size() + 2);
    }
    return "";
  }

  void expectRefused(const json& document, const std::string& path) const {
    const std::string message = errorOf(document);
    EXPECT_EQ(message.substr(0, path.size() + 2), path + ": ") << message;
    EXPECT_FALSE(schema_.accepts(document)) << path;
  }

  avatar::test::TemporaryFolder folder_;
  test::JsonSchema schema_{json::parse(sceneSchema(sceneTable()))};
};

TEST_F(SceneTableTest, EveryKeyIsAcceptedByReaderAndSchema) {
  forEachKey([&](const Chain& chain) {
    const json document = sceneWith(chain);
    EXPECT_EQ(errorOf(document), "") << pathOf(chain) << document;
    EXPECT_TRUE(schema_.accepts(document)) << pathOf(chain) << document;
  });
}

TEST_F(SceneTableTest, EveryWrongTypeAndRangeIsRefusedByReaderAndSchemaAndNamed) {
  int count = 0;
  forEachKey([&](const Chain& chain) {
    const json valid = sceneWith(chain);
    for (const auto& [value, path] : wrongValues(*chain.back(), valid)) {
      json document = valid;
      document[pointerTo(chain)] = value;
      expectRefused(document, pathOf(chain) + path);
      ++count;
    }
  });
  EXPECT_GT(count, 500);
}

TEST_F(SceneTableTest, EveryMisspelledKeyIsRefusedNamedAndCorrected) {
  forEachKey([&](const Chain& chain) {
    json document = sceneWith(chain);
    const auto parent = pointerTo(chain).parent_pointer();
    const std::string misspelled = chain.back()->key + chain.back()->key.back();
    document[parent][misspelled] = document[parent][chain.back()->key];
    const std::string path = pathOf(chain) + chain.back()->key.back();
    expectRefused(document, path);
    EXPECT_EQ(errorOf(document), path + ": unknown key; did you mean " + chain.back()->key + "?");
  });
}

TEST_F(SceneTableTest, EveryRequiredKeyIsMissed) {
  forEachKey([&](const Chain& chain) {
    if (!chain.back()->required)
      return;
    json document = sceneWith(chain);
    document[pointerTo(chain).parent_pointer()].erase(chain.back()->key);
    expectRefused(document, pathOf(chain));
  });
}

TEST_F(SceneTableTest, KeysThatNeedAnotherAreRefusedWithoutIt) {
  forEachKey([&](const Chain& chain) {
    if (chain.back()->needs.empty())
      return;
    json document = sceneWith(chain);
    document[pointerTo(chain).parent_pointer()].erase(chain.back()->needs);
    expectRefused(document, pathOf(chain));
  });
}

TEST_F(SceneTableTest, LimitsThemselvesAreAllowed) {
  forEachKey([&](const Chain& chain) {
    const ValueType& type = chain.back()->type;
    if (type.kind != Kind::kNumber && type.kind != Kind::kInteger)
      return;
    for (const double limit : {type.min, type.max}) {
      json document = sceneWith(chain);
      document[pointerTo(chain)] = limit;
      EXPECT_NO_THROW(checkAgainstTable(document, sceneTable())) << pathOf(chain);
      EXPECT_TRUE(schema_.accepts(document)) << pathOf(chain);
    }
  });
}

TEST_F(SceneTableTest, EveryKeyIsDescribed) {
  for (const SceneRecord& record : sceneTable().records) {
    EXPECT_FALSE(record.meaning.empty()) << record.name;
    std::set<std::string> keys;
    for (const SceneField& field : record.fields) {
      SCOPED_TRACE(record.name + "." + field.key);
      EXPECT_TRUE(keys.insert(field.key).second);
      EXPECT_EQ(field.meaning.back(), '.');
      EXPECT_TRUE(field.required || !field.defaultJson.empty() || !field.defaultWords.empty());
      EXPECT_TRUE(field.needs.empty() || record.find(field.needs) != nullptr);
      if (field.type.kind == Kind::kNumber || field.type.kind == Kind::kInteger) {
        EXPECT_LT(field.type.min, field.type.max);
      }
    }
  }
}

TEST(ShortNumber, IsExactAndWithoutExponent) {
  EXPECT_EQ(shortNumber(0.1), "0.1");
  EXPECT_EQ(shortNumber(-9.81), "-9.81");
  EXPECT_EQ(shortNumber(1e6), "1000000");
  EXPECT_EQ(shortNumber(1e-7), "0.0000001");
  EXPECT_EQ(shortNumber(4294967295.0), "4294967295");
}

}  // namespace
}  // namespace simulcap
