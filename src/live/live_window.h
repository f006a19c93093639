#pragma once

#include "avatar/geometry/camera.h"
#include "avatar/layered_avatar.h"

#include <Eigen/Core>

#include <memory>
#include <string>
#include <vector>

namespace simulcap {

class FrameSource;

/// What is shown of a captured frame.
struct LiveScene {
  Eigen::Matrix3Xd body;                   ///< 3 × V [m], in the capture's world
  std::vector<Eigen::Matrix3Xd> garments;  ///< 3 × N each, in the avatar's order
  Eigen::Matrix3Xf points;                 ///< 3 × P [m]: depth of the person
  std::string caption;                     ///< one line
};

/// A window on the captured person in which the mouse orbits freely. Keys: b body, 1 … 9 garments,
/// d depth points, q ends; PCL's own besides (h lists them). To be used in one thread.
class LiveWindow {
 public:
  virtual ~LiveWindow() = default;

  /// Draws it.
  virtual void show(const LiveScene& scene) = 0;

  /// What mouse and keys did since the last time; doesn't wait.
  virtual void handleInput() = 0;

  /// The user has ended it.
  virtual bool closed() const = 0;

  /// What it shows as a PNG file.
  virtual void save(const std::string& file) = 0;

 protected:
  LiveWindow() = default;
  LiveWindow(const LiveWindow&) = default;
  LiveWindow& operator=(const LiveWindow&) = default;
  LiveWindow(LiveWindow&&) = default;
  LiveWindow& operator=(LiveWindow&&) = default;
};

/// The parts of the program that need VTK, which costs every start a quarter of a second: in a
/// module of their own (simulcap_window.so, beside the program or in ../lib/simulcap) that is
/// loaded when somebody asks for it.
class LiveModule {
 public:
  /// Throws std::runtime_error when the module isn't there or can't be loaded.
  LiveModule();

  /// Seen first as the camera sees it. Throws std::runtime_error without a display.
  std::unique_ptr<LiveWindow> openWindow(
      const avatar::LayeredAvatar& avatar,
      const Eigen::Matrix3Xi& bodyFaces,
      const avatar::Camera& camera) const;

  /// openOpenNi2() (src/input/openni2).
  std::unique_ptr<FrameSource> openCamera(const std::string& device) const;

 private:
  void* find(const char* symbol) const;

  void* library_ = nullptr;  ///< stays loaded: VTK has destructors for when the program ends
};

}  // namespace simulcap

// What the module offers; the caller owns the results.
extern "C" {
simulcap::LiveWindow* simulcapOpenWindow(
    const avatar::LayeredAvatar& avatar,
    const Eigen::Matrix3Xi& bodyFaces,
    const avatar::Camera& camera);
simulcap::FrameSource* simulcapOpenCamera(const std::string& device);
}
