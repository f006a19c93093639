#include "avatar/avatar_body.h"
#include "avatar/avatar_pose.h"
#include "avatar/io/avatar_extras.h"
#include "avatar/io/avatar_glb.h"
#include "src/exporting/engine_hints.h"
#include "src/exporting/export_formats.h"
#include "src/exporting/usd_writer.h"
#include "src/output/performance_reader.h"

#include <Eigen/Geometry>
#include <nlohmann/json.hpp>

#include <algorithm>
#include <set>
#include <string>
#include <vector>

// USD as text: skeleton and skinned meshes as UsdSkel has them, moving garments as point caches
// (time-sampled points). One SkelRoot holds what is skinned; point caches stand beside it, because
// importers make one skeletal mesh of everything in it.
namespace simulcap {
namespace {

using avatar::AvatarBody;
using avatar::BodyPose;
using avatar::Garment;
using nlohmann::json;
using SkinWeights = Eigen::SparseMatrix<double, Eigen::RowMajor>;

constexpr int kUsdInfluences = 4;
constexpr const char* kSkeletonPath = "</avatar/person/skeleton>";
constexpr const char* kBound = R"(prepend apiSchemas = ["SkelBindingAPI"])";
constexpr const char* kPerVertex = R"(interpolation = "vertex")";

std::string usdTransforms(const std::vector<Eigen::Isometry3d>& transforms) {
  std::string text;
  for (const Eigen::Isometry3d& transform : transforms)
    text.append(text.empty() ? "[" : ", ").append(usdTransform(transform.matrix()));
  return text + "]";
}

/// The type of what stands in a JSON list, or nothing when it can't be told or isn't a scalar.
std::string usdElementType(const json& list) {
  const auto all = [&](auto is) {
    return !list.empty() && std::all_of(list.begin(), list.end(), is);
  };
  if (all([](const json& item) { return item.is_number_integer(); }))
    return "int";
  if (all([](const json& item) { return item.is_number(); }))
    return "double";
  return all([](const json& item) { return item.is_string(); }) ? "string" : "";
}

/// What USD has no schema for, as attributes of our own: the keys of our glTF's extras, a colon
/// for every level. Lists of objects are JSON text.
void writeExtras(UsdWriter& usd, const std::string& name, const json& value) {
  if (value.is_object()) {
    std::set<std::string> taken;
    for (const auto& [key, member] : value.items())
      writeExtras(usd, name + ":" + usdName(key, taken), member);
  } else if (!value.is_array()) {
    usd.line("custom " + usdElementType(json::array({value})) + " " + name + " = " + value.dump());
  } else if (const std::string type = usdElementType(value); !type.empty()) {
    usd.line("custom " + type + "[] " + name + " = " + value.dump());
  } else if (!value.empty()) {
    usd.line("custom string " + name + " = " + json(value.dump()).dump());
  }
}

std::vector<std::string> jointPaths(const AvatarBody& body) {
  std::vector<std::string> paths = avatar::jointNames(static_cast<int>(body.parents.size()));
  for (std::size_t joint = 1; joint < paths.size(); ++joint)
    paths[joint].insert(0, paths[static_cast<std::size_t>(body.parents[joint])] + "/");
  return paths;
}

/// Every joint in its parent's frame.
std::vector<Eigen::Isometry3d> localTransforms(const AvatarBody& body, const BodyPose& pose) {
  const std::vector<Eigen::Isometry3d> world = avatar::worldFromJoints(body, pose);
  std::vector<Eigen::Isometry3d> local = world;
  for (std::size_t joint = 1; joint < local.size(); ++joint)
    local[joint] = world[static_cast<std::size_t>(body.parents[joint])].inverse() * world[joint];
  return local;
}

void writeSkeleton(UsdWriter& usd, const ExportSource& source) {
  const AvatarBody& body = source.avatar.body;
  usd.openPrim("Skeleton", "skeleton", {kBound});
  usd.line("uniform token[] joints = " + json(jointPaths(body)).dump());
  usd.line(
      "uniform matrix4d[] bindTransforms = " + usdTransforms(avatar::worldFromJoints(body, {})));
  usd.line(
      "uniform matrix4d[] restTransforms = " +
      usdTransforms(localTransforms(body, avatar::filePose(source.avatar))));
  if (source.performance)
    usd.line("rel skel:animationSource = </avatar/person/motion>");
  usd.close();
}

void writeMotion(UsdWriter& usd, const ExportSource& source) {
  const AvatarBody& body = source.avatar.body;
  const auto numJoints = static_cast<Eigen::Index>(body.parents.size());
  usd.openPrim("SkelAnimation", "motion");
  usd.line("uniform token[] joints = " + json(jointPaths(body)).dump());
  usd.line(
      "half3[] scales = " + usdColumns(Eigen::Matrix3Xi(Eigen::Matrix3Xi::Ones(3, numJoints))));
  usd.openSamples("quatf[] rotations");
  forEachFrame(source, [&](int number, const BodyPose& pose, const auto&) {
    Eigen::Matrix4Xf rotations(4, numJoints);
    Eigen::Index joint = 0;
    for (const Eigen::Isometry3d& local : localTransforms(body, pose)) {
      const Eigen::Quaternionf q(Eigen::Quaterniond(local.rotation()).cast<float>());
      rotations.col(joint++) << q.w(), q.x(), q.y(), q.z();
    }
    usd.line(usdNumber(number) + ": " + usdColumns(rotations) + ",");
  });
  usd.close();
  usd.openSamples("float3[] translations");
  forEachFrame(source, [&](int number, const BodyPose& pose, const auto&) {
    Eigen::Matrix3Xf translations(3, numJoints);
    Eigen::Index joint = 0;
    for (const Eigen::Isometry3d& local : localTransforms(body, pose))
      translations.col(joint++) = local.translation().cast<float>();
    usd.line(usdNumber(number) + ": " + usdColumns(translations) + ",");
  });
  usd.close();
  usd.close();
}

std::string extentOf(const Eigen::Matrix3Xf& points) {
  Eigen::Matrix<float, 3, 2> extent;
  extent << points.rowwise().minCoeff(), points.rowwise().maxCoeff();
  return usdColumns(extent);
}

/// All of a mesh but where its points are.
void writeTopology(UsdWriter& usd, const Eigen::Matrix3Xi& faces, const avatar::MeshLook& look) {
  usd.line("uniform token subdivisionScheme = \"none\"");
  usd.line(std::string("uniform bool doubleSided = ") + (look.twoSided ? "1" : "0"));
  usd.line(
      "int[] faceVertexCounts = " +
      usdList(std::vector<int>(static_cast<std::size_t>(faces.cols()), 3)));
  usd.line("int[] faceVertexIndices = " + usdList(faces.reshaped()));
  const bool isPainted = look.vertexColors.cols() > 0;
  const Eigen::Matrix3Xd colors = isPainted ? look.vertexColors : Eigen::Matrix3Xd(look.color);
  usd.describe(
      "color3f[] primvars:displayColor = " +
          usdColumns(Eigen::Matrix3Xf(colors.unaryExpr(&avatar::linearFromDisplay).cast<float>())),
      {isPainted ? kPerVertex : R"(interpolation = "constant")"});
}

/// The mesh where the skeleton has its bind transforms: at rest.
void writeSkinned(
    UsdWriter& usd, const avatar::TriangleMesh& meshAtRest, const SkinWeights& weights) {
  const Eigen::Matrix3Xf points = meshAtRest.vertices.cast<float>();
  usd.line("float3[] extent = " + extentOf(points));
  usd.line("point3f[] points = " + usdColumns(points));
  usd.describe("normal3f[] normals = " + usdColumns(avatar::unitNormals(meshAtRest)), {kPerVertex});
  Eigen::MatrixXi joints = Eigen::MatrixXi::Zero(kUsdInfluences, weights.rows());
  Eigen::MatrixXf shares = Eigen::MatrixXf::Zero(kUsdInfluences, weights.rows());
  for (Eigen::Index v = 0; v < weights.rows(); ++v) {
    Eigen::Index place = 0;
    for (SkinWeights::InnerIterator it(weights, v); it && place < kUsdInfluences; ++it, ++place) {
      joints(place, v) = static_cast<int>(it.col());
      shares(place, v) = static_cast<float>(it.value());
    }
  }
  const std::vector<std::string> perVertex = {
      "elementSize = " + usdNumber(kUsdInfluences), kPerVertex};
  usd.describe("int[] primvars:skel:jointIndices = " + usdList(joints.reshaped()), perVertex);
  usd.describe("float[] primvars:skel:jointWeights = " + usdList(shares.reshaped()), perVertex);
  usd.line(
      "matrix4d primvars:skel:geomBindTransform = " + usdTransform(Eigen::Matrix4d::Identity()));
  usd.line(std::string("rel skel:skeleton = ") + kSkeletonPath);
}

void writeBody(UsdWriter& usd, const avatar::LayeredAvatar& avatar) {
  const AvatarBody& body = avatar.body;
  usd.openPrim("Mesh", "body", {kBound});
  writeTopology(usd, body.mesh.faces, {.color = body.color, .vertexColors = body.vertexColors});
  writeSkinned(usd, body.mesh, body.skinningWeights);
  writeExtras(usd, "simulcap:body", avatar::bodyExtras(body, avatar::filePose(avatar)));
  usd.close();
}

void writePointCache(UsdWriter& usd, const ExportSource& source, std::size_t garment) {
  usd.openSamples("point3f[] points");
  std::vector<std::string> extents;
  forEachFrame(source, [&](int number, const BodyPose&, const auto& garments) {
    usd.line(usdNumber(number) + ": " + usdColumns(garments[garment]) + ",");
    extents.push_back(usdNumber(number) + ": " + extentOf(garments[garment]) + ",");
  });
  usd.close();
  usd.openSamples("float3[] extent");
  for (const std::string& extent : extents)
    usd.line(extent);
  usd.close();
}

/// `primvars:rest` is the shape that the cloth has by itself.
void writeGarment(
    UsdWriter& usd, const ExportSource& source, std::size_t number, const std::string& name) {
  const Garment& garment = source.avatar.garments[number];
  const bool isSkinned = !source.performance;
  usd.openPrim("Mesh", name, std::vector<std::string>(isSkinned ? 1 : 0, kBound));
  writeTopology(
      usd,
      garment.mesh.faces,
      {.color = garment.color, .vertexColors = garment.vertexColors, .twoSided = true});
  if (isSkinned)
    writeSkinned(
        usd,
        {avatar::unposedVertices(garment, source.avatar.body), garment.mesh.faces},
        garment.skinningWeights);
  else
    writePointCache(usd, source, number);
  usd.describe(
      "point3f[] primvars:rest = " +
          usdColumns(Eigen::Matrix3Xf(garment.mesh.vertices.cast<float>())),
      {kPerVertex});
  json extras = avatar::clothExtras(withEngineHints(garment));
  extras["name"] = garment.name;
  writeExtras(usd, "simulcap:cloth", extras);
  usd.close();
}

void writeGarments(UsdWriter& usd, const ExportSource& source) {
  std::set<std::string> taken = {"person", "skeleton", "body"};
  for (std::size_t g = 0; g < source.avatar.garments.size(); ++g)
    writeGarment(usd, source, g, usdName(source.avatar.garments[g].name, taken));
}

void writeLayerMetadata(UsdWriter& usd, const ExportSource& source) {
  std::vector<std::string> metadata = {
      R"(defaultPrim = "avatar")", "metersPerUnit = 1", R"(upAxis = "Y")"};
  if (source.performance) {
    const PerformanceReader reader(*source.performance);
    const std::string rate = usdNumber(reader.layout().framesPerSecond);
    metadata.insert(
        metadata.end(),
        {"framesPerSecond = " + rate,
         "timeCodesPerSecond = " + rate,
         "startTimeCode = 0",
         "endTimeCode = " + usdNumber(reader.numFrames() - 1)});
  }
  usd.line("#usda 1.0");
  usd.describe("", metadata);
}

}  // namespace

std::vector<std::string> exportUsd(const ExportSource& source, const ExportPlace& place) {
  UsdWriter usd(place.main(".usda"));
  writeLayerMetadata(usd, source);
  usd.openPrim("Xform", "avatar");
  usd.openPrim("SkelRoot", "person");
  writeSkeleton(usd, source);
  if (source.performance)
    writeMotion(usd, source);
  writeBody(usd, source.avatar);
  if (!source.performance)
    writeGarments(usd, source);
  usd.close();
  if (source.performance)
    writeGarments(usd, source);
  usd.close();
  usd.finish();
  return {place.main(".usda")};
}

}  // namespace simulcap
