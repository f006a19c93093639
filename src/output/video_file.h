#pragma once

#include "avatar/geometry/shading.h"

#include <memory>
#include <string>

namespace simulcap {

/// Is there an encoder on this machine that VideoWriter can use?
bool canWriteVideo();

/// Writes an .mp4 picture by picture, whole or not at all: H.264, which every browser plays, or
/// MPEG-4 where libavcodec can't do that. By one thread: same pictures, same bytes.
class VideoWriter {
 public:
  /// Throws avatar::FileError when the file can't be written, std::invalid_argument unless width
  /// and height [px] are even and positive and the rate is positive, std::runtime_error without an
  /// encoder.
  VideoWriter(std::string path, int width, int height, double framesPerSecond);
  ~VideoWriter();
  VideoWriter(const VideoWriter&) = delete;
  VideoWriter& operator=(const VideoWriter&) = delete;
  VideoWriter(VideoWriter&&) = delete;
  VideoWriter& operator=(VideoWriter&&) = delete;

  /// Throws std::invalid_argument for a picture of another size, avatar::FileError.
  void add(const avatar::ColorImage& picture);

  /// Gives the file its name. Throws avatar::FileError; nothing can be added any more.
  void finish();

 private:
  struct Encoder;

  void open(double framesPerSecond);
  void encode(bool flush);
  [[noreturn]] void fail(int error) const;

  std::string path_;
  std::string temporary_;
  std::unique_ptr<Encoder> encoder_;
};

}  // namespace simulcap
