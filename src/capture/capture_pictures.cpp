#include "src/capture/capture_pictures.h"

#include "avatar/geometry/measures.h"
#include "avatar/geometry/rasterizer.h"

#include <Eigen/Geometry>

#include <algorithm>
#include <cmath>
#include <cstdio>

namespace simulcap {
namespace {

constexpr int kPanelWidth = 240;
constexpr int kPanelHeight = 280;
const Eigen::Vector3d kUnmeasured(0.6, 0.6, 0.6);

Eigen::AlignedBox2d seenBox(const Eigen::Matrix3Xd& vertices, const avatar::Camera& camera) {
  Eigen::AlignedBox2d box;
  for (const auto& vertex : vertices.colwise()) {
    const Eigen::Vector3d pixel = avatar::project(camera, vertex);
    if (pixel.z() > 0.0)
      box.extend(Eigen::Vector2d(pixel.head<2>()));
  }
  return box;
}

/// The camera's picture as the panel's camera would see it; white beyond its edge.
avatar::ColorImage cut(
    const avatar::ColorImage& image, const avatar::Camera& camera, const avatar::Camera& panel) {
  avatar::ColorImage result{panel.width, panel.height, {}};
  result.rgb.assign(static_cast<std::size_t>(3) * panel.width * panel.height, 255);
  const double pixels = camera.fx / panel.fx;
  for (int y = 0; y < panel.height; ++y) {
    const auto v = static_cast<int>(std::lround(camera.cy + (y - panel.cy) * pixels));
    for (int x = 0; x < panel.width; ++x) {
      const auto u = static_cast<int>(std::lround(camera.cx + (x - panel.cx) * pixels));
      if (u < 0 || u >= image.width || v < 0 || v >= image.height)
        continue;
      const auto from = image.rgb.begin() + 3 * (std::ptrdiff_t{image.width} * v + u);
      std::copy(from, from + 3, result.rgb.begin() + 3 * (std::ptrdiff_t{panel.width} * y + x));
    }
  }
  return result;
}

/// The capture over a picture, half transparent.
avatar::ColorImage overlaid(
    avatar::ColorImage picture,
    const std::vector<PicturedMesh>& meshes,
    const avatar::Camera& camera) {
  std::vector<avatar::ShadedMesh> shaded;
  std::vector<avatar::MeshView> surfaces;
  for (const PicturedMesh& mesh : meshes) {
    shaded.push_back(
        {.mesh = mesh.mesh,
         .color = mesh.color,
         .vertexColors = mesh.vertexColors.cols() > 0 ? &mesh.vertexColors : nullptr});
    surfaces.emplace_back(mesh.mesh);
  }
  const avatar::ColorImage over = avatar::shade(shaded, camera);
  const avatar::RasterImage mask = avatar::rasterize(surfaces, camera);
  for (std::size_t i = 0; i < picture.rgb.size(); ++i) {
    if (mask.object[i / 3] >= 0)
      picture.rgb[i] = static_cast<std::uint8_t>((picture.rgb[i] + 2 * over.rgb[i]) / 3);
  }
  return picture;
}

/// `error`: measured less captured depth; 1: coloured fully.
Eigen::Vector3d errorColor(double error) {
  const double share = std::min(1.0, std::abs(error));
  const Eigen::Vector3d color =
      error > 0.0 ? Eigen::Vector3d(0.85, 0.1, 0.1) : Eigen::Vector3d(0.1, 0.25, 0.9);
  return (1.0 - share) * Eigen::Vector3d(0.95, 0.95, 0.95) + share * color;
}

Eigen::Matrix3Xd errorColors(
    const Eigen::Matrix3Xd& vertices,
    const std::vector<float>& depth,
    const avatar::Camera& camera,
    double full) {
  const double gate = 5.0 * full;  // farther away it is something else that was measured [m]
  Eigen::Matrix3Xd colors = kUnmeasured.replicate(1, vertices.cols());
  for (Eigen::Index v = 0; v < vertices.cols(); ++v) {
    const Eigen::Vector3d pixel = avatar::project(camera, vertices.col(v));
    const double x = std::round(pixel.x());
    const double y = std::round(pixel.y());
    if (!(pixel.z() > 0.0 && x >= 0.0 && x < camera.width && y >= 0.0 && y < camera.height))
      continue;
    const auto index = static_cast<std::size_t>(y) * static_cast<std::size_t>(camera.width) +
                       static_cast<std::size_t>(x);
    const auto measured = static_cast<double>(depth[index]);
    if (measured > 0.0 && std::abs(measured - pixel.z()) < gate)
      colors.col(v) = errorColor((measured - pixel.z()) / full);
  }
  return colors;
}

std::string momentLabel(const RgbdFrame& picture) {
  char text[48];
  std::snprintf(text, sizeof text, "%d: %.2f s", picture.index, picture.timestamp);
  return text;
}

std::vector<float> personDepth(const DepthCloud& cloud) {
  std::vector<float> depth = cloud.depth;
  for (std::size_t i = 0; i < depth.size(); ++i)
    depth[i] = cloud.person[i] != 0 ? depth[i] : 0.0F;
  return depth;
}

/// Of one size, each about its person.
std::vector<Eigen::AlignedBox3d> momentBoxes(const std::vector<CaptureMoment>& moments) {
  std::vector<Eigen::AlignedBox3d> boxes;
  Eigen::Vector3d largest = Eigen::Vector3d::Zero();
  for (const CaptureMoment& moment : moments) {
    Eigen::AlignedBox3d box;
    for (const auto& vertex : moment.body.colwise())
      box.extend(Eigen::Vector3d(vertex));
    largest = largest.cwiseMax(box.sizes());
    boxes.push_back(box);
  }
  for (Eigen::AlignedBox3d& box : boxes) {
    const Eigen::Vector3d center = box.center();
    box = {center - 0.5 * largest, center + 0.5 * largest};
  }
  return boxes;
}

}  // namespace

std::vector<PicturedMesh> dressed(
    const avatar::LayeredAvatar& avatar, const CaptureMoment& moment) {
  const avatar::AvatarBody& body = avatar.body;
  std::vector<PicturedMesh> meshes = {
      {{moment.body, body.mesh.faces}, body.color, body.vertexColors}};
  for (std::size_t i = 0; i < moment.garments.size(); ++i) {
    const avatar::Garment& garment = avatar.garments[i];
    meshes.push_back(
        {{moment.garments[i], garment.mesh.faces}, garment.color, garment.vertexColors});
  }
  return meshes;
}

avatar::ColorImage seenPicture(
    const CaptureMoment& moment, const avatar::Camera& camera, const avatar::Camera& panel) {
  return moment.color.rgb.empty()
             ? cut(depthPicture(moment.depth, camera.width, camera.height), camera, panel)
             : cut(moment.color, camera, panel);
}

avatar::ColorImage shapePicture(
    const avatar::LayeredAvatar& avatar, const CaptureMoment& moment, const avatar::Camera& panel) {
  std::vector<avatar::ShadedMesh> meshes = {
      {.mesh = {moment.body, avatar.body.mesh.faces}, .color = avatar.body.color}};
  for (std::size_t i = 0; i < moment.garments.size(); ++i)
    meshes.push_back(
        {.mesh = {moment.garments[i], avatar.garments[i].mesh.faces},
         .color = avatar.garments[i].color});
  return avatar::shade(meshes, panel);
}

avatar::ColorImage overlaidPicture(
    const avatar::LayeredAvatar& avatar,
    const CaptureMoment& moment,
    const avatar::Camera& camera,
    const avatar::Camera& panel) {
  return overlaid(seenPicture(moment, camera, panel), dressed(avatar, moment), panel);
}

CaptureMoment pictureMoment(const TrackedFrame& frame) {
  return {
      momentLabel(frame.picture),
      frame.picture.index,
      frame.picture.color,
      personDepth(frame.observed.cloud),
      {},
      {}};
}

std::vector<avatar::Camera> panelCameras(
    const std::vector<CaptureMoment>& moments,
    const avatar::Camera& camera,
    const std::vector<int>& bodyVertices) {
  constexpr double kMargin = 1.1;
  std::vector<Eigen::AlignedBox2d> boxes;
  Eigen::Vector2d largest(1.0, 1.0);
  for (const CaptureMoment& moment : moments) {
    boxes.push_back(
        bodyVertices.empty() ? seenBox(moment.body, camera)
                             : seenBox(moment.body(Eigen::all, bodyVertices), camera));
    if (!boxes.back().isEmpty())
      largest = largest.cwiseMax(boxes.back().sizes());
  }
  const double scale = std::min(kPanelWidth / largest.x(), kPanelHeight / largest.y()) / kMargin;
  std::vector<avatar::Camera> cameras;
  for (const Eigen::AlignedBox2d& box : boxes) {
    const Eigen::Vector2d centre =
        box.isEmpty() ? Eigen::Vector2d(camera.cx, camera.cy) : box.center();
    avatar::Camera panel = camera;
    panel.width = kPanelWidth;
    panel.height = kPanelHeight;
    panel.fx *= scale;
    panel.fy *= scale;
    panel.cx = (camera.cx - centre.x()) * scale + 0.5 * (kPanelWidth - 1);
    panel.cy = (camera.cy - centre.y()) * scale + 0.5 * (kPanelHeight - 1);
    cameras.push_back(panel);
  }
  return cameras;
}

avatar::ColorImage depthErrorPicture(
    const avatar::LayeredAvatar& avatar,
    const CaptureMoment& moment,
    const avatar::Camera& camera,
    const avatar::Camera& panel,
    double full) {
  std::vector<Eigen::Matrix3Xd> colors;
  for (const Eigen::Matrix3Xd& garment : moment.garments)
    colors.push_back(errorColors(garment, moment.depth, camera, full));
  std::vector<avatar::ShadedMesh> meshes = {
      {.mesh = {moment.body, avatar.body.mesh.faces}, .color = kUnmeasured}};
  for (std::size_t i = 0; i < colors.size(); ++i)
    meshes.push_back(
        {.mesh = {moment.garments[i], avatar.garments[i].mesh.faces}, .vertexColors = &colors[i]});
  return avatar::shade(meshes, panel);
}

avatar::ColorImage measuredPicture(
    const avatar::LayeredAvatar& avatar,
    const CaptureMoment& moment,
    const avatar::Camera& camera,
    const avatar::Camera& panel) {
  constexpr float kReach = 0.15F;  // [m]
  const std::vector<PicturedMesh> meshes = dressed(avatar, moment);
  std::vector<avatar::MeshView> surfaces;
  surfaces.reserve(meshes.size());
  for (const PicturedMesh& mesh : meshes)
    surfaces.emplace_back(mesh.mesh);
  const avatar::RasterImage captured = avatar::rasterize(surfaces, camera);
  std::vector<float> depth = moment.depth;
  for (std::size_t i = 0; i < depth.size(); ++i) {
    if (captured.object[i] < 0 || std::abs(depth[i] - captured.depth[i]) > kReach)
      depth[i] = 0.0F;
  }
  return cut(depthPicture(depth, camera.width, camera.height), camera, panel);
}

avatar::ColorImage depthPicture(const std::vector<float>& depth, int width, int height) {
  float nearest = 1e9F, farthest = 0.0F;
  for (const float z : depth) {
    if (z > 0.0F) {
      nearest = std::min(nearest, z);
      farthest = std::max(farthest, z);
    }
  }
  const float range = std::max(0.01F, farthest - nearest);
  avatar::ColorImage image{width, height, {}};
  image.rgb.reserve(3 * depth.size());
  for (const float z : depth) {
    const float gray = z > 0.0F ? 230.0F - 150.0F * (z - nearest) / range : 255.0F;
    image.rgb.insert(image.rgb.end(), 3, static_cast<std::uint8_t>(gray));
  }
  return image;
}

ContactSheet captureSheet(
    const avatar::LayeredAvatar& avatar,
    const std::vector<CaptureMoment>& moments,
    const avatar::Camera& camera) {
  const std::vector<avatar::Camera> panels = panelCameras(moments, camera);
  const std::vector<Eigen::AlignedBox3d> boxes = momentBoxes(moments);
  std::vector<avatar::ColorImage> seen;
  std::vector<std::vector<PicturedMesh>> captured;
  ContactSheet sheet;
  for (std::size_t i = 0; i < moments.size(); ++i) {
    const CaptureMoment& moment = moments[i];
    sheet.columnLabels.push_back(moment.label);
    seen.push_back(seenPicture(moment, camera, panels[i]));
    captured.push_back(dressed(avatar, moment));
  }
  sheet.rowLabels = {"camera", "capture over it", "depth error", "three-quarter", "back"};
  sheet.panels = seen;
  for (std::size_t i = 0; i < moments.size(); ++i)
    sheet.panels.push_back(overlaid(seen[i], captured[i], panels[i]));
  for (std::size_t i = 0; i < moments.size(); ++i)
    sheet.panels.push_back(depthErrorPicture(avatar, moments[i], camera, panels[i]));
  for (const char* view : {"three-quarter", "back"}) {
    for (std::size_t i = 0; i < moments.size(); ++i)
      sheet.panels.push_back(picture(
          captured[i], bodyView(view), boxes[i], {.width = kPanelWidth, .height = kPanelHeight}));
  }
  return sheet;
}

}  // namespace simulcap
