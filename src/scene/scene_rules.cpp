#include "src/scene/scene_rules.h"

#include "avatar/motion_clips.h"
#include "src/scene/nearest_name.h"
#include "src/scene/scene_json.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <set>

namespace simulcap {
namespace {

namespace fs = std::filesystem;

/// The file's name as the program can open it. Throws when there is no such file.
std::string resolved(const std::string& file, const fs::path& folder, const std::string& where) {
  const fs::path path = (folder / file).lexically_normal();
  std::error_code ignored;
  if (!fs::is_regular_file(path, ignored))
    throw SceneProblem(
        where,
        "there is no file " + path.string() +
            "; names of files are relative to the folder of the scene");
  return path.string();
}

std::string resolvedMotion(
    const std::string& name, const fs::path& folder, const std::string& where) {
  if (avatar::namedClip(name))
    return name;
  const std::string extension = fs::path(name).extension().string();
  if (extension == ".npz" || extension == ".bvh")
    return resolved(name, folder, where);
  const std::vector<std::string> clips(avatar::clipNames().begin(), avatar::clipNames().end());
  std::string known;
  for (const std::string& clip : clips)
    known += clip + ", ";
  throw SceneProblem(
      where,
      "expected a clip (" + known +
          "or with its seconds, as turn:3.2; else a .npz or .bvh file); found \"" + name + "\"" +
          didYouMean(name, clips));
}

void applyBodyRules(SceneBody& body, const fs::path& folder) {
  if (body.model != "default") {
    body.model = resolved(body.model, folder, "body.model");
    if (std::holds_alternative<std::string>(body.betas))
      throw SceneProblem(
          "body.betas", "presets belong to the default body; give this model a list of numbers");
  }
  for (std::size_t i = 0; i < body.motion.size(); ++i)
    body.motion[i] = resolvedMotion(
        body.motion[i],
        folder,
        body.motion.size() == 1 ? "body.motion" : indexPath("body.motion", i));
  if (!body.softTissue.empty())
    body.softTissue = resolved(body.softTissue, folder, "body.soft_tissue");
}

/// Name of a garment that has none of its own. A file's name may hold characters that a name of
/// results may not.
std::string defaultName(const SceneGarment& garment) {
  if (const auto* tailored = std::get_if<TailoredGarment>(&garment.source))
    return tailored->cut;
  if (const auto* imported = std::get_if<ImportedGarment>(&garment.source)) {
    constexpr std::size_t kLongest = 64;
    std::string name = fs::path(imported->file).stem().string().substr(0, kLongest);
    const auto allowed = [](char c) {
      return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') ||
             c == '_' || c == '-';
    };
    std::replace_if(
        name.begin(), name.end(), [&](char c) { return !allowed(c); }, '_');
    return name;
  }
  return std::holds_alternative<ClothSheet>(garment.source) ? "sheet" : "tube";
}

/// Area and edge length are one's own to choose, but not beyond what a computer holds: a triangle
/// mesh with edges h has about one vertex per (√3/2)·h².
void requireReasonableMesh(double area, double edgeLength, const std::string& where) {
  constexpr double kMaxVertices = 1e6;
  const double numVertices = area / (0.5 * std::numbers::sqrt3 * edgeLength * edgeLength);
  if (numVertices > kMaxVertices)
    throw SceneProblem(
        joinPath(where, "edge_length"),
        "makes about " + std::to_string(std::llround(numVertices)) +
            " vertices; at most 1000000 are possible, choose longer edges");
}

bool isPinned(const SceneGarment& garment, const std::string& name) {
  return std::find(garment.pins.begin(), garment.pins.end(), Pin(name)) != garment.pins.end();
}

void requireDrivable(
    const std::optional<Twist>& twist, const SceneGarment& garment, const std::string& where) {
  if (twist && twist->seconds > 0.0 && !isPinned(garment, "bottom"))
    throw SceneProblem(
        joinPath(where, "twist"),
        "turns the bottom edge over time, which must be pinned for that: add \"bottom\" to pins");
}

void checkPinNames(const SceneGarment& garment, const std::string& where) {
  if (std::holds_alternative<ClothSheet>(garment.source))
    return;
  const bool tube = std::holds_alternative<ClothTube>(garment.source);
  for (std::size_t i = 0; i < garment.pins.size(); ++i) {
    const auto* name = std::get_if<std::string>(&garment.pins[i]);
    if (name != nullptr && !(tube && (*name == "top" || *name == "bottom")))
      throw SceneProblem(
          indexPath(joinPath(where, "pins"), i),
          tube ? "a tube has the edges top and bottom; found " + *name
               : "only a sheet or tube has named edges; give indices of vertices");
  }
}

void checkDamping(const SceneGarment& garment, const std::string& where) {
  const avatar::ClothParameters& cloth = garment.cloth.parameters;
  if (cloth.dampingMode == avatar::DampingMode::kPerSubstep && cloth.damping > 1.0)
    throw SceneProblem(where + ".cloth.damping", "is at most 1 in damping_mode per_substep");
}

class SourceRules {
 public:
  SourceRules(const Scene& scene, const SceneGarment& garment, const fs::path& folder)
      : scene_(scene), garment_(garment), folder_(folder) {}

  void apply(TailoredGarment&, const std::string& where) const {
    if (!scene_.body)
      throw SceneProblem(joinPath(where, "wear"), "is cut for a body; name a body in the scene");
  }

  void apply(ImportedGarment& mesh, const std::string& where) const {
    mesh.file = resolved(mesh.file, folder_, joinPath(where, "mesh.file"));
  }

  void apply(ClothSheet& sheet, const std::string& where) const {
    const std::string path = joinPath(where, "sheet");
    requireReasonableMesh(sheet.width * sheet.height, sheet.edgeLength, path);
    requireDrivable(sheet.twist, garment_, path);
  }

  void apply(ClothTube& tube, const std::string& where) const {
    const std::string path = joinPath(where, "tube");
    const double area = 2.0 * std::numbers::pi * tube.radius * tube.height;
    requireReasonableMesh(area, tube.edgeLength, path);
    requireDrivable(tube.twist, garment_, path);
  }

 private:
  const Scene& scene_;
  const SceneGarment& garment_;
  const fs::path& folder_;
};

void applyGarmentRules(Scene& scene, const fs::path& folder) {
  std::set<std::string> names;
  for (std::size_t i = 0; i < scene.garments.size(); ++i) {
    SceneGarment& garment = scene.garments[i];
    const std::string where = indexPath("garments", i);
    if (garment.name.empty())
      garment.name = defaultName(garment);
    if (garment.name == "body")
      throw SceneProblem(joinPath(where, "name"), "body is the person's own name; choose another");
    if (!names.insert(garment.name).second)
      throw SceneProblem(
          joinPath(where, "name"),
          "another garment is called " + garment.name + "; give this one a name of its own");
    const SourceRules rules(scene, garment, folder);
    std::visit([&](auto& source) { rules.apply(source, where); }, garment.source);
    checkPinNames(garment, where);
    checkDamping(garment, where);
  }
}

void checkObstacles(const Scene& scene) {
  for (std::size_t i = 0; i < scene.obstacles.size(); ++i) {
    const SceneObstacle& obstacle = scene.obstacles[i];
    if (std::holds_alternative<PlaneShape>(obstacle.shape) &&
        !std::holds_alternative<StaticMotion>(obstacle.motion))
      throw SceneProblem(
          indexPath("obstacles", i), "a plane can't be moved; use a box, or leave the motion out");
  }
}

void checkCamera(const SceneCamera& camera) {
  const Eigen::Vector3d view = camera.target - camera.position;
  if (view.norm() < 1e-6)
    throw SceneProblem("camera.look_at", "is the camera's own position; choose another point");
  // Within half a thousandth of a radian of the view, "up" says nothing that can be trusted.
  const double up = camera.up.norm();
  if (up < 1e-6 || view.cross(camera.up).norm() < 5e-4 * view.norm() * up)
    throw SceneProblem(
        "camera.up", "is zero or along the view; choose a direction that is up in the image");
}

void checkTime(const Scene& scene) {
  const bool moves = scene.body && !scene.body->motion.empty();
  if (scene.time && !scene.time->seconds && !scene.time->frames && !moves)
    throw SceneProblem(
        "time.seconds", "is missing, and there is no motion to end with; give seconds or frames");
}

}  // namespace

void applySceneRules(Scene& scene, const fs::path& folder) {
  checkTime(scene);
  if (scene.body)
    applyBodyRules(*scene.body, folder);
  applyGarmentRules(scene, folder);
  checkObstacles(scene);
  if (scene.camera)
    checkCamera(*scene.camera);
}

}  // namespace simulcap
