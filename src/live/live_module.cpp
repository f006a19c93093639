#include "src/input/frame_source.h"
#include "src/live/live_window.h"

#include <dlfcn.h>
#include <filesystem>
#include <stdexcept>
#include <string>

namespace simulcap {
namespace {

namespace fs = std::filesystem;

constexpr const char* kFile = "simulcap_window.so";

/// In the build tree beside the program, installed in lib.
fs::path modulePath() {
  const fs::path folder = fs::read_symlink("/proc/self/exe").parent_path();
  const fs::path beside = folder / kFile;
  return fs::exists(beside) ? beside : folder.parent_path() / "lib" / "simulcap" / kFile;
}

}  // namespace

LiveModule::LiveModule() : library_(dlopen(modulePath().c_str(), RTLD_NOW | RTLD_LOCAL)) {
  if (library_ == nullptr)
    throw std::runtime_error(
        std::string("the live view can't be loaded: ") +
        dlerror() +  // NOLINT(concurrency-mt-unsafe): glibc keeps one per thread
        "; install simulcap with its window module and PCL's visualization library");
}

void* LiveModule::find(const char* symbol) const {
  void* found = dlsym(library_, symbol);
  if (found == nullptr)
    throw std::runtime_error(
        std::string(kFile) + " is of another version of simulcap: it has no " + symbol);
  return found;
}

std::unique_ptr<LiveWindow> LiveModule::openWindow(
    const avatar::LayeredAvatar& avatar,
    const Eigen::Matrix3Xi& bodyFaces,
    const avatar::Camera& camera) const {
  const auto open = reinterpret_cast<decltype(&simulcapOpenWindow)>(find("simulcapOpenWindow"));
  return std::unique_ptr<LiveWindow>(open(avatar, bodyFaces, camera));
}

std::unique_ptr<FrameSource> LiveModule::openCamera(const std::string& device) const {
  const auto open = reinterpret_cast<decltype(&simulcapOpenCamera)>(find("simulcapOpenCamera"));
  return std::unique_ptr<FrameSource>(open(device));
}

}  // namespace simulcap
