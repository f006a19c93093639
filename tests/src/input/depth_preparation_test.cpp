#include "src/input/depth_preparation.h"

#include "src/input/scene_planes.h"
#include "tests/src/input/synthetic_room.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <stdexcept>

namespace simulcap {
namespace {

using test::maskIou;
using test::picture;
using test::Room;
using test::roomCamera;

constexpr double kDegree = 0.017453292519943295;

avatar::BodyPose standing() {
  return avatar::makeClip("turn").frames.front();
}

Room roomWithPerson(double wall = -1.5) {
  Room room{.camera = roomCamera()};
  room.addFloor();
  room.addWall(wall);
  room.addPerson(standing(), Eigen::Vector3d::Zero());
  return room;
}

double angleBetween(const Eigen::Vector3d& a, const Eigen::Vector3d& b) {
  return std::atan2(a.cross(b).norm(), a.dot(b));
}

Eigen::Vector3d upOf(const CaptureFrame& frame) {
  return frame.cameraFromWorld.linear().col(1);
}

// Masks lose what a noisy edge can't show: a pixel along the outline, and soles within the floor's
// noise. The outline of a standing person at 320 x 240 has about 700 pixels, the inside 9000.
constexpr double kMinIou = 0.93;

TEST(DepthPreparation, TellsThePersonFromFloorAndWall) {
  const Room room = roomWithPerson();
  const auto seen = picture(room);
  DepthPreparation prepare(room.camera);
  const DepthCloud cloud = prepare(seen.frame);
  EXPECT_GT(maskIou(seen, cloud.person), kMinIou);
  for (std::size_t i = 0; i < cloud.person.size(); ++i) {
    if (cloud.person[i] != 0)
      ASSERT_GT(cloud.depth[i], 0.0F) << "the person is where something was measured";
    else
      ASSERT_EQ(cloud.points.col(i).norm() + cloud.normals.col(i).norm(), 0.0F);
  }
}

TEST(DepthPreparation, KeepsTheFeet) {
  const Room room = roomWithPerson();
  const auto seen = picture(room);
  const DepthCloud cloud = DepthPreparation(room.camera)(seen.frame);
  double all = 0.0;
  double kept = 0.0;
  for (int y = 0; y < cloud.height; ++y) {
    for (int x = 0; x < cloud.width; ++x) {
      const std::size_t i = cloud.index(x, y);
      if (!seen.is(i, test::kPerson) || seen.frame.depth[i] <= 0.0F)
        continue;
      const double z = static_cast<double>(seen.truth.depth[i]);
      const double height =
          unproject(room.camera, {static_cast<double>(x), static_cast<double>(y), z}).y();
      if (height < 0.04 || height > 0.12)
        continue;
      all += 1.0;
      kept += cloud.person[i] != 0 ? 1.0 : 0.0;
    }
  }
  ASSERT_GT(all, 50.0);
  EXPECT_GT(kept / all, 0.85);
}

TEST(DepthPreparation, FindsTheFloorWithinADegreeFromATiltedCamera) {
  for (const double roll : {-0.2, 0.0, 0.15}) {
    Room room = roomWithPerson();
    room.camera.cameraFromWorld = Eigen::AngleAxisd(roll, Eigen::Vector3d::UnitZ()) *
                                  avatar::lookAt({0.3, 1.6, 2.4}, {0.0, 0.8, 0.0});
    DepthPreparation prepare(room.camera);
    prepare(picture(room).frame);
    ASSERT_TRUE(prepare.captureFrame());
    const CaptureFrame frame = *prepare.captureFrame();
    EXPECT_TRUE(frame.floorSeen);
    EXPECT_EQ(frame.upSource, UpSource::kFloor);
    const Eigen::Vector3d up = room.camera.cameraFromWorld.linear().col(1);
    EXPECT_LT(angleBetween(upOf(frame), up), 1.0 * kDegree) << roll;
    const Eigen::Vector3d eye = frame.cameraFromWorld.inverse().translation();
    EXPECT_NEAR(eye.y(), 1.6, 0.02) << "camera height: the floor's fit through noise";
  }
}

/// Adds a level patch of floor at a height above the camera [m].
void addPatch(ScenePoints& scene, float height, float nearZ, float farZ) {
  constexpr float kStep = 0.05F;
  constexpr float kHalfWidth = 1.0F;
  const auto columns = static_cast<Eigen::Index>(2.0F * kHalfWidth / kStep);
  const auto rows = static_cast<Eigen::Index>(std::lround((farZ - nearZ) / kStep));
  const Eigen::Index first = scene.points.cols();
  scene.points.conservativeResize(3, first + columns * rows);
  for (Eigen::Index i = 0; i < columns * rows; ++i)
    scene.points.col(first + i) << -kHalfWidth + kStep * static_cast<float>(i % columns), -height,
        nearZ + kStep * static_cast<float>(i / columns);
  scene.normals = Eigen::Vector3f(0.0F, -1.0F, 0.0F).replicate(1, scene.points.cols());
  scene.areas = Eigen::VectorXf::Constant(scene.points.cols(), kStep * kStep);
}

// A time-of-flight camera sees floors bent: their far parts some centimetres too low.
TEST(SceneFloor, IsWhereItsLargerPartIs) {
  ScenePoints scene{Eigen::Matrix3Xf(3, 0), {}, {}};
  addPatch(scene, -0.7F, 1.5F, 3.5F);
  addPatch(scene, -0.8F, 3.9F, 4.05F);
  const auto floor = findFloor(scene);
  ASSERT_TRUE(floor);
  EXPECT_NEAR(floor->offset, 0.7F, 0.01F);
}

TEST(SceneFloor, LiesBeneathATable) {
  ScenePoints scene{Eigen::Matrix3Xf(3, 0), {}, {}};
  addPatch(scene, -0.7F, 1.5F, 3.5F);
  addPatch(scene, -1.4F, 3.9F, 4.05F);
  const auto floor = findFloor(scene);
  ASSERT_TRUE(floor);
  EXPECT_NEAR(floor->offset, 1.4F, 0.01F);
}

TEST(DepthPreparation, TheWorldStandsUnderThePersonAndLooksAlongMinusZ) {
  const Room room = roomWithPerson();
  DepthPreparation prepare(room.camera);
  prepare(picture(room).frame);
  const Eigen::Isometry3d cameraFromCapture = prepare.captureFrame()->cameraFromWorld;
  const Eigen::Isometry3d roomFromCapture =
      room.camera.cameraFromWorld.inverse() * cameraFromCapture;
  // Half a torso's depth is a guess of 0.1 m.
  EXPECT_NEAR(roomFromCapture.translation().x(), 0.0, 0.05);
  EXPECT_NEAR(roomFromCapture.translation().y(), 0.0, 0.02);
  EXPECT_NEAR(roomFromCapture.translation().z(), 0.0, 0.1);
  EXPECT_NEAR(cameraFromCapture.linear().determinant(), 1.0, 1e-6);
  const Eigen::Vector3d view = cameraFromCapture.linear().transpose() * Eigen::Vector3d::UnitZ();
  EXPECT_NEAR(view.x(), 0.0, 1e-6);
  EXPECT_LT(view.z(), -0.9);
}

TEST(DepthPreparation, FollowsAPersonThroughATurn) {
  const avatar::Motion turn = avatar::makeClip("turn");
  const Room empty{.camera = roomCamera()};
  DepthPreparation prepare(empty.camera);
  constexpr int kFrames = 12;
  for (int i = 0; i < kFrames; ++i) {
    Room room = empty;
    room.addFloor();
    room.addWall(-1.5);
    room.addPerson(turn.frames[turn.frames.size() * i / kFrames], Eigen::Vector3d::Zero());
    const auto seen = picture(room, i);
    EXPECT_GT(maskIou(seen, prepare(seen.frame).person), kMinIou) << i;
  }
}

TEST(DepthPreparation, KeepsToTheOnePersonWhenAnotherWalksBy) {
  const avatar::BodyPose pose = standing();
  DepthPreparation prepare(roomCamera());
  for (int i = 0; i < 10; ++i) {
    Room room{.camera = roomCamera()};
    room.addFloor();
    room.addPerson(pose, {0.02 * i, 0.0, 0.0});
    room.addPerson(pose, {-1.6 + 0.05 * i, 0.0, -0.8}, test::kOtherPerson);
    const auto seen = picture(room, i);
    EXPECT_GT(maskIou(seen, prepare(seen.frame).person), kMinIou) << i;
  }
}

TEST(DepthPreparation, PersonCloseToTheWall) {
  for (const double wall : {-0.3, -0.6}) {  // the back reaches to −0.15
    const Room room = roomWithPerson(wall);
    const auto seen = picture(room);
    const DepthCloud cloud = DepthPreparation(room.camera)(seen.frame);
    EXPECT_GT(maskIou(seen, cloud.person), kMinIou) << "also without the wall between the legs";
  }
}

TEST(DepthPreparation, HalfBodyWithoutFloor) {
  Room room{.camera = roomCamera()};
  room.camera.cameraFromWorld = avatar::lookAt({0.0, 1.3, 1.1}, {0.0, 1.3, 0.0});
  room.addWall(-1.5);
  room.addPerson(standing(), Eigen::Vector3d::Zero());
  const auto seen = picture(room);
  DepthPreparation prepare(room.camera);
  EXPECT_GT(maskIou(seen, prepare(seen.frame).person), 0.97) << "a large mask, little outline";
  ASSERT_TRUE(prepare.captureFrame());
  EXPECT_EQ(prepare.captureFrame()->upSource, UpSource::kCamera);
  EXPECT_FALSE(prepare.captureFrame()->floorSeen);
  EXPECT_NEAR(upOf(*prepare.captureFrame()).y(), -1.0, 1e-6);
  // 1 m below the pelvis: a guess from the head's top, for grown people within 0.2 m.
  const Eigen::Isometry3d roomFromCapture =
      room.camera.cameraFromWorld.inverse() * prepare.captureFrame()->cameraFromWorld;
  EXPECT_NEAR(roomFromCapture.translation().y(), 0.0, 0.2);
}

TEST(DepthPreparation, AGivenUpIsUsedWithoutAFloor) {
  Room room{.camera = roomCamera()};
  room.camera.cameraFromWorld = avatar::lookAt({0.0, 1.7, 1.0}, {0.0, 1.3, 0.0});
  room.addPerson(standing(), Eigen::Vector3d::Zero());
  const Eigen::Vector3d up = room.camera.cameraFromWorld.linear().col(1);
  DepthPreparation prepare(room.camera, {.up = up.cast<float>()});
  prepare(picture(room).frame);
  ASSERT_TRUE(prepare.captureFrame());
  EXPECT_EQ(prepare.captureFrame()->upSource, UpSource::kGiven);
  EXPECT_LT(angleBetween(upOf(*prepare.captureFrame()), up), 1e-3);
}

TEST(DepthPreparation, NobodyInAnEmptyRoomUntilSomeoneComes) {
  Room room{.camera = roomCamera()};
  room.addFloor();
  room.addWall(-1.5);
  DepthPreparation prepare(room.camera);
  RgbdFrame black = picture(room).frame;
  std::fill(black.depth.begin(), black.depth.end(), 0.0F);
  for (const RgbdFrame& frame : {black, picture(room).frame}) {
    const DepthCloud cloud = prepare(frame);
    EXPECT_EQ(std::count(cloud.person.begin(), cloud.person.end(), 1), 0);
    EXPECT_FALSE(prepare.captureFrame());
  }
  room.addPerson(standing(), Eigen::Vector3d::Zero());
  const auto seen = picture(room, 2);
  EXPECT_GT(maskIou(seen, prepare(seen.frame).person), kMinIou);
  EXPECT_TRUE(prepare.captureFrame());
}

TEST(DepthPreparation, SameInputSameResult) {
  const Room room = roomWithPerson();
  const auto seen = picture(room);
  const DepthCloud first = DepthPreparation(room.camera)(seen.frame);
  const DepthCloud second = DepthPreparation(room.camera)(seen.frame);
  EXPECT_EQ(first.person, second.person);
  EXPECT_EQ(first.points, second.points);
  EXPECT_EQ(first.normals, second.normals);
}

TEST(DepthPreparation, RecycledMemoryLeavesNoTrace) {
  Room moved = roomWithPerson();
  moved.meshes.back().vertices.row(0).array() += 0.2;
  const auto first = picture(roomWithPerson());
  const auto second = picture(moved, 1);
  DepthPreparation recycling(moved.camera);
  DepthPreparation fresh(moved.camera);
  fresh(first.frame);
  const DepthCloud expected = fresh(second.frame);
  const DepthCloud cloud = recycling(second.frame, recycling(first.frame));
  EXPECT_EQ(cloud.person, expected.person);
  EXPECT_EQ(cloud.points, expected.points);
  EXPECT_EQ(cloud.normals, expected.normals);
}

/// As a noisy stereo camera sees a room: depth in patches of a person's size with holes between
/// them, each patch a little farther than the one on its left. In the middle stands only a patch.
TEST(DepthPreparation, HolesDontMakeTheBackgroundAPerson) {
  Room room{.camera = roomCamera()};
  room.addPerson(standing(), {-0.7, 0.0, 0.0});
  auto seen = picture(room);
  constexpr int kPanelWidth = 40;
  constexpr int kPanelHeight = 110;
  constexpr int kHole = 5;
  for (int y = 0; y < seen.frame.height; ++y) {
    for (int x = 0; x < seen.frame.width; ++x) {
      const auto i = static_cast<std::size_t>(y * seen.frame.width + x);
      if (seen.is(i, test::kPerson))
        continue;
      const bool isHole = x % kPanelWidth < kHole || y % kPanelHeight < kHole;
      const auto steps = static_cast<float>(x / kPanelWidth);
      seen.frame.depth[i] = isHole ? 0.0F : 3.4F + 0.2F * steps;
    }
  }
  EXPECT_GT(maskIou(seen, DepthPreparation(room.camera)(seen.frame).person), kMinIou);
}

TEST(DepthPreparation, LabelsOfTheUserStayOnThePerson) {
  const Room room = roomWithPerson();
  auto seen = picture(room);
  seen.frame.labels.assign(seen.frame.depth.size(), kUpper);
  const DepthCloud cloud = DepthPreparation(room.camera)(seen.frame);
  for (std::size_t i = 0; i < cloud.person.size(); ++i)
    ASSERT_EQ(cloud.labels[i], cloud.person[i] != 0 ? kUpper : kBackground);
}

TEST(DepthPreparation, RefusesFramesOfAnotherSize) {
  const Room room = roomWithPerson();
  RgbdFrame frame = picture(room).frame;
  DepthPreparation prepare(room.camera);
  frame.width = 100;
  EXPECT_THROW(prepare(frame), std::invalid_argument);
  frame.width = 320;
  frame.labels.resize(3);
  EXPECT_THROW(prepare(frame), std::invalid_argument);
  EXPECT_THROW(
      DepthPreparation(room.camera, {.up = Eigen::Vector3f(0.0F, -2.0F, 0.0F)}),
      std::invalid_argument);
}

}  // namespace
}  // namespace simulcap
