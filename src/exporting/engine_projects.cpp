#include "avatar/geometry/mesh.h"
#include "avatar/io/atomic_file.h"
#include "avatar/io/avatar_extras.h"
#include "avatar/io/mesh_file.h"
#include "src/exporting/engine_hints.h"
#include "src/exporting/export_formats.h"
#include "src/exporting/templates.h"

#include <nlohmann/json.hpp>

#include <algorithm>

namespace simulcap {
namespace {

using avatar::Garment;
using avatar::LayeredAvatar;
using nlohmann::json;

json bodyParameters(const LayeredAvatar& avatar) {
  return avatar::bodyExtras(avatar.body, avatar::filePose(avatar));
}

/// {body, garments by name}: the extras of the avatar's nodes with suggestions for every engine.
json allParameters(const LayeredAvatar& avatar) {
  json garments = json::object();
  for (const Garment& garment : avatar.garments)
    garments[garment.name] = avatar::clothExtras(withEngineHints(garment));
  return {{"body", bodyParameters(avatar)}, {"garments", garments}};
}

/// As JsonUtility of Unity reads it: fields of classes, no dictionaries.
json unityParameters(const LayeredAvatar& avatar) {
  json garments = json::array();
  for (const Garment& bare : avatar.garments) {
    const Garment garment = withEngineHints(bare);
    json entry = garment.hints.at("unity");
    entry["name"] = garment.name;
    entry["pins"] = garment.pins;
    entry["maxDistance"] =
        std::vector<double>(garment.maxDistance.begin(), garment.maxDistance.end());
    garments.push_back(entry);
  }
  return {{"capsules", bodyParameters(avatar)["capsules"]}, {"garments", garments}};
}

/// [m] Y up to [cm] Z up, left-handed, as Unreal has it: y mirrored.
Eigen::Matrix3Xd unrealPoints(const Eigen::Matrix3Xd& points) {
  Eigen::Matrix3Xd turned(3, points.cols());
  turned.row(0) = 100.0 * points.row(0);
  turned.row(1) = 100.0 * points.row(2);
  turned.row(2) = 100.0 * points.row(1);
  return turned;
}

/// Of each vertex [cm]; 0 at pins.
Eigen::VectorXd maxDistanceOf(const Garment& garment) {
  constexpr double kFree = 100.0;  // [cm], for garments that name none
  Eigen::VectorXd distance = garment.maxDistance.size() > 0
                                 ? Eigen::VectorXd(100.0 * garment.maxDistance)
                                 : Eigen::VectorXd::Constant(garment.mesh.numVertices(), kFree);
  for (const int pin : garment.pins)
    distance[pin] = 0.0;
  return distance;
}

std::string writeUnrealGarment(const Garment& garment, const ExportPlace& place, json& entry) {
  const Eigen::VectorXd distance = maxDistanceOf(garment);
  entry["max_distance_cm"] = std::vector<double>(distance.begin(), distance.end());
  avatar::TriangleMesh mesh = {unrealPoints(garment.mesh.vertices), garment.mesh.faces};
  Eigen::Matrix3Xd colors = Eigen::Matrix3Xd::Zero(3, distance.size());
  colors.row(0) = distance.transpose() / std::max(distance.maxCoeff(), 1e-9);
  avatar::writeObj(place.file(garment.name + ".obj"), mesh, colors);
  return place.file(garment.name + ".obj");
}

void scalePoints(json& capsules, double factor) {
  for (json& capsule : capsules) {
    for (const char* end : {"p0", "p1", "local_p0", "local_p1"})
      for (json& value : capsule[end])
        value = factor * value.get<double>();
    capsule["radius"] = factor * capsule["radius"].get<double>();
  }
}

std::string writeText(const ExportPlace& place, const std::string& name, const std::string& text) {
  avatar::writeFileAtomically(place.file(name), text);
  return place.file(name);
}

}  // namespace

std::vector<std::string> exportGodot(const ExportSource& source, const ExportPlace& place) {
  std::vector<std::string> files =
      exportGlb({.avatar = source.avatar, .performance = std::nullopt}, place);
  files.push_back(writeText(place, "parameters.json", allParameters(source.avatar).dump(1) + "\n"));
  files.push_back(writeText(place, "dressed_avatar.gd", templates::kGodotScript));
  files.push_back(writeText(place, "main.tscn", templates::kGodotScene));
  files.push_back(writeText(place, "project.godot", templates::kGodotProject));
  return files;
}

std::vector<std::string> exportUnity(const ExportSource& source, const ExportPlace& place) {
  std::vector<std::string> files = exportGlb(source, place);
  files.push_back(
      writeText(place, "simulcap_unity.json", unityParameters(source.avatar).dump(1) + "\n"));
  files.push_back(writeText(place, "Editor/SimulcapCloth.cs", templates::kUnityScript));
  return files;
}

std::vector<std::string> exportUnreal(const ExportSource& source, const ExportPlace& place) {
  std::vector<std::string> files = exportGlb(source, place);
  json parameters = allParameters(source.avatar);
  scalePoints(parameters["body"]["capsules"], 100.0);
  for (const Garment& garment : source.avatar.garments)
    files.push_back(writeUnrealGarment(garment, place, parameters["garments"][garment.name]));
  files.push_back(writeText(place, "unreal.json", parameters.dump(1) + "\n"));
  files.push_back(writeText(place, "README.txt", templates::kUnrealReadme));
  return files;
}

}  // namespace simulcap
