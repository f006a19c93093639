#include "tests/fuzz/readers.h"

#include "avatar/io/avatar_file.h"
#include "avatar/io/body_file.h"
#include "avatar/io/file_error.h"
#include "avatar/io/mesh_file.h"
#include "avatar/io/motion_file.h"
#include "avatar/io/npy.h"
#include "avatar/io/npz.h"
#include "avatar/io/prior_file.h"
#include "src/capture/capture_checkpoint.h"
#include "src/evaluation/camera_file.h"
#include "src/evaluation/metrics_file.h"
#include "src/input/recording.h"
#include "src/output/image_file.h"
#include "src/output/performance_reader.h"
#include "src/report/frame_series.h"
#include "src/report/report_input.h"
#include "src/scene/scene_file.h"
#include "tests/support/sample_avatar.h"
#include "tests/support/synthetic_body.h"

#include <nlohmann/json.hpp>

#include <cstdint>
#include <cstring>
#include <fstream>
#include <sstream>
#include <zlib.h>

namespace simulcap::fuzz {
namespace {

namespace fs = std::filesystem;
using avatar::NpyArray;

template <typename Read>
bool attempt(Read read) {
  try {
    read();
    return true;
  } catch (const avatar::FileError&) {
    return false;
  }
}

void write(const fs::path& path, std::span<const char> bytes) {
  fs::create_directories(path.parent_path());
  std::ofstream(path, std::ios::binary)
      .write(bytes.data(), static_cast<std::streamsize>(bytes.size()));
}

bool readArrays(const fs::path& folder) {
  const std::string path = folder / "arrays.npz";
  const bool names = attempt([&] { avatar::npzKeys(path); });
  const bool arrays = attempt([&] { avatar::readNpz(path); });
  const bool body = attempt([&] { avatar::readBodyModel(path); });
  const bool motion = attempt([&] { avatar::readMotion(path, {.placeOnFloor = true}); });
  const bool performance = attempt([&] {
    PerformanceReader reader(path);
    while (reader.next()) {
    }
  });
  return names && arrays && body && motion && performance;
}

/// Stored and not deflated: a byte changed in the file is one changed in an array.
void writeStored(const fs::path& path, const avatar::NpzArrays& arrays) {
  std::map<std::string, avatar::NpyFile> files;
  for (const auto& [key, array] : arrays) {
    const std::vector<std::uint8_t> bytes = avatar::formatNpy(array);
    const std::string file = path.parent_path() / (key + ".npy");
    write(file, {reinterpret_cast<const char*>(bytes.data()), bytes.size()});
    files[key] = {file, false};
  }
  avatar::writeNpzFromFiles(path, files);
  for (const auto& [key, file] : files)
    fs::remove(file.path);
}

NpyArray numbers(std::vector<std::int64_t> shape, NpyArray::Type type, double value = 0.0) {
  NpyArray array{.type = type, .shape = std::move(shape), .bytes = {}};
  array.bytes = NpyArray::fromMatrix(Eigen::VectorXd::Constant(array.size(), value), type).bytes;
  return array;
}

/// A body, and a motion and a performance of a garment in two frames.
void writeArrays(const fs::path& folder) {
  using Type = NpyArray::Type;
  avatar::NpzArrays arrays = avatar::bodyModelToNpz(
      avatar::test::randomBody(1, {.vertices = 5, .joints = 3, .betas = 1, .weightsPerVertex = 2}));
  arrays["poses"] = numbers({2, 72}, Type::kFloat32, 0.1);
  arrays["trans"] = numbers({2, 3}, Type::kFloat64);
  arrays["betas"] = numbers({1}, Type::kFloat64);
  arrays["mocap_framerate"] = numbers({}, Type::kFloat64, 30.0);
  arrays["up_axis"] = NpyArray::fromText("y");
  arrays["frame_index"] = NpyArray::fromMatrix(Eigen::Vector2d(0.0, 2.0), Type::kInt32);
  arrays["frame_index"].shape = {2};
  arrays["garment_a"] = numbers({2, 3, 3}, Type::kFloat32, 1.0);
  arrays["provenance_a"] = numbers({2, 3}, Type::kUint8, 255.0);
  arrays["faces_a"] = NpyArray::fromMatrix(Eigen::RowVector3d(0.0, 1.0, 2.0), Type::kInt32);
  writeStored(folder / "arrays.npz", arrays);
}

bool readMixture(const fs::path& folder) {
  return attempt([&] { avatar::readPrior(folder / "prior.npz"); });
}

void writeMixture(const fs::path& folder) {
  using Type = NpyArray::Type;
  constexpr std::int64_t size = avatar::kNumPriorParameters;
  NpyArray covariance = NpyArray::fromMatrix(Eigen::MatrixXd::Identity(size, size), Type::kInt8);
  covariance.shape = {1, size, size};
  writeStored(
      folder / "prior.npz",
      {{"means", numbers({1, size}, Type::kInt8)},
       {"weights", numbers({1}, Type::kFloat32, 1.0)},
       {"covars", covariance}});
}

bool readState(const fs::path& folder) {
  return attempt([&] { readCheckpoint(folder / "state.npz"); });
}

void writeState(const fs::path& folder) {
  CaptureCheckpoint checkpoint;
  checkpoint.settings = "simulcap";
  checkpoint.numFrames = 2;
  checkpoint.cloth.bodyVertices = Eigen::Matrix3Xd::Ones(3, 2);
  const Eigen::Matrix3Xd points = Eigen::Matrix3Xd::Ones(3, 2);
  checkpoint.cloth.garments = {{points, points, points, Eigen::VectorXf::Ones(2)}};
  writeCheckpoint(folder / "deflated.npz", checkpoint);
  writeStored(folder / "state.npz", avatar::readNpz(folder / "deflated.npz"));
  fs::remove(folder / "deflated.npz");
}

bool readDressed(const fs::path& folder) {
  return attempt([&] { avatar::readAvatar(folder / "avatar.glb"); });
}

void writeDressed(const fs::path& folder) {
  avatar::LayeredAvatar person;
  person.body =
      avatar::makeAvatarBody(avatar::test::randomBody(1, {.vertices = 30, .betas = 0}), {});
  avatar::Garment skirt = avatar::test::tubeGarment(
      person.body, "skirt", {.bottom = -0.5, .top = 0.5, .columns = 4, .rows = 1}, avatar::aPose());
  skirt.maxDistance = Eigen::VectorXd::Constant(skirt.mesh.numVertices(), 0.1);
  skirt.hints = {{"unity", {{"bendingStiffness", 0.3}}}};
  skirt.collideWith = {"body"};
  person.garments.push_back(std::move(skirt));
  avatar::writeAvatar(folder / "avatar.glb", person);
}

template <const char* kFile>
bool readSurface(const fs::path& folder) {
  attempt([&] { avatar::readMesh(folder / kFile, {.requireSurface = false}); });
  return attempt([&] { avatar::readMesh(folder / kFile); });
}

constexpr char kObj[] = "mesh.obj";
constexpr char kPly[] = "mesh.ply";

avatar::TriangleMesh smallSheet() {
  return avatar::test::grid(
      2, 2, false, false, [](int i, int j) { return Eigen::Vector3d(0.1 * i, 0.1 * j, 0.0); });
}

void writeObjFile(const fs::path& folder) {
  avatar::writeObj(folder / kObj, smallSheet());
}

void writePlyFile(const fs::path& folder) {
  const avatar::TriangleMesh sheet = smallSheet();
  avatar::writePly(folder / kPly, sheet, Eigen::Matrix3Xd::Ones(3, sheet.numVertices()));
}

bool readBvhFile(const fs::path& folder) {
  return attempt([&] { avatar::readMotion(folder / "clip.bvh"); });
}

void writeBvhFile(const fs::path& folder) {
  std::ostringstream bvh;
  bvh << "HIERARCHY\nROOT Hips\n{\n OFFSET 0 1 0\n"
         " CHANNELS 6 Xposition Yposition Zposition Zrotation Xrotation Yrotation\n";
  const auto limb = [&](const std::string& side, const std::vector<std::string>& joints, double y) {
    for (const std::string& joint : joints)
      bvh << "JOINT " << side << joint << "\n{\n OFFSET " << (side == "Left" ? 0.1 : -0.1) << ' '
          << y << " 0\n CHANNELS 3 Zrotation Xrotation Yrotation\n";
    bvh << "End Site\n{\n OFFSET 0 " << y << " 0\n}\n";
    for (std::size_t i = 0; i < joints.size(); ++i)
      bvh << "}\n";
  };
  limb("Left", {"UpLeg", "Leg", "Foot"}, -0.4);
  limb("Right", {"UpLeg", "Leg", "Foot"}, -0.4);
  limb("", {"Spine", "Neck", "Head"}, 0.2);
  limb("Left", {"Shoulder", "Arm", "ForeArm", "Hand"}, 0.1);
  limb("Right", {"Shoulder", "Arm", "ForeArm", "Hand"}, 0.1);
  bvh << "}\nMOTION\nFrames: 2\nFrame Time: 0.033\n";
  constexpr int kChannels = 6 + 3 * (3 + 3 + 3 + 4 + 4);
  for (int i = 0; i < 2 * kChannels; ++i)
    bvh << i % 7 << (i % kChannels == kChannels - 1 ? '\n' : ' ');
  write(folder / "clip.bvh", bvh.str());
}

bool readSceneFile(const fs::path& folder) {
  return attempt([&] { readScene(folder / "scene.json"); });
}

constexpr std::string_view kScene = R"({
  "time": {"frames": 4}, "body": {"motion": "walk_in_place", "betas": [0.5, -1]},
  "garments": [
    {"name": "upper", "wear": {"cut": "tshirt", "edge_length": 0.05}, "cloth": {"material": "soft"}},
    {"sheet": {}, "pins": ["top_left"]}],
  "camera": {"position": [0, 1.1, 2.4], "look_at": [0, 0.93, 0], "width": 160, "height": 120},
  "sensor": {"model": "kinect_v1"}, "truth": {"settle_seconds": 0.2}
})";

void writeSceneFile(const fs::path& folder) {
  write(folder / "scene.json", kScene);
}

constexpr int kPixels = 16;
constexpr std::string_view kIntrinsics =
    R"({"width":16,"height":16,"fx":20,"fy":20.5,"cx":7.5,"cy":7.5,"depth_scale":1000,"fps":30})";

std::string depthPng() {
  return pngBytes(kPixels, kPixels, std::vector<std::uint16_t>(kPixels * kPixels, 1000));
}

bool readFrames(const fs::path& folder) {
  return attempt([&] {
    const auto source = openRecording(folder);
    while (source->next()) {
    }
    source->warnings();
  });
}

/// The rest of a recording of two frames, where it isn't there yet.
void completeRecording(const fs::path& folder) {
  static const std::string kPng = depthPng();
  for (const char* name : {"depth/000000.png", "depth/000001.png"})
    if (!fs::exists(folder / name))
      write(folder / name, kPng);
  if (!fs::exists(folder / "intrinsics.json"))
    write(folder / "intrinsics.json", kIntrinsics);
}

bool readRecording(const fs::path& folder) {
  completeRecording(folder);
  return readFrames(folder);
}

/// One picture as depth, colour and label map.
bool readPictures(const fs::path& folder) {
  completeRecording(folder);
  fs::copy_file(
      folder / "frame.png", folder / "depth/000001.png", fs::copy_options::overwrite_existing);
  for (const char* name : {"color", "labels"}) {
    fs::create_directories(folder / name);
    fs::copy_file(
        folder / "frame.png", folder / name / "000000.png", fs::copy_options::overwrite_existing);
  }
  return readFrames(folder);
}

void writePictures(const fs::path& folder) {
  write(folder / "frame.png", depthPng());
}

void writeIntrinsics(const fs::path& folder) {
  write(folder / "intrinsics.json", kIntrinsics);
}

void writeTimestamps(const fs::path& folder) {
  write(folder / "timestamps.txt", std::string_view("# s\n0.0\n0.033 again\n"));
}

void writeTumList(const fs::path& folder) {
  write(
      folder / "associations.txt",
      std::string_view("1.5 depth/000000.png 1.49 depth/000001.png\n"
                       "1.53 rgb/1.png 1.54 depth/000001.png\n"));
}

/// Of a finished capture, whichever part of it the bytes are.
bool readResult(const fs::path& folder) {
  if (!fs::exists(folder / "performance.npz")) {
    writeArrays(folder);
    fs::rename(folder / "arrays.npz", folder / "performance.npz");
  }
  for (const char* name : {"metrics.json", "camera.json", "compare.json", "timing.csv"})
    fs::copy_file(folder / "result", folder / name, fs::copy_options::overwrite_existing);
  const bool camera = attempt([&] { readCameraFromWorld(folder / "camera.json"); });
  fs::remove(folder / "camera.json");
  attempt([&] { openReportInput(folder, {}); });
  fs::remove(folder / "compare.json");
  const bool report = attempt([&] { openReportInput(folder, {}); });
  attempt([&] {
    FrameSeries series;
    series.begin(0);
    series.begin(2);
    series.addTiming(folder / "timing.csv", bytesOf(folder / "timing.csv"));
  });
  return attempt([&] {
           mergeMetrics(folder / "metrics.json", {{"frames", 2}});
         }) &&
         camera && report;
}

void writeResult(const fs::path& folder) {
  write(folder / "result", std::string_view(R"({"input": "none", "runs": [],
"camera_from_world": [[1,0,0,0],[0,1,0,0],[0,0,1,2.5],[0,0,0,1]]})"));
}

std::uint32_t little(const std::string& bytes, std::size_t at, int count) {
  std::uint32_t value = 0;
  for (int i = 0; i < count; ++i)
    value |= static_cast<std::uint32_t>(static_cast<unsigned char>(bytes[at + i])) << (8 * i);
  return value;
}

std::uint32_t crcOf(const std::string& bytes, std::size_t at, std::size_t count) {
  return static_cast<std::uint32_t>(
      crc32(0, reinterpret_cast<const Bytef*>(bytes.data() + at), static_cast<uInt>(count)));
}

/// Of all stored entries: local header of 30 bytes, name, extra, data; 46 bytes in the directory.
void repairZip(std::string& bytes) {
  for (std::size_t at = bytes.find("PK\1\2"); at != std::string::npos && at + 46 <= bytes.size();
       at = bytes.find("PK\1\2", at + 4)) {
    const std::size_t local = little(bytes, at + 42, 4);
    if (little(bytes, at + 10, 2) != 0 || local + 30 > bytes.size())
      continue;
    const std::size_t data =
        local + 30 + little(bytes, local + 26, 2) + little(bytes, local + 28, 2);
    const std::size_t size = little(bytes, at + 20, 4);
    if (data > bytes.size() || size > bytes.size() - data)
      continue;
    const std::uint32_t crc = crcOf(bytes, data, size);
    std::memcpy(bytes.data() + at + 16, &crc, sizeof crc);
    std::memcpy(bytes.data() + local + 14, &crc, sizeof crc);
  }
}

/// Of all chunks: length, type, data, checksum of type and data, big endian.
void repairPng(std::string& bytes) {
  std::size_t at = 8;
  while (at + 12 <= bytes.size()) {
    const std::size_t size = __builtin_bswap32(little(bytes, at, 4));
    if (size > bytes.size() - at - 12)
      return;
    const std::uint32_t crc = __builtin_bswap32(crcOf(bytes, at + 4, size + 4));
    std::memcpy(bytes.data() + at + 8 + size, &crc, sizeof crc);
    at += 12 + size;
  }
}

}  // namespace

const std::vector<Reader>& readers() {
  static const std::vector<Reader> kReaders = {
      {"npz", "arrays.npz", readArrays, writeArrays},
      {"prior", "prior.npz", readMixture, writeMixture},
      {"checkpoint", "state.npz", readState, writeState},
      {"avatar", "avatar.glb", readDressed, writeDressed},
      {"obj", kObj, readSurface<kObj>, writeObjFile},
      {"ply", kPly, readSurface<kPly>, writePlyFile},
      {"bvh", "clip.bvh", readBvhFile, writeBvhFile},
      {"scene", "scene.json", readSceneFile, writeSceneFile},
      {"png", "frame.png", readPictures, writePictures},
      {"intrinsics", "intrinsics.json", readRecording, writeIntrinsics},
      {"timestamps", "timestamps.txt", readRecording, writeTimestamps},
      {"tum", "associations.txt", readRecording, writeTumList},
      {"result", "result", readResult, writeResult}};
  return kReaders;
}

bool readBytes(const Reader& reader, std::span<const char> bytes, const fs::path& folder) {
  std::string repaired(bytes.begin(), bytes.end());
  if (repaired.starts_with("PK"))
    repairZip(repaired);
  else if (repaired.starts_with("\x89PNG"))
    repairPng(repaired);
  write(folder / reader.file, repaired);
  return reader.read(folder);
}

std::string bytesOf(const fs::path& path) {
  std::ostringstream bytes;
  bytes << std::ifstream(path, std::ios::binary).rdbuf();
  return bytes.str();
}

}  // namespace simulcap::fuzz
