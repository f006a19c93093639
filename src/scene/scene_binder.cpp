#include "src/scene/scene_binder.h"

#include "src/scene/scene_fields.h"

#include <nlohmann/json.hpp>

#include <type_traits>

namespace simulcap {
namespace {

using Json = nlohmann::json;

/// Visitor of scene_fields.h: gives a part's members the values that its object has. The document
/// fits the table, so that every value has the type its member wants.
class Binder {
 public:
  explicit Binder(const Json& object) : object_(object) {}

  void record(const std::string&, const std::string&) {}

  void atMostOneOf(const std::vector<std::string>&) {}

  template <class Member>
  void field(const std::string& key, Member& member, const FieldText&) {
    if (const auto value = object_.find(key); value != object_.end())
      assign(*value, member);
  }

  template <class... Parts>
  void oneOf(
      std::variant<Parts...>& member,
      const std::array<Alternative, sizeof...(Parts)>& alternatives) {
    std::size_t index = 0;
    (bindAlternative<Parts>(alternatives[index++].key, member), ...);
  }

 private:
  template <class Part, class Variant>
  void bindAlternative(const std::string& key, Variant& member) {
    if constexpr (!std::is_same_v<Part, StaticMotion>) {
      if (const auto value = object_.find(key); value != object_.end())
        assign(*value, member.template emplace<Part>());
    }
  }

  static void assign(const Json& value, bool& member) { member = value.get<bool>(); }

  static void assign(const Json& value, double& member) { member = value.get<double>(); }

  // Whole numbers may be written 3.0 or 3e2.
  static void assign(const Json& value, int& member) {
    member = static_cast<int>(value.get<double>());
  }

  static void assign(const Json& value, std::uint32_t& member) {
    member = static_cast<std::uint32_t>(value.get<double>());
  }

  static void assign(const Json& value, std::string& member) { member = value.get<std::string>(); }

  static void assign(const Json& value, Eigen::Vector3d& member) {
    for (int i = 0; i < 3; ++i)
      member[i] = value[static_cast<std::size_t>(i)].get<double>();
  }

  /// A word in a number's place ("auto") stands for its absence.
  static void assign(const Json& value, std::optional<int>& member) {
    if (value.is_number())
      assign(value, member.emplace());
  }

  static void assign(const Json& value, std::vector<std::string>& member) {
    if (value.is_string())
      member = {value.get<std::string>()};
    else
      member = value.get<std::vector<std::string>>();
  }

  static void assign(const Json& value, std::variant<std::vector<double>, std::string>& member) {
    if (value.is_string())
      member = value.get<std::string>();
    else
      member = value.get<std::vector<double>>();
  }

  static void assign(const Json& value, Pin& member) {
    if (value.is_string())
      assign(value, member.emplace<std::string>());
    else
      assign(value, member.emplace<int>());
  }

  template <class Value>
  static void assign(const Json& value, std::optional<Value>& member) {
    assign(value, member.emplace());
  }

  template <class Value>
  static void assign(const Json& value, std::vector<Value>& member) {
    for (const Json& item : value)
      assign(item, member.emplace_back());
  }

  /// Enumerations and parts.
  template <class Value>
  static void assign(const Json& value, Value& member) {
    if constexpr (std::is_enum_v<Value>) {
      for (const auto& [name, choice] : choiceNames(member)) {
        if (name == value.get_ref<const std::string&>())
          member = choice;
      }
    } else {
      Binder part(value);
      describe(part, member);
    }
  }

  const Json& object_;
};

}  // namespace

Scene sceneFromJson(const Json& document) {
  Scene scene;
  Binder binder(document);
  describe(binder, scene);
  return scene;
}

}  // namespace simulcap
