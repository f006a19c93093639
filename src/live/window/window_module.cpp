// The module simulcap_window.so: what needs VTK (live_window.h). Heavy headers stay in here.
#include "avatar/geometry/measures.h"
#include "src/input/openni2/openni2_source.h"
#include "src/live/live_window.h"

#include <pcl/visualization/interactor_style.h>
#include <pcl/visualization/pcl_visualizer.h>

#include <cmath>
#include <cstdlib>
#include <stdexcept>
#include <string>
#include <vector>
#include <vtkActor.h>
#include <vtkCellArray.h>
#include <vtkFloatArray.h>
#include <vtkPointData.h>
#include <vtkPoints.h>
#include <vtkPolyData.h>
#include <vtkProperty.h>
#include <vtkRenderWindow.h>
#include <vtkRenderWindowInteractor.h>
#include <vtkSmartPointer.h>
#include <vtkUnsignedCharArray.h>

namespace simulcap {
namespace {

using pcl::visualization::KeyboardEvent;
using pcl::visualization::PCLVisualizer;
using pcl::visualization::PCLVisualizerInteractorStyle;

constexpr int kWidth = 960;   // of the window [px]
constexpr int kHeight = 720;  // [px]
constexpr int kPatience = 5;  // [ms]

/// A surface whose points move; VTK's own arrays, filled in place.
class MovingMesh {
 public:
  MovingMesh(const Eigen::Matrix3Xi& faces, const Eigen::Matrix3Xd& colors) : faces_(faces) {
    vtkNew<vtkCellArray> cells;
    for (const auto& face : faces.colwise()) {
      const vtkIdType corners[] = {face[0], face[1], face[2]};
      cells->InsertNextCell(3, corners);
    }
    data_->SetPoints(points_);
    data_->SetPolys(cells);
    normals_->SetNumberOfComponents(3);
    data_->GetPointData()->SetNormals(normals_);
    if (colors.cols() > 0)
      paint(colors);
  }

  vtkSmartPointer<vtkPolyData> data() const { return data_; }

  void move(const Eigen::Matrix3Xd& vertices) {
    const Eigen::Matrix3Xd normals = avatar::vertexNormals({vertices, faces_});
    points_->SetNumberOfPoints(vertices.cols());
    normals_->SetNumberOfTuples(vertices.cols());
    for (Eigen::Index i = 0; i < vertices.cols(); ++i) {
      points_->SetPoint(i, vertices.col(i).data());
      normals_->SetTuple(i, normals.col(i).data());
    }
    points_->Modified();
    normals_->Modified();
    data_->Modified();
  }

 private:
  void paint(const Eigen::Matrix3Xd& colors) {
    vtkNew<vtkUnsignedCharArray> bytes;
    bytes->SetNumberOfComponents(3);
    bytes->SetNumberOfTuples(colors.cols());
    for (Eigen::Index i = 0; i < colors.cols(); ++i) {
      const Eigen::Vector3d color = 255.0 * colors.col(i).cwiseMin(1.0).cwiseMax(0.0);
      bytes->SetTuple(i, color.data());
    }
    data_->GetPointData()->SetScalars(bytes);
  }

  Eigen::Matrix3Xi faces_;
  vtkNew<vtkPoints> points_;
  vtkNew<vtkFloatArray> normals_;
  vtkNew<vtkPolyData> data_;
};

/// The same for loose points, as many as there are.
class MovingPoints {
 public:
  MovingPoints() { data_->SetPoints(points_); }

  vtkSmartPointer<vtkPolyData> data() const { return data_; }

  void move(const Eigen::Matrix3Xf& points) {
    vtkNew<vtkCellArray> cells;
    points_->SetNumberOfPoints(points.cols());
    for (vtkIdType i = 0; i < points.cols(); ++i) {
      points_->SetPoint(i, points.col(i).cast<double>().eval().data());
      cells->InsertNextCell(1, &i);
    }
    data_->SetVerts(cells);
    points_->Modified();
    data_->Modified();
  }

 private:
  vtkNew<vtkPoints> points_;
  vtkNew<vtkPolyData> data_;
};

/// PCL's mouse and keys. Its own draws everything anew whenever a timer rings.
class QuietStyle final : public PCLVisualizerInteractorStyle {
 public:
  static QuietStyle* New() {  // NOLINT(readability-identifier-naming): VTK's name
    auto* style = new QuietStyle;
    style->InitializeObjectBase();
    return style;
  }

 protected:
  void OnTimer() override {}
};

class PclWindow final : public LiveWindow {
 public:
  PclWindow(
      const avatar::LayeredAvatar& avatar,
      const Eigen::Matrix3Xi& bodyFaces,
      const avatar::Camera& camera)
      : viewer_(noArguments_, nullptr, "simulcap live", QuietStyle::New()) {
    // Drawn without a graphics card, several samples per pixel would cost as much as the capture.
    viewer_.getRenderWindow()->SetMultiSamples(0);
    viewer_.setShowFPS(false);
    viewer_.setSize(kWidth, kHeight);
    viewer_.setBackgroundColor(0.12, 0.13, 0.15);
    meshes_.reserve(1 + avatar.garments.size());
    meshes_.emplace_back(bodyFaces, avatar.body.vertexColors);
    colors_.push_back(avatar.body.color);
    for (const avatar::Garment& garment : avatar.garments) {
      meshes_.emplace_back(garment.mesh.faces, garment.vertexColors);
      colors_.push_back(garment.color);
    }
    viewer_.addText("", 10, 10, 14, 0.9, 0.9, 0.9, kCaption);
    viewer_.registerKeyboardCallback([this](const KeyboardEvent& event) { pressed(event); });
    lookFrom(camera);
    // ProcessEvents() waits for an event or a timer, without either for a second.
    viewer_.getRenderWindow()->GetInteractor()->CreateRepeatingTimer(kPatience);
  }

  void show(const LiveScene& scene) override {
    meshes_.front().move(scene.body);
    for (std::size_t i = 0; i + 1 < meshes_.size() && i < scene.garments.size(); ++i)
      meshes_[i + 1].move(scene.garments[i]);
    points_.move(scene.points);
    if (!shown_)
      addAll();
    viewer_.updateText(scene.caption, 10, 10, kCaption);
    viewer_.getRenderWindow()->Render();
  }

  /// Not PCL's spinOnce(), which waits up to seconds for VTK 9's timers.
  void handleInput() override { viewer_.getRenderWindow()->GetInteractor()->ProcessEvents(); }

  bool closed() const override { return viewer_.wasStopped(); }

  void save(const std::string& file) override { viewer_.saveScreenshot(file); }

 private:
  static constexpr const char* kCaption = "caption";
  static constexpr const char* kDepth = "depth";

  static std::string nameOf(std::size_t mesh) { return "mesh" + std::to_string(mesh); }

  /// VTK asks for bounds when something is added, so that is done with the first frame.
  void addAll() {
    shown_ = true;
    for (std::size_t i = 0; i < meshes_.size(); ++i)
      add(meshes_[i].data(), nameOf(i), colors_[i]);
    add(points_.data(), kDepth, {0.2, 0.8, 1.0});
  }

  /// Smooth and matt. PCL's own are flat and shine in their colour's complement.
  void add(
      const vtkSmartPointer<vtkPolyData>& data,
      const std::string& name,
      const Eigen::Vector3d& color) {
    viewer_.addModelFromPolyData(data, name);
    auto* actor = vtkActor::SafeDownCast(viewer_.getShapeActorMap()->at(name));
    if (actor == nullptr)
      return;
    vtkProperty& look = *actor->GetProperty();
    look.SetInterpolationToGouraud();
    look.SetColor(color.x(), color.y(), color.z());
    look.SetAmbient(0.15);
    look.SetDiffuse(0.75);
    look.SetSpecular(0.0);
    look.SetPointSize(2.0F);
  }

  /// As the camera sees it, turning about the person.
  void lookFrom(const avatar::Camera& camera) {
    const Eigen::Vector3d eye = avatar::centre(camera);
    const Eigen::Matrix3d world = camera.cameraFromWorld.linear().transpose();
    const Eigen::Vector3d target = eye + eye.head<3>().norm() * world.col(2);
    const Eigen::Vector3d up = -world.col(1);
    viewer_.setCameraPosition(
        eye.x(), eye.y(), eye.z(), target.x(), target.y(), target.z(), up.x(), up.y(), up.z());
    viewer_.setCameraFieldOfView(2.0 * std::atan(0.5 * camera.height / camera.fy));
    viewer_.setCameraClipDistances(0.01, 100.0);
  }

  void pressed(const KeyboardEvent& event) {
    if (!event.keyDown() || event.getKeySym().size() != 1)
      return;
    const char key = event.getKeySym().front();
    if (key == 'b')
      toggle(nameOf(0));
    else if (key == 'd')
      toggle(kDepth);
    else if (key >= '1' && key <= '9' && static_cast<std::size_t>(key - '0') < meshes_.size())
      toggle(nameOf(static_cast<std::size_t>(key - '0')));
  }

  void toggle(const std::string& name) {
    const auto actor = viewer_.getShapeActorMap()->find(name);
    if (actor != viewer_.getShapeActorMap()->end())
      actor->second->SetVisibility(actor->second->GetVisibility() == 0 ? 1 : 0);
  }

  int noArguments_ = 0;
  PCLVisualizer viewer_;
  std::vector<MovingMesh> meshes_;  // the body's first
  std::vector<Eigen::Vector3d> colors_;
  MovingPoints points_;
  bool shown_ = false;
};

}  // namespace
}  // namespace simulcap

simulcap::LiveWindow* simulcapOpenWindow(
    const avatar::LayeredAvatar& avatar,
    const Eigen::Matrix3Xi& bodyFaces,
    const avatar::Camera& camera) {
  // Else VTK ends the program.
  if (std::getenv("DISPLAY") == nullptr)  // NOLINT(concurrency-mt-unsafe): nobody sets it
    throw std::runtime_error(
        "there is no display for a window (DISPLAY isn't set); xvfb-run makes one that nobody "
        "sees");
  return new simulcap::PclWindow(avatar, bodyFaces, camera);
}

simulcap::FrameSource* simulcapOpenCamera(const std::string& device) {
  return simulcap::openOpenNi2(device).release();
}
