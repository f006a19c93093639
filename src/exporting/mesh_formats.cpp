#include "avatar/avatar_pose.h"
#include "avatar/io/atomic_file.h"
#include "avatar/io/avatar_extras.h"
#include "avatar/io/avatar_file.h"
#include "avatar/io/mesh_file.h"
#include "avatar/io/performance_glb.h"
#include "src/exporting/engine_hints.h"
#include "src/exporting/export_formats.h"
#include "src/output/performance_reader.h"
#include "src/output/point_cache.h"

#include <nlohmann/json.hpp>

#include <algorithm>
#include <cstdio>
#include <memory>

namespace simulcap {
namespace {

using avatar::Garment;
using avatar::LayeredAvatar;

/// Every n-th frame, so that viewers can hold them all.
avatar::Performance viewersPerformance(const ExportSource& source) {
  PerformanceReader reader(*source.performance);
  const auto total = static_cast<std::size_t>(reader.numFrames());
  std::uint64_t bytes = 0;
  for (const Garment& garment : source.avatar.garments)
    bytes += avatar::morphBytes(static_cast<std::uint64_t>(garment.mesh.numVertices()), 1);
  const std::size_t most = std::min<std::size_t>(
      avatar::kMaxPerformanceFrames, avatar::kMaxMorphBytes / std::max<std::uint64_t>(bytes, 1));
  const std::size_t stride = (total + most - 1) / most;
  avatar::Motion motion;
  motion.framesPerSecond = reader.layout().framesPerSecond / static_cast<double>(stride);
  const auto frames = std::make_shared<std::vector<std::vector<Eigen::Matrix3Xf>>>();
  forEachFrame(source, [&](int number, const auto& pose, const auto& garments) {
    if (static_cast<std::size_t>(number) % stride != 0)
      return;
    motion.frames.push_back(pose);
    frames->push_back(garments);
  });
  return avatar::dressedPerformance(
      source.avatar, motion, [frames](std::size_t garment, std::size_t frame) {
        return Eigen::Matrix3Xd((*frames)[frame][garment].cast<double>());
      });
}

LayeredAvatar withHints(LayeredAvatar avatar) {
  for (Garment& garment : avatar.garments)
    garment = withEngineHints(std::move(garment));
  return avatar;
}

/// Bodies and garments, one after the other, as one OBJ has them.
class ObjWriter {
 public:
  ObjWriter(const std::string& path, const std::string& comment) : file_(path) {
    file_.append("# " + comment + "\n");
  }

  void add(
      const std::string& name, const Eigen::Matrix3Xd& vertices, const Eigen::Matrix3Xi& faces) {
    std::string text = "o " + name + "\n";
    char line[128];
    for (Eigen::Index v = 0; v < vertices.cols(); ++v) {
      std::snprintf(
          line, sizeof line, "v %.9g %.9g %.9g\n", vertices(0, v), vertices(1, v), vertices(2, v));
      text += line;
    }
    for (Eigen::Index f = 0; f < faces.cols(); ++f) {
      const Eigen::Vector3i corners = faces.col(f).array() + firstIndex_;
      std::snprintf(line, sizeof line, "f %d %d %d\n", corners[0], corners[1], corners[2]);
      text += line;
    }
    firstIndex_ += static_cast<int>(vertices.cols());
    file_.append(text);
  }

  void finish() { file_.commit(); }

 private:
  avatar::AtomicFileWriter file_;
  int firstIndex_ = 1;
};

void writePosedObj(
    const LayeredAvatar& avatar,
    const std::string& path,
    const avatar::BodyPose& pose,
    const std::vector<Eigen::Matrix3Xd>& garments) {
  ObjWriter obj(path, "metres, Y up");
  obj.add("body", avatar::posedVertices(avatar.body, pose), avatar.body.mesh.faces);
  for (std::size_t g = 0; g < garments.size(); ++g)
    obj.add(avatar.garments[g].name, garments[g], avatar.garments[g].mesh.faces);
  obj.finish();
}

std::string numbered(int frame) {
  char text[24];
  std::snprintf(text, sizeof text, "%06d", frame);
  return text;
}

/// (x, y, z) with Y up as Blender has it.
Eigen::Matrix3Xd zUp(const Eigen::Matrix3Xd& points) {
  Eigen::Matrix3Xd turned(3, points.cols());
  turned.row(0) = points.row(0);
  turned.row(1) = -points.row(2);
  turned.row(2) = points.row(1);
  return turned;
}

std::string writeZUpObj(
    const ExportPlace& place,
    const std::string& name,
    const Eigen::Matrix3Xd& vertices,
    const Eigen::Matrix3Xi& faces) {
  const Eigen::Matrix3Xd turned = zUp(vertices);
  avatar::writeObj(place.file(name + ".obj"), avatar::MeshView(turned, faces));
  return place.file(name + ".obj");
}

}  // namespace

std::vector<std::string> exportGlb(const ExportSource& source, const ExportPlace& place) {
  if (source.performance && !place.isFolder) {
    avatar::writePerformanceGlb(place.main(".glb"), viewersPerformance(source));
    return {place.main(".glb")};
  }
  std::vector<std::string> files = {place.main(".glb")};
  avatar::writeAvatar(files.front(), withHints(source.avatar));
  if (source.performance) {
    files.push_back(place.file("performance.glb"));
    avatar::writePerformanceGlb(files.back(), viewersPerformance(source));
  }
  return files;
}

std::vector<std::string> exportObj(const ExportSource& source, const ExportPlace& place) {
  const LayeredAvatar& avatar = source.avatar;
  const avatar::BodyPose pose = avatar::filePose(avatar);
  std::vector<Eigen::Matrix3Xd> start;
  for (const Garment& garment : avatar.garments)
    start.push_back(avatar::posedVertices(garment, avatar.body, pose));
  std::vector<std::string> files = {place.main(".obj")};
  writePosedObj(avatar, files.front(), pose, start);
  if (!source.performance)
    return files;
  const std::string prefix = place.stem + "_frames/";
  forEachFrame(source, [&](int number, const auto& framePose, const auto& garments) {
    std::vector<Eigen::Matrix3Xd> posed;
    posed.reserve(garments.size());
    for (const Eigen::Matrix3Xf& vertices : garments)
      posed.push_back(vertices.cast<double>());
    files.push_back(place.file(prefix + numbered(number) + ".obj"));
    writePosedObj(avatar, files.back(), framePose, posed);
  });
  return files;
}

std::vector<std::string> exportPc2(const ExportSource& source, const ExportPlace& place) {
  const LayeredAvatar& avatar = source.avatar;
  const double framesPerSecond = PerformanceReader(*source.performance).layout().framesPerSecond;
  std::vector<std::string> names = {"body"};
  std::vector<std::string> files = {
      writeZUpObj(place, "body", avatar.body.mesh.vertices, avatar.body.mesh.faces)};
  for (const Garment& garment : avatar.garments) {
    names.push_back(garment.name);
    files.push_back(writeZUpObj(place, garment.name, garment.mesh.vertices, garment.mesh.faces));
  }
  std::vector<std::unique_ptr<Pc2Writer>> caches;
  for (std::size_t i = 0; i < names.size(); ++i) {
    files.push_back(place.file(names[i] + ".pc2"));
    const Eigen::Index count =
        i == 0 ? avatar.body.mesh.numVertices() : avatar.garments[i - 1].mesh.numVertices();
    caches.push_back(std::make_unique<Pc2Writer>(files.back(), static_cast<int>(count)));
  }
  int numFrames = 0;
  forEachFrame(source, [&](int, const auto& pose, const auto& garments) {
    caches.front()->append(avatar::posedVertices(avatar.body, pose).template cast<float>());
    for (std::size_t g = 0; g < garments.size(); ++g)
      caches[g + 1]->append(garments[g]);
    ++numFrames;
  });
  for (const auto& cache : caches)
    cache->finish();
  files.push_back(place.file("manifest.json"));
  avatar::writeFileAtomically(
      files.back(),
      nlohmann::json({{"frames", numFrames},
                      {"frames_per_second", framesPerSecond},
                      {"unit", "m"},
                      {"up_axis", "z"},
                      {"meshes", names}})
              .dump(1) +
          "\n");
  return files;
}

}  // namespace simulcap
