#include "src/scene/scene_documents.h"

#include "src/scene/scene_file.h"
#include "tests/support/json_schema.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <fstream>

namespace simulcap {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;

json parsed(const fs::path& path) {
  std::ifstream file(path);
  return json::parse(file, nullptr, true, /*ignore_comments=*/true);
}

std::vector<fs::path> sceneFiles() {
  std::vector<fs::path> files;
  for (const auto& entry : fs::directory_iterator(SIMULCAP_SCENES)) {
    if (entry.path().extension() == ".json" && entry.path().filename() != "scene.schema.json")
      files.push_back(entry.path());
  }
  std::sort(files.begin(), files.end());
  return files;
}

TEST(SceneDocuments, EverySceneOfTheFolderIsRead) {
  EXPECT_GE(sceneFiles().size(), 10U);
  for (const fs::path& file : sceneFiles()) {
    SCOPED_TRACE(file);
    EXPECT_NO_THROW({
      const Scene scene = readScene(file);
      EXPECT_FALSE(scene.garments.empty());
      EXPECT_FALSE(leftOut(scene).empty());
    });
  }
}

TEST(SceneDocuments, EverySceneOfTheFolderFitsTheCommittedSchema) {
  const test::JsonSchema schema(parsed(fs::path(SIMULCAP_SCENES) / "scene.schema.json"));
  for (const fs::path& file : sceneFiles())
    EXPECT_TRUE(schema.accepts(parsed(file))) << file;
}

TEST(SceneDocuments, EverySceneSaysWhatItShowsAndNamesItsSchema) {
  for (const fs::path& file : sceneFiles()) {
    std::string line;
    std::ifstream stream(file);
    std::getline(stream, line);
    EXPECT_EQ(line.substr(0, 3), "// ") << file;
    EXPECT_EQ(parsed(file)["$schema"], "scene.schema.json") << file;
  }
}

TEST(SceneDocuments, TheReadmeListsEverySceneAndItsExampleIsValid) {
  std::ostringstream text;
  text << std::ifstream(fs::path(SIMULCAP_SCENES) / "README.md").rdbuf();
  const std::string readme = text.str();
  for (const fs::path& file : sceneFiles())
    EXPECT_NE(readme.find("`" + file.filename().string() + "`"), std::string::npos) << file;
  const std::string mark = "```jsonc\n";
  const std::size_t begin = readme.find(mark) + mark.size();
  const std::string example = readme.substr(begin, readme.find("```", begin) - begin);
  const test::JsonSchema schema(json::parse(sceneSchema(sceneTable())));
  EXPECT_TRUE(schema.accepts(json::parse(example, nullptr, true, true)));
}

TEST(SceneDocuments, TheTablesHaveEveryRecordAndKeyOnce) {
  const std::string tables = sceneKeyTables(sceneTable());
  for (const SceneRecord& record : sceneTable().records) {
    const std::string heading = "### " + record.name + "\n";
    const std::size_t begin = tables.find(heading);
    ASSERT_NE(begin, std::string::npos) << record.name;
    EXPECT_EQ(tables.find(heading, begin + 1), std::string::npos) << record.name;
    const std::string section = tables.substr(begin, tables.find("\n### ", begin) - begin);
    for (const SceneField& field : record.fields)
      EXPECT_NE(section.find("| `" + field.key + "` |"), std::string::npos) << field.key;
  }
}

/// The validator itself, against the specification's statements.
TEST(JsonSchemaSupport, RefusesWhatTheSpecificationRefuses) {
  const auto accepts = [](const char* schema, const char* value) {
    return test::JsonSchema(json::parse(schema)).accepts(json::parse(value));
  };
  EXPECT_TRUE(accepts(R"({"type": "integer"})", "3.0"));
  EXPECT_FALSE(accepts(R"({"type": "integer"})", "3.5"));
  EXPECT_FALSE(accepts(R"({"type": "number", "minimum": 1})", "0.9"));
  EXPECT_FALSE(accepts(R"({"enum": ["a", "b"]})", "\"c\""));
  EXPECT_FALSE(accepts(R"({"items": {"type": "number"}})", "[1, true]"));
  EXPECT_FALSE(accepts(R"({"minItems": 2})", "[1]"));
  EXPECT_FALSE(
      accepts(R"({"properties": {"a": {}}, "additionalProperties": false})", R"({"b": 1})"));
  EXPECT_FALSE(accepts(R"({"required": ["a"]})", "{}"));
  EXPECT_TRUE(accepts(R"({"required": ["a"]})", "3"));
  EXPECT_FALSE(accepts(R"({"dependencies": {"a": ["b"]}})", R"({"a": 1})"));
  EXPECT_FALSE(
      accepts(R"({"oneOf": [{"required": ["a"]}, {"required": ["b"]}]})", R"({"a": 1, "b": 1})"));
  EXPECT_FALSE(accepts(R"({"not": {"required": ["a", "b"]}})", R"({"a": 1, "b": 1})"));
  EXPECT_FALSE(accepts(R"({"pattern": "^a+$"})", "\"ab\""));
  EXPECT_THROW(accepts(R"({"contains": {}})", "[]"), std::logic_error);
}

}  // namespace
}  // namespace simulcap
