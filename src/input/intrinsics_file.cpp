#include "src/input/intrinsics_file.h"

#include "avatar/io/file_error.h"

#include <nlohmann/json.hpp>

#include <cmath>
#include <fstream>
#include <limits>
#include <sstream>

namespace simulcap {
namespace {

using Json = nlohmann::json;

struct NumberRange {
  double min;
  double max;
  const char* remedy;  ///< what the number is, with unit and an example
};

constexpr NumberRange kSize = {16, 16384, "the depth pictures' size in pixels, 16 to 16384"};
constexpr NumberRange kFocal = {10, 1e5, "focal length in pixels (525 for a Kinect at 640 x 480)"};
constexpr NumberRange kCentre = {
    -1e5, 1e5, "principal point in pixels (319.5, 239.5 at 640 x 480)"};
constexpr NumberRange kScale = {
    10, 1e6, "raw depth units per metre (1000: millimetres, 5000: TUM), 10 to 1000000"};
constexpr NumberRange kRate = {0.1, 1000, "frames per second, 0.1 to 1000"};
constexpr NumberRange kFrames = {1, 1e7, "number of frames of the turn-around, at least 1"};

class IntrinsicsReader {
 public:
  IntrinsicsReader(std::string path, Json document)
      : path_(std::move(path)), document_(std::move(document)) {}

  double number(const char* key, const NumberRange& range) const {
    const auto found = document_.find(key);
    if (found == document_.end())
      throw avatar::FileError(path_, key, std::string("is missing: ") + range.remedy);
    const double value =
        found->is_number() ? found->get<double>() : std::numeric_limits<double>::quiet_NaN();
    if (!(value >= range.min && value <= range.max))
      throw avatar::FileError(path_, key, "is " + found->dump() + ", expected " + range.remedy);
    return value;
  }

  double number(const char* key, const NumberRange& range, double fallback) const {
    return document_.contains(key) ? number(key, range) : fallback;
  }

  int integer(const char* key, const NumberRange& range) const {
    const double value = number(key, range);
    if (value != std::floor(value))
      throw avatar::FileError(path_, key, "must be a whole number: " + std::string(range.remedy));
    return static_cast<int>(value);
  }

  bool has(const char* key) const { return document_.contains(key); }

 private:
  std::string path_;
  Json document_;
};

Json parsed(const std::string& path) {
  std::ifstream file(path);
  if (!file)
    throw avatar::FileError(
        path,
        "",
        "no such file; write {\"width\":640,\"height\":480,\"fx\":525,\"fy\":525,\"cx\":319.5,"
        "\"cy\":239.5,\"depth_scale\":1000,\"fps\":30} with the camera's own figures");
  std::ostringstream text;
  text << file.rdbuf();
  Json document = Json::parse(text.str(), nullptr, false);
  if (!document.is_object())
    throw avatar::FileError(path, "", "is no JSON object");
  return document;
}

/// A centre outside of the picture or unequal focal lengths mean figures of another resolution.
void requirePlausible(const std::string& path, const avatar::Camera& camera) {
  const auto inside = [](double centre, int size) { return centre > 0.0 && centre < size - 1.0; };
  if (!inside(camera.cx, camera.width) || !inside(camera.cy, camera.height))
    throw avatar::FileError(
        path, "cx, cy", "are outside of the picture: give them for the depth pictures' size");
  if (camera.fx > 2.0 * camera.fy || camera.fy > 2.0 * camera.fx)
    throw avatar::FileError(
        path, "fx, fy", "differ by more than a factor of 2: give both in pixels of the same size");
}

}  // namespace

RecordingIntrinsics readIntrinsics(const std::string& path) {
  const IntrinsicsReader reader(path, parsed(path));
  RecordingIntrinsics result;
  avatar::Camera& camera = result.info.camera;
  camera.width = reader.integer("width", kSize);
  camera.height = reader.integer("height", kSize);
  camera.fx = reader.number("fx", kFocal);
  camera.fy = reader.number("fy", kFocal);
  camera.cx = reader.number("cx", kCentre);
  camera.cy = reader.number("cy", kCentre);
  requirePlausible(path, camera);
  result.depthScale = reader.number("depth_scale", kScale);
  result.info.framesPerSecond = reader.number("fps", kRate, 30.0);
  if (reader.has("turnaround_frames"))
    result.info.turnaroundFrames = reader.integer("turnaround_frames", kFrames);
  return result;
}

RecordingIntrinsics tumIntrinsics() {
  RecordingIntrinsics result;
  result.info.camera = {
      .width = 640, .height = 480, .fx = 525.0, .fy = 525.0, .cx = 319.5, .cy = 239.5};
  result.depthScale = 5000.0;
  return result;
}

}  // namespace simulcap
