#include "avatar/avatar_body.h"
#include "avatar/avatar_pose.h"
#include "avatar/geometry/measures.h"
#include "avatar/io/atomic_file.h"
#include "avatar/io/avatar_extras.h"
#include "avatar/io/mesh_file.h"
#include "bullet_ext/bullet_file.h"
#include "src/exporting/export_formats.h"
#include "src/simulation/cloth_setup.h"

#include <Eigen/Geometry>
#include <nlohmann/json.hpp>

#include <cmath>
#include <numbers>
#include <sstream>

namespace simulcap {
namespace {

using avatar::AvatarBody;
using avatar::BodyCapsule;
using avatar::Garment;

constexpr double kFleshDensity = 1000.0;  // [kg/m³], about that of water
constexpr double kLeastMass = 0.01;       // [kg], of links without a capsule

bullet_ext::BulletFileCloth bulletCloth(const Garment& garment) {
  bullet_ext::ClothMeshOptions options;
  options.pins = garment.pins;
  options.edgeStretchStiffness = garment.cloth.edgeStretchStiffness;
  options.hingeTorsionStiffness = garment.cloth.edgeTorsionStiffness;
  options.vertexMasses = garment.cloth.vertexMasses;
  options.vertexOrder = bullet_ext::VertexOrder::kInput;  // the sidecar names vertices
  bullet_ext::BulletFileCloth cloth;
  cloth.name = garment.name;
  cloth.mesh = bullet_ext::buildClothMesh(
      garment.mesh.vertices, garment.mesh.faces, clothMaterial(garment.cloth), options);
  cloth.state = bullet_ext::restState(cloth.mesh);
  return cloth;
}

double volume(const BodyCapsule& capsule) {
  const double r = capsule.radius;
  return std::numbers::pi * r * r * ((capsule.end - capsule.start).norm() + 4.0 / 3.0 * r);
}

std::string triple(const Eigen::Vector3d& v) {
  std::ostringstream text;
  text.precision(9);
  text << v.x() << " " << v.y() << " " << v.z();
  return text.str();
}

std::string number(double value) {
  std::ostringstream text;
  text.precision(9);
  text << value;
  return text.str();
}

/// Roll, pitch, yaw that turn z into a direction: R = Rz(yaw) Ry(pitch).
Eigen::Vector3d anglesOf(const Eigen::Vector3d& direction) {
  const double flat = std::hypot(direction.x(), direction.y());
  return {
      0.0,
      std::atan2(flat, direction.z()),
      flat > 0.0 ? std::atan2(direction.y(), direction.x()) : 0.0};
}

/// Density at which the capsules, which overlap, weigh together what the body does [kg/m³].
double capsuleDensity(const AvatarBody& body) {
  double sum = 0.0;
  for (const BodyCapsule& capsule : body.capsules)
    sum += volume(capsule);
  return sum > 0.0 ? kFleshDensity * avatar::signedVolume(body.mesh) / sum : 0.0;
}

std::string linkOf(const AvatarBody& body, int joint, const std::string& name, double density) {
  std::string collisions;
  double mass = 0.0;
  Eigen::Vector3d moment = Eigen::Vector3d::Zero();
  for (const BodyCapsule& capsule : body.capsules) {
    if (capsule.joint != joint)
      continue;
    const Eigen::Vector3d middle = 0.5 * (capsule.start + capsule.end);
    const Eigen::Vector3d along = capsule.end - capsule.start;
    mass += density * volume(capsule);
    moment += density * volume(capsule) * middle;
    collisions += "    <collision>\n      <origin xyz=\"" + triple(middle) + "\" rpy=\"" +
                  triple(anglesOf(along)) + "\"/>\n      <geometry><capsule radius=\"" +
                  number(capsule.radius) + "\" length=\"" + number(along.norm()) +
                  "\"/></geometry>\n    </collision>\n";
  }
  const Eigen::Vector3d center = mass > 0.0 ? Eigen::Vector3d(moment / mass) : moment;
  mass = std::max(mass, kLeastMass);
  // Of a ball of that mass: enough for a body that is moved, not simulated.
  const double radius = std::cbrt(mass / kFleshDensity * 0.75 / std::numbers::pi);
  const std::string inertia = number(0.4 * mass * radius * radius);
  return "  <link name=\"" + name + "\">\n    <inertial>\n      <origin xyz=\"" + triple(center) +
         "\"/>\n      <mass value=\"" + number(mass) + "\"/>\n      <inertia ixx=\"" + inertia +
         "\" iyy=\"" + inertia + "\" izz=\"" + inertia +
         "\" ixy=\"0\" ixz=\"0\" iyz=\"0\"/>\n    </inertial>\n" + collisions + "  </link>\n";
}

/// The body's capsules on its skeleton at rest, Y up. Bullet's importer knows "spherical" joints.
std::string urdfOf(const AvatarBody& body) {
  const std::vector<std::string> names = avatar::jointNames(static_cast<int>(body.joints.cols()));
  std::string text =
      "<?xml version=\"1.0\"?>\n<!-- T-pose, metres, Y up, facing +Z -->\n"
      "<robot name=\"body\">\n";
  const double density = capsuleDensity(body);
  for (std::size_t j = 0; j < names.size(); ++j)
    text += linkOf(body, static_cast<int>(j), names[j], density);
  for (std::size_t j = 1; j < names.size(); ++j) {
    const auto parent = static_cast<std::size_t>(body.parents[j]);
    const Eigen::Vector3d offset = body.joints.col(static_cast<Eigen::Index>(j)) -
                                   body.joints.col(static_cast<Eigen::Index>(parent));
    text += "  <joint name=\"" + names[parent] + "_" + names[j] +
            "\" type=\"spherical\">\n    <parent link=\"" + names[parent] +
            "\"/>\n    <child link=\"" + names[j] + "\"/>\n    <origin xyz=\"" + triple(offset) +
            "\" rpy=\"0 0 0\"/>\n  </joint>\n";
  }
  return text + "</robot>\n";
}

}  // namespace

std::vector<std::string> exportBullet(const ExportSource& source, const ExportPlace& place) {
  const AvatarBody& body = source.avatar.body;
  std::vector<std::string> files = {
      place.main(".bullet"), place.main(".urdf"), place.main(".json")};
  std::vector<bullet_ext::BulletFileCloth> cloths;
  nlohmann::json garments = nlohmann::json::object();
  for (const Garment& garment : source.avatar.garments) {
    cloths.push_back(bulletCloth(garment));
    garments[garment.name] = avatar::clothExtras(garment);
    files.push_back(place.file(place.stem + "_" + garment.name + ".obj"));
    avatar::writeObj(files.back(), garment.mesh);
  }
  files.push_back(place.file(place.stem + "_body.obj"));
  avatar::TriangleMesh posed = body.mesh;
  if (!source.avatar.garments.empty())
    posed.vertices = avatar::posedVertices(body, source.avatar.garments.front().bindPose);
  avatar::writeObj(files.back(), posed);
  bullet_ext::writeBulletFile(files[0], cloths);
  avatar::writeFileAtomically(files[1], urdfOf(body));
  const nlohmann::json sidecar = {
      {"unit", "m"},
      {"up_axis", "y"},
      {"body", avatar::bodyExtras(body, avatar::filePose(source.avatar))},
      {"garments", garments}};
  avatar::writeFileAtomically(files[2], sidecar.dump(1) + "\n");
  return files;
}

}  // namespace simulcap
