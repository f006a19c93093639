#include "src/output/video_file.h"

#include "avatar/io/file_error.h"

extern "C" {
#include <libavcodec/avcodec.h>
#include <libavformat/avformat.h>
#include <libavutil/log.h>
}

#include <array>
#include <cmath>
#include <filesystem>
#include <stdexcept>
#include <string>
#include <unistd.h>
#include <utility>

namespace simulcap {
namespace {

namespace fs = std::filesystem;

const AVCodec* encoderOfThisMachine() {
  for (const char* name : {"libx264", "libopenh264", "mpeg4"})
    if (const AVCodec* codec = avcodec_find_encoder_by_name(name))
      return codec;
  return nullptr;
}

struct CloseFormat {
  void operator()(AVFormatContext* format) const {
    if (format->pb != nullptr)
      avio_closep(&format->pb);
    avformat_free_context(format);
  }
};

struct FreeCodec {
  void operator()(AVCodecContext* codec) const { avcodec_free_context(&codec); }
};

struct FreeFrame {
  void operator()(AVFrame* frame) const { av_frame_free(&frame); }
};

struct FreePacket {
  void operator()(AVPacket* packet) const { av_packet_free(&packet); }
};

std::uint8_t byteOf(double value) {
  return static_cast<std::uint8_t>(std::lround(value));
}

/// RGB to luma at every pixel and chroma at every second of every second row, studio range: ITU-R
/// BT.601, what players take a small video for.
void convert(const avatar::ColorImage& picture, AVFrame& frame) {
  const auto pixel = [&](int x, int y) {
    return &picture.rgb[std::size_t{3} * (std::size_t(y) * picture.width + x)];
  };
  const auto at = [&](int plane, int x, int y) -> std::uint8_t& {
    return frame.data[plane][std::ptrdiff_t{y} * frame.linesize[plane] + x];
  };
  for (int y = 0; y < picture.height; ++y)
    for (int x = 0; x < picture.width; ++x) {
      const std::uint8_t* p = pixel(x, y);
      at(0, x, y) = byteOf(16.0 + (65.481 * p[0] + 128.553 * p[1] + 24.966 * p[2]) / 255.0);
    }
  for (int y = 0; y < picture.height; y += 2)
    for (int x = 0; x < picture.width; x += 2) {
      std::array<double, 3> sum{};  // of four pixels
      for (const std::uint8_t* p :
           {pixel(x, y), pixel(x + 1, y), pixel(x, y + 1), pixel(x + 1, y + 1)})
        for (std::size_t i = 0; i < 3; ++i)
          sum[i] += p[i];
      const auto& [r, g, b] = sum;
      at(1, x / 2, y / 2) = byteOf(128.0 + (-37.797 * r - 74.203 * g + 112.0 * b) / (4.0 * 255.0));
      at(2, x / 2, y / 2) = byteOf(128.0 + (112.0 * r - 93.786 * g - 18.214 * b) / (4.0 * 255.0));
    }
}

}  // namespace

struct VideoWriter::Encoder {
  std::unique_ptr<AVFormatContext, CloseFormat> format;
  std::unique_ptr<AVCodecContext, FreeCodec> codec;
  std::unique_ptr<AVFrame, FreeFrame> frame{av_frame_alloc()};
  std::unique_ptr<AVPacket, FreePacket> packet{av_packet_alloc()};
  AVStream* stream = nullptr;  // of the format
};

bool canWriteVideo() {
  return encoderOfThisMachine() != nullptr;
}

VideoWriter::VideoWriter(std::string path, int width, int height, double framesPerSecond)
    : path_(std::move(path)),
      temporary_(path_ + ".tmp" + std::to_string(getpid())),
      encoder_(std::make_unique<Encoder>()) {
  if (width < 2 || height < 2 || width % 2 != 0 || height % 2 != 0 || !(framesPerSecond > 0.0))
    throw std::invalid_argument("VideoWriter: needs an even width and height, and a rate");
  const AVCodec* codec = encoderOfThisMachine();
  if (codec == nullptr)
    throw std::runtime_error("there is no encoder of H.264 or MPEG-4 on this machine");
  av_log_set_level(AV_LOG_ERROR);  // x264 prints its statistics otherwise
  encoder_->codec.reset(avcodec_alloc_context3(codec));
  encoder_->codec->width = width;
  encoder_->codec->height = height;
  open(framesPerSecond);
}

VideoWriter::~VideoWriter() {
  if (!encoder_)
    return;
  encoder_.reset();
  std::error_code ignored;
  fs::remove(temporary_, ignored);
}

void VideoWriter::open(double framesPerSecond) {
  AVFormatContext* format = nullptr;
  int error = avformat_alloc_output_context2(&format, nullptr, "mp4", temporary_.c_str());
  if (error < 0)
    fail(error);
  encoder_->format.reset(format);
  format->flags |= AVFMT_FLAG_BITEXACT;  // no version of the library in the file
  constexpr int kLargestPart = 100000;
  AVCodecContext& codec = *encoder_->codec;
  codec.time_base = av_inv_q(av_d2q(framesPerSecond, kLargestPart));
  codec.pix_fmt = AV_PIX_FMT_YUV420P;
  codec.colorspace = AVCOL_SPC_SMPTE170M;
  codec.color_range = AVCOL_RANGE_MPEG;
  codec.thread_count = 1;
  codec.flags |= AV_CODEC_FLAG_GLOBAL_HEADER | AV_CODEC_FLAG_BITEXACT;
  codec.bit_rate = 4000000;  // for encoders that know no quality
  AVDictionary* options = nullptr;
  av_dict_set(&options, "preset", "veryfast", 0);
  av_dict_set(&options, "crf", "20", 0);
  error = avcodec_open2(&codec, codec.codec, &options);
  av_dict_free(&options);
  if (error < 0)
    fail(error);
  encoder_->stream = avformat_new_stream(format, nullptr);
  encoder_->stream->time_base = codec.time_base;
  avcodec_parameters_from_context(encoder_->stream->codecpar, &codec);
  AVFrame& frame = *encoder_->frame;
  frame.format = codec.pix_fmt;
  frame.width = codec.width;
  frame.height = codec.height;
  frame.pts = 0;
  error = av_frame_get_buffer(&frame, 0);
  if (error >= 0)
    error = avio_open(&format->pb, temporary_.c_str(), AVIO_FLAG_WRITE);
  if (error >= 0)
    error = avformat_write_header(format, nullptr);
  if (error < 0)
    fail(error);
}

void VideoWriter::add(const avatar::ColorImage& picture) {
  if (!encoder_)
    throw std::invalid_argument("VideoWriter: " + path_ + " has been written already");
  AVFrame& frame = *encoder_->frame;
  if (picture.width != frame.width || picture.height != frame.height)
    throw std::invalid_argument("VideoWriter: all pictures have one size");
  // The encoder may still hold the picture before.
  const int error = av_frame_make_writable(&frame);
  if (error < 0)
    fail(error);
  convert(picture, frame);
  encode(false);
  ++frame.pts;
}

void VideoWriter::encode(bool flush) {
  AVCodecContext* codec = encoder_->codec.get();
  int error = avcodec_send_frame(codec, flush ? nullptr : encoder_->frame.get());
  AVPacket* packet = encoder_->packet.get();
  while (error >= 0) {
    error = avcodec_receive_packet(codec, packet);
    if (error == AVERROR(EAGAIN) || error == AVERROR_EOF)
      return;
    if (error >= 0) {
      packet->duration = 1;
      av_packet_rescale_ts(packet, codec->time_base, encoder_->stream->time_base);
      error = av_interleaved_write_frame(encoder_->format.get(), packet);
    }
  }
  fail(error);
}

void VideoWriter::finish() {
  if (!encoder_)
    throw std::invalid_argument("VideoWriter: " + path_ + " has been written already");
  encode(true);
  int error = av_write_trailer(encoder_->format.get());
  // Closing writes what is still in memory, so that a full disk may show only now.
  const int closing = avio_closep(&encoder_->format->pb);
  error = error < 0 ? error : closing;
  if (error < 0)
    fail(error);
  std::error_code renaming;
  fs::rename(temporary_, path_, renaming);
  if (renaming)
    fail(AVERROR(renaming.value()));
  encoder_.reset();
}

void VideoWriter::fail(int error) const {
  std::error_code ignored;
  fs::remove(temporary_, ignored);
  std::array<char, AV_ERROR_MAX_STRING_SIZE> text{};
  av_strerror(error, text.data(), text.size());
  throw avatar::FileError(
      path_,
      "",
      std::string("cannot be written (") + text.data() +
          "); choose a folder with room that you may write to");
}

}  // namespace simulcap
