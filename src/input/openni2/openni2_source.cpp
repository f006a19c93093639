#include "src/input/openni2/openni2_source.h"

#include "avatar/io/file_error.h"
#include "src/input/input_warnings.h"

#include <pcl/io/openni2_grabber.h>

#include <algorithm>
#include <boost/signals2/connection.hpp>
#include <chrono>
#include <condition_variable>
#include <exception>
#include <filesystem>
#include <functional>
#include <list>
#include <mutex>
#include <utility>

namespace simulcap {
namespace {

using pcl::io::OpenNI2Grabber;

constexpr std::size_t kQueue = 4;             // frames
constexpr std::chrono::seconds kPatience{5};  // for the first and every other frame
constexpr float kMetresPerUnit = 0.001F;      // OpenNI's default, PIXEL_FORMAT_DEPTH_1_MM

/// What the grabber's thread hands over.
struct Arrival {
  int number = 0;            // of the device, counting up
  double seconds = 0.0;      // of the device's clock
  double focalLength = 0.0;  // [px]
  RgbdFrame frame;
};

bool namesFile(const std::string& device) {
  return device.ends_with(".oni");
}

std::unique_ptr<OpenNI2Grabber> openGrabber(const std::string& device) {
  const bool isFile = namesFile(device);
  if (isFile && !std::filesystem::exists(device))
    throw avatar::FileError(device, "", "is missing; expected an OpenNI2 recording");
  try {
    return std::make_unique<OpenNI2Grabber>(device);
  } catch (const std::exception& error) {
    throw avatar::FileError(
        device.empty() ? "OpenNI2 camera" : device,
        "",
        isFile ? std::string("can't be played (") + error.what() + ")"
               : std::string("can't be opened (") + error.what() +
                     "); plug a camera in that OpenNI2 knows, or give a .oni file");
  }
}

Arrival arrived(const OpenNI2Grabber::DepthImage& depth) {
  Arrival arrival;
  arrival.number = static_cast<int>(depth.getFrameID());
  arrival.seconds = 1e-6 * static_cast<double>(depth.getTimestamp());
  arrival.focalLength = static_cast<double>(depth.getFocalLength());
  RgbdFrame& frame = arrival.frame;
  frame.width = static_cast<int>(depth.getWidth());
  frame.height = static_cast<int>(depth.getHeight());
  std::vector<unsigned short> raw(std::size_t{depth.getWidth()} * depth.getHeight());
  depth.fillDepthImageRaw(depth.getWidth(), depth.getHeight(), raw.data());
  frame.depth.resize(raw.size());
  std::transform(raw.begin(), raw.end(), frame.depth.begin(), [&](unsigned short value) {
    const bool isMeasured = value != depth.getNoSampleValue() && value != depth.getShadowValue();
    return isMeasured ? kMetresPerUnit * static_cast<float>(value) : 0.0F;
  });
  return arrival;
}

void addColor(RgbdFrame& frame, const OpenNI2Grabber::Image& image) {
  if (static_cast<int>(image.getWidth()) != frame.width ||
      static_cast<int>(image.getHeight()) != frame.height)
    return;
  frame.color = {frame.width, frame.height, {}};
  frame.color.rgb.assign(3 * frame.depth.size(), 0);
  image.fillRGB(image.getWidth(), image.getHeight(), frame.color.rgb.data());
}

class OpenNi2Source final : public FrameSource {
 public:
  explicit OpenNi2Source(const std::string& device)
      : name_(device.empty() ? "OpenNI2 camera" : device),
        isFile_(namesFile(device)),
        grabber_(openGrabber(device)) {
    connect();
    grabber_->start();
    std::unique_lock lock(mutex_);
    if (!changed_.wait_for(lock, kPatience, [&] { return !queue_.empty(); }))
      throw avatar::FileError(name_, "depth", "sends no depth; is another program using it?");
    const Arrival& first = queue_.front();
    info_.camera = {
        .width = first.frame.width,
        .height = first.frame.height,
        .fx = first.focalLength,
        .fy = first.focalLength,
        .cx = 0.5 * (first.frame.width - 1),
        .cy = 0.5 * (first.frame.height - 1)};
    info_.framesPerSecond = static_cast<double>(grabber_->getFramesPerSecond());
    firstNumber_ = first.number;
    firstSeconds_ = first.seconds;
  }

  OpenNi2Source(const OpenNi2Source&) = delete;
  OpenNi2Source& operator=(const OpenNi2Source&) = delete;
  OpenNi2Source(OpenNi2Source&&) = delete;
  OpenNi2Source& operator=(OpenNi2Source&&) = delete;

  ~OpenNi2Source() override {
    {
      const std::lock_guard lock(mutex_);
      isClosing_ = true;
    }
    changed_.notify_all();  // before the grabber waits for its thread
  }

  const RecordingInfo& info() const override { return info_; }

  std::optional<RgbdFrame> next() override {
    std::unique_lock lock(mutex_);
    if (!changed_.wait_for(lock, kPatience, [&] { return !queue_.empty() || hasEnded_; })) {
      if (isFile_)
        return std::nullopt;
      throw avatar::FileError(name_, "depth", "sends no more depth; is it still plugged in?");
    }
    if (queue_.empty())
      return std::nullopt;
    Arrival arrival = std::move(queue_.front());
    queue_.pop_front();
    lock.unlock();
    changed_.notify_all();
    arrival.frame.index = arrival.number - firstNumber_;
    arrival.frame.timestamp = arrival.seconds - firstSeconds_;
    return std::move(arrival.frame);
  }

  std::vector<std::string> warnings() const override {
    const std::lock_guard lock(mutex_);
    return warnings_.lines();
  }

 private:
  using Image = OpenNI2Grabber::Image;
  using DepthImage = OpenNI2Grabber::DepthImage;

  /// Both images at once where they show the same, else the depth alone.
  void connect() {
    const auto device = grabber_->getDevice();
    if (device->hasColorSensor() && (isFile_ || device->isImageRegistrationModeSupported())) {
      const std::function<OpenNI2Grabber::sig_cb_openni_image_depth_image> take =
          [this](const Image::Ptr& image, const DepthImage::Ptr& depth, float /*constant*/) {
            Arrival arrival = arrived(*depth);
            addColor(arrival.frame, *image);
            enqueue(std::move(arrival));
          };
      grabber_->registerCallback(take);
      return;
    }
    warnings_.add("colour that isn't registered to the depth, left out", name_);
    const std::function<OpenNI2Grabber::sig_cb_openni_depth_image> take =
        [this](const DepthImage::Ptr& depth) { enqueue(arrived(*depth)); };
    grabber_->registerCallback(take);
  }

  /// On the grabber's thread.
  void enqueue(Arrival arrival) {
    std::unique_lock lock(mutex_);
    if (isFile_)
      changed_.wait(lock, [&] { return queue_.size() < kQueue || isClosing_; });
    // A file begins again at its end.
    hasEnded_ = hasEnded_ || (isFile_ && arrival.number <= lastNumber_);
    if (isClosing_ || hasEnded_)
      return changed_.notify_all();
    if (queue_.size() == kQueue) {
      queue_.pop_front();
      warnings_.add("frames that came too fast, dropped", name_);
    }
    lastNumber_ = arrival.number;
    queue_.push_back(std::move(arrival));
    changed_.notify_all();
  }

  std::string name_;
  bool isFile_;
  RecordingInfo info_;
  int firstNumber_ = 0;
  double firstSeconds_ = 0.0;

  mutable std::mutex mutex_;  // of all that follows but the grabber
  std::condition_variable changed_;
  std::list<Arrival> queue_;
  int lastNumber_ = -1;
  bool hasEnded_ = false;
  bool isClosing_ = false;
  InputWarnings warnings_;
  std::unique_ptr<OpenNI2Grabber> grabber_;  // last: its thread ends before what it writes to
};

}  // namespace

std::unique_ptr<FrameSource> openOpenNi2(const std::string& device) {
  return std::make_unique<OpenNi2Source>(device);
}

}  // namespace simulcap
