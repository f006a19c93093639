#include "avatar/io/avatar_extras.h"

#include "avatar/avatar_body.h"
#include "avatar/avatar_pose.h"
#include "avatar/io/file_error.h"

#include <nlohmann/json.hpp>

#include <algorithm>
#include <array>
#include <limits>
#include <utility>

namespace avatar {
namespace {

using nlohmann::json;

constexpr std::array<std::pair<MassMode, const char*>, 2> kMassModes = {
    {{MassMode::kPerVertex, "per_vertex"}, {MassMode::kAreal, "areal"}}};
constexpr std::array<std::pair<DampingMode, const char*>, 2> kDampingModes = {
    {{DampingMode::kPerSecond, "per_second"}, {DampingMode::kPerSubstep, "per_substep"}}};

template <typename Mode>
const char* modeName(const std::array<std::pair<Mode, const char*>, 2>& names, Mode mode) {
  return names[names[0].first == mode ? 0 : 1].second;
}

json numbers(const Eigen::VectorXd& values) {
  return std::vector<double>(values.data(), values.data() + values.size());
}

/// Typed access to a JSON object; every failure names file, node and key.
class ExtrasReader {
 public:
  ExtrasReader(const json& object, ExtrasSource source, std::string path)
      : object_(object), source_(std::move(source)), path_(std::move(path)) {
    if (!object_.is_object()) {
      throw FileError(source_.file, source_.node + ": " + path_, "expected an object");
    }
  }

  [[noreturn]] void fail(const std::string& key, const std::string& problem) const {
    throw FileError(source_.file, source_.node + ": " + path_ + "." + key, problem);
  }

  void requireVersion() const {
    const int version = integer("version");
    if (version != kAvatarExtrasVersion) {
      fail(
          "version",
          "found " + std::to_string(version) + ", this program reads " +
              std::to_string(kAvatarExtrasVersion) + "; update simulcap or write the avatar again");
    }
  }

  bool contains(const std::string& key) const { return object_.contains(key); }

  double number(const std::string& key) const { return asNumber(required(key), key); }

  int integer(const std::string& key) const { return asInteger(required(key), key); }

  std::string text(const std::string& key) const { return asText(required(key), key); }

  Eigen::Vector3d vector(const std::string& key) const {
    const std::vector<double> values = list<double>(key, &ExtrasReader::asNumber);
    if (values.size() != 3) {
      fail(key, "expected three numbers, found " + std::to_string(values.size()));
    }
    return {values[0], values[1], values[2]};
  }

  std::vector<double> numberList(const std::string& key) const {
    return list<double>(key, &ExtrasReader::asNumber);
  }

  Eigen::VectorXd numberVector(const std::string& key) const {
    const std::vector<double> values = numberList(key);
    return Eigen::Map<const Eigen::VectorXd>(
        values.data(), static_cast<Eigen::Index>(values.size()));
  }

  std::vector<int> integerList(const std::string& key) const {
    return list<int>(key, &ExtrasReader::asInteger);
  }

  std::vector<std::string> textList(const std::string& key) const {
    return list<std::string>(key, &ExtrasReader::asText);
  }

  /// The objects of a list, empty when it is absent.
  std::vector<ExtrasReader> objects(const std::string& key) const {
    std::vector<ExtrasReader> readers;
    for (const json& entry : array(key)) {
      const std::string place = path_ + "." + key + "[" + std::to_string(readers.size()) + "]";
      readers.emplace_back(entry, source_, place);
    }
    return readers;
  }

  ExtrasReader object(const std::string& key) const {
    return {required(key), source_, path_ + "." + key};
  }

  /// The members of an object by name, empty when it is absent.
  std::vector<std::string> keysOf(const std::string& key) const {
    std::vector<std::string> keys;
    if (object_.contains(key)) {
      for (const auto& item : object(key).object_.items()) {
        keys.push_back(item.key());
      }
    }
    return keys;
  }

  template <typename Mode>
  Mode mode(
      const std::string& key, const std::array<std::pair<Mode, const char*>, 2>& names) const {
    const std::string name = text(key);
    for (const auto& [mode, known] : names) {
      if (name == known) {
        return mode;
      }
    }
    fail(
        key,
        "found \"" + name + "\", expected \"" + names[0].second + "\" or \"" + names[1].second +
            "\"");
  }

 private:
  const json& required(const std::string& key) const {
    const auto found = object_.find(key);
    if (found == object_.end()) {
      fail(key, "missing; write the avatar again with simulcap");
    }
    return *found;
  }

  const json& array(const std::string& key) const {
    static const json kNone = json::array();
    const auto found = object_.find(key);
    if (found == object_.end()) {
      return kNone;
    }
    if (!found->is_array()) {
      fail(key, "expected a list");
    }
    return *found;
  }

  template <typename T>
  std::vector<T> list(
      const std::string& key,
      T (ExtrasReader::*convert)(const json&, const std::string&) const) const {
    std::vector<T> values;
    for (const json& entry : array(key)) {
      values.push_back((this->*convert)(entry, key));
    }
    return values;
  }

  double asNumber(const json& value, const std::string& key) const {
    if (!value.is_number()) {
      fail(key, "expected numbers, found " + value.dump());
    }
    return value.get<double>();
  }

  int asInteger(const json& value, const std::string& key) const {
    const bool isInteger = value.is_number_integer();
    const double number = isInteger ? value.get<double>() : 0.0;
    if (!isInteger || number < std::numeric_limits<int>::min() ||
        number > std::numeric_limits<int>::max()) {
      fail(key, "expected whole numbers, found " + value.dump());
    }
    return value.get<int>();
  }

  std::string asText(const json& value, const std::string& key) const {
    if (!value.is_string()) {
      fail(key, "expected text, found " + value.dump());
    }
    return value.get<std::string>();
  }

  const json& object_;
  ExtrasSource source_;
  std::string path_;
};

json poseJson(const BodyPose& pose) {
  return {{"rotations", numbers(pose.jointRotations)}, {"translation", numbers(pose.translation)}};
}

BodyPose readPose(const ExtrasReader& reader) {
  BodyPose pose;
  pose.jointRotations = reader.numberVector("rotations");
  pose.translation = reader.vector("translation");
  return pose;
}

ClothParameters readCloth(const ExtrasReader& reader) {
  ClothParameters cloth;
  cloth.stretchStiffness = reader.number("stretch_k");
  cloth.torsionStiffness = reader.number("torsion_w");
  cloth.massMode = reader.mode("mass_mode", kMassModes);
  cloth.vertexMass = reader.number("vertex_mass_kg");
  cloth.arealDensity = reader.number("areal_density_kg_m2");
  cloth.dampingMode = reader.mode("damping_mode", kDampingModes);
  cloth.damping = reader.number("damping");
  cloth.friction = reader.number("friction");
  cloth.thickness = reader.number("thickness_m");
  cloth.edgeStretchStiffness = reader.numberList("edge_stretch_k");
  cloth.edgeTorsionStiffness = reader.numberList("edge_torsion_w");
  cloth.vertexMasses = reader.numberList("vertex_masses_kg");
  return cloth;
}

std::map<std::string, std::map<std::string, double>> readHints(const ExtrasReader& reader) {
  std::map<std::string, std::map<std::string, double>> hints;
  for (const std::string& engine : reader.keysOf("hints")) {
    const ExtrasReader all = reader.object("hints");
    const ExtrasReader values = all.object(engine);
    for (const std::string& key : all.keysOf(engine)) {
      hints[engine][key] = values.number(key);
    }
  }
  return hints;
}

bool readAsWorn(const ExtrasReader& reader) {
  if (!reader.contains("shape"))  // files of before
    return false;
  const std::string shape = reader.text("shape");
  if (shape != "as_worn" && shape != "as_cut")
    reader.fail("shape", "expected \"as_worn\" or \"as_cut\", found \"" + shape + "\"");
  return shape == "as_worn";
}

}  // namespace

BodyPose filePose(const LayeredAvatar& avatar) {
  return avatar.garments.empty() ? BodyPose{} : avatar.garments.front().bindPose;
}

json bodyExtras(const AvatarBody& body, const BodyPose& pose) {
  const std::vector<std::string> names = jointNames(static_cast<int>(body.parents.size()));
  const std::vector<Eigen::Isometry3d> frames = worldFromJoints(body, pose);
  json capsules = json::array();
  for (const BodyCapsule& capsule : body.capsules) {
    const auto joint = static_cast<std::size_t>(capsule.joint);
    capsules.push_back(
        {{"joint", names[joint]},
         {"p0", numbers(frames[joint] * capsule.start)},
         {"p1", numbers(frames[joint] * capsule.end)},
         {"local_p0", numbers(capsule.start)},
         {"local_p1", numbers(capsule.end)},
         {"radius", capsule.radius}});
  }
  return {
      {"version", kAvatarExtrasVersion},
      {"model", body.model},
      {"betas", numbers(body.betas)},
      {"capsules", capsules},
      {"color", numbers(body.color)}};
}

json clothExtras(const Garment& garment) {
  const ClothParameters& cloth = garment.cloth;
  return {
      {"version", kAvatarExtrasVersion},
      {"layer", garment.layer},
      {"stretch_k", cloth.stretchStiffness},
      {"torsion_w", cloth.torsionStiffness},
      {"mass_mode", modeName(kMassModes, cloth.massMode)},
      {"vertex_mass_kg", cloth.vertexMass},
      {"areal_density_kg_m2", cloth.arealDensity},
      {"damping_mode", modeName(kDampingModes, cloth.dampingMode)},
      {"damping", cloth.damping},
      {"friction", cloth.friction},
      {"thickness_m", cloth.thickness},
      {"edge_stretch_k", cloth.edgeStretchStiffness},
      {"edge_torsion_w", cloth.edgeTorsionStiffness},
      {"vertex_masses_kg", cloth.vertexMasses},
      {"shape", garment.asWorn ? "as_worn" : "as_cut"},
      {"pins", garment.pins},
      {"max_distance", numbers(garment.maxDistance)},
      {"collide_with", garment.collideWith},
      {"hints", garment.hints},
      {"bind_pose", poseJson(garment.bindPose)},
      {"color", numbers(garment.color)}};
}

void readBodyExtras(
    const json& extras,
    const ExtrasSource& source,
    const std::vector<std::string>& jointNames,
    AvatarBody& body) {
  const ExtrasReader reader(extras, source, kBodyExtrasKey);
  reader.requireVersion();
  body.model = reader.text("model");
  body.betas = reader.numberVector("betas");
  body.color = reader.vector("color");
  for (const ExtrasReader& entry : reader.objects("capsules")) {
    const std::string name = entry.text("joint");
    const auto joint = std::find(jointNames.begin(), jointNames.end(), name);
    if (joint == jointNames.end()) {
      entry.fail("joint", "no joint of the skeleton is called \"" + name + "\"");
    }
    const bool isLocal = !entry.contains("local_p0");  // of files of before
    body.capsules.push_back(
        {static_cast<int>(joint - jointNames.begin()),
         entry.vector(isLocal ? "p0" : "local_p0"),
         entry.vector(isLocal ? "p1" : "local_p1"),
         entry.number("radius")});
  }
}

void readClothExtras(const json& extras, const ExtrasSource& source, Garment& garment) {
  const ExtrasReader reader(extras, source, kClothExtrasKey);
  reader.requireVersion();
  garment.layer = reader.integer("layer");
  garment.bindPose = readPose(reader.object("bind_pose"));
  garment.cloth = readCloth(reader);
  garment.asWorn = readAsWorn(reader);
  garment.pins = reader.integerList("pins");
  garment.maxDistance = reader.numberVector("max_distance");
  garment.collideWith = reader.textList("collide_with");
  garment.hints = readHints(reader);
  garment.color = reader.vector("color");
}

}  // namespace avatar
