#include "src/digitization/parsing_description.h"

#include "avatar/io/file_error.h"

#include <nlohmann/json.hpp>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <initializer_list>
#include <utility>

namespace simulcap {
namespace {

using Json = nlohmann::json;

struct ClassName {
  const char* name;
  ParsingClass what;
};

/// In LIP's order. What is worn on head, hands and feet goes with the body.
constexpr std::array<ClassName, 20> kLipClasses = {{
    {"background", kNoClass},  {"hat", kSkinClass},           {"hair", kSkinClass},
    {"glove", kSkinClass},     {"sunglasses", kSkinClass},    {"upper-clothes", kUpperClass},
    {"dress", kOnePieceClass}, {"coat", kUpperClass},         {"socks", kSkinClass},
    {"pants", kLowerClass},    {"jumpsuits", kOnePieceClass}, {"scarf", kUpperClass},
    {"skirt", kLowerClass},    {"face", kSkinClass},          {"left-arm", kSkinClass},
    {"right-arm", kSkinClass}, {"left-leg", kSkinClass},      {"right-leg", kSkinClass},
    {"left-shoe", kSkinClass}, {"right-shoe", kSkinClass},
}};

/// What networks with classes of their own may call them besides.
constexpr std::array<ClassName, 4> kOurClasses = {
    {{"skin", kSkinClass},
     {"upper", kUpperClass},
     {"lower", kLowerClass},
     {"one-piece", kOnePieceClass}}};

class DescriptionReader {
 public:
  DescriptionReader(std::string path, Json document)
      : path_(std::move(path)), document_(std::move(document)) {}

  ParsingDescription read(ParsingDescription description) const {
    requireKnownKeys();
    description.width = size("width", description.width);
    description.height = size("height", description.height);
    description.mean = channels("mean", description.mean);
    description.scale = channels("scale", description.scale);
    description.rgb = choice("order", {"bgr", "rgb"}, description.rgb);
    description.keepAspect = choice("fit", {"stretch", "pad"}, description.keepAspect);
    if (document_.contains("classes"))
      description.classes = classes();
    return description;
  }

 private:
  [[noreturn]] void fail(const std::string& key, const std::string& problem) const {
    throw avatar::FileError(path_, key, problem);
  }

  void requireKnownKeys() const {
    constexpr std::array kKeys = {"width", "height", "mean", "scale", "order", "fit", "classes"};
    for (const auto& entry : document_.items()) {
      if (std::find(kKeys.begin(), kKeys.end(), entry.key()) == kKeys.end())
        fail(entry.key(), "unknown; known: width, height, mean, scale, order, fit, classes");
    }
  }

  int size(const char* key, int fallback) const {
    if (!document_.contains(key))
      return fallback;
    const Json& value = document_[key];
    constexpr double kLeast = 8.0;
    constexpr double kMost = 4096.0;
    const double number = value.is_number_integer() ? value.get<double>() : 0.0;
    if (!(number >= kLeast && number <= kMost))
      fail(key, "is " + value.dump() + ", expected the network's input in pixels, 8 to 4096");
    return static_cast<int>(number);
  }

  std::array<double, 3> channels(const char* key, const std::array<double, 3>& fallback) const {
    if (!document_.contains(key))
      return fallback;
    const Json& value = document_[key];
    const auto isNumber = [](const Json& v) {
      return v.is_number() && std::abs(v.get<double>()) < 1e6;
    };
    if (!value.is_array() || value.size() != 3 ||
        !std::all_of(value.begin(), value.end(), isNumber))
      fail(key, "expected three numbers, one per channel in the order of \"order\"");
    return value.get<std::array<double, 3>>();
  }

  /// Is it the second of two words?
  bool choice(const char* key, const std::array<const char*, 2>& words, bool fallback) const {
    if (!document_.contains(key))
      return fallback;
    const Json& value = document_[key];
    if (value == words[0] || value == words[1])
      return value == words[1];
    fail(key, "is " + value.dump() + ", expected \"" + words[0] + "\" or \"" + words[1] + "\"");
  }

  std::vector<ParsingClass> classes() const {
    const Json& names = document_["classes"];
    constexpr std::size_t kMost = 256;
    if (!names.is_array() || names.empty() || names.size() > kMost)
      fail("classes", "expected the names of the output's channels in their order");
    std::vector<ParsingClass> result;
    result.reserve(names.size());
    for (const Json& name : names)
      result.push_back(classNamed(name));
    return result;
  }

  ParsingClass classNamed(const Json& name) const {
    for (const ClassName& known : kLipClasses) {
      if (name == known.name)
        return known.what;
    }
    for (const ClassName& known : kOurClasses) {
      if (name == known.name)
        return known.what;
    }
    std::string all;
    for (const ClassName& known : kLipClasses)
      all += std::string(known.name) + ", ";
    fail(
        "classes",
        "unknown class " + name.dump() + "; known: " + all + "skin, upper, lower, one-piece");
  }

  std::string path_;
  Json document_;
};

}  // namespace

ParsingDescription parsingDescription(const std::string& model) {
  ParsingDescription description;
  for (const ClassName& known : kLipClasses)
    description.classes.push_back(known.what);
  const std::string path = std::filesystem::path(model).replace_extension(".json").string();
  std::ifstream file(path);
  if (!file)
    return description;
  Json document = Json::parse(file, nullptr, false);
  if (!document.is_object())
    throw avatar::FileError(path, "", "is no JSON object: it describes the network beside it");
  return DescriptionReader(path, std::move(document)).read(std::move(description));
}

}  // namespace simulcap
