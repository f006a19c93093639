#pragma once

#include "bullet_ext/core/cloth_contact.h"
#include "bullet_ext/core/cloth_stepper.h"
#include "bullet_ext/core/crossing_check.h"
#include "tests/bullet_ext/core/cloth_shapes.h"
#include "tests/support/primitive_meshes.h"

#include <Eigen/Core>
#include <Eigen/Geometry>

#include <cmath>
#include <cstddef>
#include <functional>
#include <memory>
#include <numbers>
#include <span>
#include <utility>
#include <vector>

/// Scenes in which cloth meets cloth, for tests and benchmarks.
namespace bullet_ext::test {

inline constexpr double kSubstep = 1.0 / 3000.0;
inline constexpr int kSubstepsPerFrame = 100;

/// Garments that fall, touch, and whose pins follow a script.
class ContactScene {
 public:
  /// Velocity [m/s] of a pinned vertex at its position [m] and the time [s].
  using PinVelocity = std::function<Eigen::Vector3f(const Eigen::Vector3f&, double)>;

  ClothContactOptions options;
  Eigen::Vector3d gravity = {0.0, -9.81, 0.0};
  PinVelocity pinVelocity;

  /// A garment in its rest shape.
  void add(const ClothMesh& mesh, int layer = 0) {
    steppers_.push_back(std::make_unique<ClothStepper>(mesh));
    states_.push_back(restState(steppers_.back()->mesh()));
    gravities_.emplace_back(mesh, gravity);
    layers_.push_back(layer);
  }

  void start() {
    std::vector<ContactGarment> garments;
    for (std::size_t g = 0; g < steppers_.size(); ++g) {
      const ClothMesh& mesh = steppers_[g]->mesh();
      garments.push_back({&mesh, layers_[g], mesh.material.thickness, mesh.material.friction});
    }
    contact_ = std::make_unique<ClothContact>(garments, options);
  }

  void integrate() {
    for (std::size_t g = 0; g < steppers_.size(); ++g) {
      for (const int pin : steppers_[g]->mesh().pins) {
        states_[g].velocities.col(pin).head<3>() =
            pinVelocity ? pinVelocity(states_[g].positions.col(pin).head<3>(), time_)
                        : Eigen::Vector3f::Zero();
      }
      const ExternalForce* force = &gravities_[g];
      steppers_[g]->step(states_[g], std::span(&force, 1));
    }
    time_ += kSubstep;
  }

  void substep() {
    integrate();
    contact_->resolve(states_, 0);
  }

  void beginFrame() { contact_->beginFrame(states_, {}); }

  void frame() {
    beginFrame();
    for (int i = 0; i < kSubstepsPerFrame; ++i) {
      substep();
    }
  }

  ClothContact& contact() { return *contact_; }

  std::vector<ClothState>& states() { return states_; }

  const ClothMesh& mesh(std::size_t garment) const { return steppers_[garment]->mesh(); }

  Eigen::Index numVertices() const {
    Eigen::Index count = 0;
    for (const ClothState& state : states_) {
      count += state.positions.cols();
    }
    return count;
  }

  std::vector<TriangleSurface> surfaces() const {
    std::vector<TriangleSurface> surfaces;
    for (std::size_t g = 0; g < steppers_.size(); ++g) {
      surfaces.push_back({states_[g].positions.topRows<3>().cast<double>(), mesh(g).faces});
    }
    return surfaces;
  }

  std::size_t crossings() const { return findCrossings(surfaces()).size(); }

  bool finite() const {
    bool all = true;
    for (const ClothState& state : states_) {
      all = all && isFinite(state);
    }
    return all;
  }

 private:
  std::vector<std::unique_ptr<ClothStepper>> steppers_;
  std::vector<ClothState> states_;
  std::vector<Gravity> gravities_;
  std::vector<int> layers_;
  std::unique_ptr<ClothContact> contact_;
  double time_ = 0.0;
};

inline constexpr ClothMaterial kTestCloth = {.damping = 1.0, .friction = 0.3, .thickness = 0.003};

/// A horizontal sheet, its normal up, columns × rows vertices, its middle at `middle` [m].
inline Sheet horizontalSheet(
    int columns, int rows, double edge, const Eigen::Vector3d& middle = Eigen::Vector3d::Zero()) {
  Sheet sheet = equilateralSheet(columns, rows, edge);
  Eigen::Matrix3d turn;
  turn << 1, 0, 0, 0, 0, 1, 0, -1, 0;
  sheet.vertices = (turn * sheet.vertices).eval();
  const Eigen::Vector3d mean = sheet.vertices.rowwise().mean();
  sheet.vertices.colwise() += middle - mean;
  return sheet;
}

/// A vertical tube around the y axis, faces outwards.
inline Sheet tube(double radius, double height, int around, int along) {
  const avatar::TriangleMesh mesh =
      avatar::test::grid(around, along, true, false, [&](int i, int j) {
        const double angle = 2.0 * std::numbers::pi * (i + 0.5 * (j % 2)) / around;
        return Eigen::Vector3d(
            radius * std::sin(angle), height * j / along, radius * std::cos(angle));
      });
  return {mesh.vertices, mesh.faces};
}

/// Indices of the vertices that fulfil a condition.
template <typename Condition>
std::vector<int> verticesWhere(const Sheet& sheet, const Condition& condition) {
  std::vector<int> chosen;
  for (int v = 0; v < sheet.vertices.cols(); ++v) {
    if (condition(Eigen::Vector3d(sheet.vertices.col(v)))) {
      chosen.push_back(v);
    }
  }
  return chosen;
}

/// Two sheets, the upper one turned by 20°, fall on a pinned third one.
inline void fallingSheets(ContactScene& scene, int side) {
  const double edge = 0.4 / side;
  Sheet ground = horizontalSheet(side, side, edge);
  Sheet middle = horizontalSheet(side, side, edge, {0.013, 0.02, 0.007});
  Sheet top = horizontalSheet(side, side, edge, {0.0, 0.05, 0.0});
  top.vertices =
      (Eigen::AngleAxisd(0.35, Eigen::Vector3d::UnitY()).toRotationMatrix() * top.vertices).eval();
  const double x = ground.vertices.row(0).maxCoeff();
  scene.add(
      clothOf(ground, kTestCloth, {.pins = verticesWhere(ground, [&](const Eigen::Vector3d& p) {
                                     return std::abs(p.x()) > x - edge;
                                   })}));
  scene.add(clothOf(middle, kTestCloth));
  scene.add(clothOf(top, kTestCloth));
}

/// A ribbon along x, whose ends turn against each other, `turns` in the given time [s].
inline void twistedRibbon(ContactScene& scene, int columns, double turns, double seconds) {
  const double edge = 0.6 / columns;
  const Sheet ribbon = horizontalSheet(columns, 9, edge);
  const double x = ribbon.vertices.row(0).maxCoeff();
  scene.gravity.setZero();
  scene.add(
      clothOf(ribbon, kTestCloth, {.pins = verticesWhere(ribbon, [&](const Eigen::Vector3d& p) {
                                     return std::abs(p.x()) > x - 2.0 * edge;
                                   })}));
  const double rate = std::numbers::pi * turns / seconds;
  scene.pinVelocity = [=](const Eigen::Vector3f& p, double time) -> Eigen::Vector3f {
    if (time > seconds) {
      return Eigen::Vector3f::Zero();
    }
    const float side = p.x() > 0.0F ? 1.0F : -1.0F;
    // The chord of the rotation: Euler steps along tangents would widen the circle.
    const double angle = rate * kSubstep;
    const auto sine = static_cast<float>(std::sin(angle) / kSubstep);
    const auto cosine = static_cast<float>((std::cos(angle) - 1.0) / kSubstep);
    return {
        -side * static_cast<float>(0.1 / seconds),
        cosine * p.y() - side * sine * p.z(),
        cosine * p.z() + side * sine * p.y()};
  };
}

/// A vertical sheet let fall on a pinned ground, on which it folds onto itself.
inline void droppedSheet(ContactScene& scene, int side) {
  const double edge = 0.4 / side;
  const Sheet ground = horizontalSheet(14, 14, 0.04);
  Sheet sheet = equilateralSheet(side, side, edge);
  sheet.vertices.row(0).array() -= 0.2;
  sheet.vertices.row(1).array() += 0.01;
  sheet.vertices.row(2) =
      0.02 * (sheet.vertices.row(1).array() * 30.0).sin() + 0.01 * sheet.vertices.row(0).array();
  scene.add(clothOf(ground, kTestCloth, {.pins = verticesWhere(ground, [](const Eigen::Vector3d&) {
                                           return true;
                                         })}));
  scene.add(clothOf(sheet, kTestCloth));
}

/// Two coaxial tubes. All of the inner one is pinned when `driven`: it swells, wobbles and turns.
inline void concentricTubes(ContactScene& scene, int around, bool driven) {
  const double edge = 2.0 * std::numbers::pi * 0.1 / around;
  const int along = static_cast<int>(0.4 / (edge * std::sqrt(0.75)));
  const Sheet inner = tube(0.1, 0.4, around, along);
  const Sheet outer = tube(0.108, 0.4, around + 3, along);
  const double top = 0.4 - 0.5 * edge;
  const auto pinned = [&](const Sheet& sheet, bool all) {
    return verticesWhere(sheet, [&](const Eigen::Vector3d& p) { return all || p.y() > top; });
  };
  scene.add(clothOf(inner, kTestCloth, {.pins = pinned(inner, driven)}), 0);
  scene.add(clothOf(outer, kTestCloth, {.pins = pinned(outer, false)}), 1);
  scene.pinVelocity = [driven](const Eigen::Vector3f& p, double time) -> Eigen::Vector3f {
    const auto phase = static_cast<float>(std::sin(8.0 * time));
    if (!driven) {
      return {0.3F * phase, 0.0F, 0.2F * phase};
    }
    const auto waist = static_cast<float>(std::sin(std::numbers::pi * double{p.y()} / 0.4));
    return {
        waist * (0.5F * p.x() + 0.3F * phase + 0.5F * p.z()),
        0.0F,
        waist * (0.5F * p.z() - 0.5F * p.x())};
  };
}

}  // namespace bullet_ext::test
