#pragma once

#include "avatar/garment.h"
#include "avatar/geometry/camera.h"
#include "avatar/motion_retarget.h"

#include <Eigen/Geometry>

#include <cstdint>
#include <optional>
#include <string>
#include <variant>
#include <vector>

namespace simulcap {

// What a scene file says, part by part. A part that is empty isn't built. Each member's unit, range
// and meaning is in scene_fields.h, from which the reader, scenes/scene.schema.json and the tables
// of scenes/README.md are made; here stand only the defaults.

/// Length and steps. At most one of `seconds` and `frames`; neither: as long as the body's motion.
struct SceneTime {
  std::optional<double> seconds;  ///< [s]
  std::optional<int> frames;
  double framesPerSecond = 30.0;
  std::optional<int> substeps;  ///< per frame; absent: of 1/3000 s each
};

enum class Integrator { kSemiImplicit, kForwardEuler, kImplicit };

struct SceneBody {
  std::string model = "default";  ///< "default" or a file
  /// Name of a preset of the default body, or shape parameters (the rest is 0).
  std::variant<std::vector<double>, std::string> betas;
  std::vector<std::string> motion;  ///< built-in clips and files, one after the other
  avatar::UpAxis upAxis = avatar::UpAxis::kAuto;
  std::string pose = "apose";  ///< of namedPoses(), when there is no motion
  std::string softTissue;      ///< file of offsets per frame and vertex; or empty
};

/// Where a thing made at the origin stands.
struct Placement {
  Eigen::Vector3d position = Eigen::Vector3d::Zero();         ///< [m]
  Eigen::Vector3d rotationDegrees = Eigen::Vector3d::Zero();  ///< about x, then y, then z

  Eigen::Isometry3d worldFromLocal() const;
};

/// A garment of the wardrobe, cut for the scene's body.
struct TailoredGarment {
  std::string cut;
  std::optional<double> ease;  ///< [m]; absent: the cut's own
  double edgeLength = 0.02;    ///< [m]
};

struct ImportedGarment {
  std::string file;
  double scale = 1.0;  ///< metres per unit of the file
  Placement placement;
};

/// The bottom edge turned about the local y axis, evenly less towards the top.
struct Twist {
  double turns = 0.0;
  double seconds = 0.0;  ///< that the turning takes from the start; 0: the cloth begins twisted
};

/// A rectangle in the local xy plane, centred, facing +z. Narrow ones are ribbons.
struct ClothSheet {
  double width = 1.0;        ///< along x [m]
  double height = 1.0;       ///< along y [m]
  double edgeLength = 0.02;  ///< [m]
  Placement placement;
  std::optional<Twist> twist;
};

/// A cylinder open at both ends about the local y axis, centred.
struct ClothTube {
  double radius = 0.2;       ///< [m]
  double height = 1.0;       ///< along y [m]
  double edgeLength = 0.02;  ///< [m]
  Placement placement;
  std::optional<Twist> twist;
};

struct SceneCloth {
  std::string material = "middle";     ///< of bullet_ext::kPaperMaterials
  avatar::ClothParameters parameters;  ///< the material's, with what the scene overrides
};

/// An edge or corner by name ("top", "top_left"), or a vertex by index.
using Pin = std::variant<int, std::string>;

struct SceneGarment {
  std::string name;  ///< unique; never empty after reading
  std::variant<TailoredGarment, ImportedGarment, ClothSheet, ClothTube> source;
  std::vector<Pin> pins;
  SceneCloth cloth;
};

/// Which contacts are looked for, as far as the scene has both sides.
struct SceneContact {
  bool body = true;
  bool betweenGarments = true;
  bool selfContact = false;
};

struct SceneWind {
  Eigen::Vector3d velocity = Eigen::Vector3d::Zero();  ///< [m/s]
  double airDensity = 1.2;                             ///< [kg/m³], at 20 °C
  double dragCoefficient = 1.2;                        ///< of a plate across the flow
};

struct SphereShape {
  double radius = 0.1;  ///< [m]
};

struct BoxShape {
  Eigen::Vector3d size = {0.2, 0.2, 0.2};  ///< whole extents [m]
};

/// About the local y axis.
struct CapsuleShape {
  double radius = 0.1;  ///< [m]
  double length = 0.2;  ///< between the centres of the round ends [m]
};

/// The half space below the local plane y = 0.
struct PlaneShape {};

/// Moves at constant velocity whatever it meets.
struct KinematicMotion {
  Eigen::Vector3d velocity = Eigen::Vector3d::Zero();         ///< [m/s]
  Eigen::Vector3d angularVelocity = Eigen::Vector3d::Zero();  ///< world axes [rad/s]
};

/// Pushed by gravity, cloth and other bodies.
struct DynamicMotion {
  double mass = 1.0;                                          ///< [kg]
  Eigen::Vector3d velocity = Eigen::Vector3d::Zero();         ///< at the start [m/s]
  Eigen::Vector3d angularVelocity = Eigen::Vector3d::Zero();  ///< at the start, world axes [rad/s]
};

struct StaticMotion {};

struct SceneObstacle {
  std::variant<SphereShape, BoxShape, CapsuleShape, PlaneShape> shape;
  std::variant<StaticMotion, KinematicMotion, DynamicMotion> motion;
  Placement placement;
  double friction = 0.5;
};

struct SceneCamera {
  int width = 640, height = 480;        ///< [px]
  double fx = 525.0;                    ///< [px]
  std::optional<double> fy;             ///< [px]; absent: as fx
  std::optional<double> cx, cy;         ///< [px]; absent: the image's centre
  Eigen::Vector3d position{0, 1, 2.5};  ///< [m]
  Eigen::Vector3d target{0, 1, 0};      ///< [m]
  Eigen::Vector3d up{0, 1, 0};          ///< shown upwards

  avatar::Camera camera() const;
};

enum class SensorModel { kIdeal, kKinectV1, kTimeOfFlight };

struct SceneSensor {
  SensorModel model = SensorModel::kIdeal;
  std::uint32_t seed = 0;
};

struct SceneRoom {
  std::uint32_t seed = 0;
};

/// How the truth of a synthetic capture differs from the person that the scene describes, which is
/// all that a capture may be told.
struct SceneTruth {
  double refinement = 2.1;  ///< edge lengths are divided by this
  double stretch = 1.5;     ///< times stretch_k
  double torsion = 0.2;     ///< times torsion_w
  double mass = 0.6;        ///< times the mass per area
  double friction = 1.5;
  double softTissue = 0.01;    ///< largest offset of the skin [m]
  double settleSeconds = 3.0;  ///< after one, a soft dress still swings
  std::uint32_t seed = 0;
  int backStride = 1;  ///< frames from one picture of the hidden camera to the next
};

struct Scene {
  std::optional<SceneTime> time;  ///< absent: as long as the body's motion, else a still
  Eigen::Vector3d gravity = {0.0, -9.81, 0.0};  ///< [m/s²]
  Integrator integrator = Integrator::kSemiImplicit;
  std::optional<SceneBody> body;
  std::vector<SceneGarment> garments;  ///< inner ones first
  SceneContact contact;
  std::optional<double> strainLimit;  ///< relative to the rest length
  std::optional<SceneWind> wind;
  std::vector<SceneObstacle> obstacles;
  std::optional<SceneCamera> camera;
  std::optional<SceneSensor> sensor;
  std::optional<SceneRoom> room;
  SceneTruth truth;
};

/// One of the paper's materials, bullet_ext::paperMaterial(), as a garment carries it. Throws
/// std::invalid_argument for another name.
avatar::ClothParameters paperCloth(const std::string& material);

/// Substeps of a frame: as given, else of 1/3000 s (the paper's 0.33 ms), at least one.
int substepsPerFrame(const SceneTime& time);

/// Frames of the scene, the start being the first; nothing when the body's motion decides.
std::optional<int> numFrames(const SceneTime& time);

/// What will look for contacts in this scene: asked for, and both sides are there.
SceneContact activeContact(const Scene& scene);

/// The parts that the scene leaves out and a run doesn't build, in plain words, in a fixed order.
std::vector<std::string> leftOut(const Scene& scene);

}  // namespace simulcap
