#include "src/output/video_file.h"

#include "avatar/io/file_error.h"
#include "tests/support/temporary_folder.h"

#include <gtest/gtest.h>

extern "C" {
#include <libavcodec/avcodec.h>
#include <libavformat/avformat.h>
}

#include <array>
#include <fstream>
#include <sstream>
#include <vector>

namespace simulcap {
namespace {

avatar::ColorImage plain(int width, int height, std::array<std::uint8_t, 3> color) {
  avatar::ColorImage image{width, height, {}};
  for (int i = 0; i < width * height; ++i)
    image.rgb.insert(image.rgb.end(), color.begin(), color.end());
  return image;
}

std::string videoBytes(const std::string& path) {
  std::ostringstream bytes;
  bytes << std::ifstream(path, std::ios::binary).rdbuf();
  return bytes.str();
}

struct DecodedFrame {
  int width = 0, height = 0;
  double seconds = 0.0;
  std::array<int, 3> yuv{};  ///< in the middle
};

std::vector<DecodedFrame> decoded(const std::string& path) {
  AVFormatContext* format = nullptr;
  EXPECT_EQ(avformat_open_input(&format, path.c_str(), nullptr, nullptr), 0);
  EXPECT_GE(avformat_find_stream_info(format, nullptr), 0);
  const AVStream* stream = format->streams[0];
  const AVCodec* codec = avcodec_find_decoder(stream->codecpar->codec_id);
  AVCodecContext* decoder = avcodec_alloc_context3(codec);
  avcodec_parameters_to_context(decoder, stream->codecpar);
  EXPECT_EQ(avcodec_open2(decoder, codec, nullptr), 0);
  AVPacket* packet = av_packet_alloc();
  AVFrame* frame = av_frame_alloc();
  std::vector<DecodedFrame> frames;
  const auto receive = [&] {
    while (avcodec_receive_frame(decoder, frame) == 0) {
      const int x = frame->width / 2, y = frame->height / 2;
      frames.push_back(
          {frame->width,
           frame->height,
           static_cast<double>(frame->pts) * av_q2d(stream->time_base),
           {frame->data[0][y * frame->linesize[0] + x],
            frame->data[1][y / 2 * frame->linesize[1] + x / 2],
            frame->data[2][y / 2 * frame->linesize[2] + x / 2]}});
    }
  };
  while (av_read_frame(format, packet) >= 0) {
    avcodec_send_packet(decoder, packet);
    av_packet_unref(packet);
    receive();
  }
  avcodec_send_packet(decoder, nullptr);
  receive();
  av_frame_free(&frame);
  av_packet_free(&packet);
  avcodec_free_context(&decoder);
  avformat_close_input(&format);
  return frames;
}

void writeColors(const std::string& path) {
  VideoWriter video(path, 64, 48, 25.0);
  for (int i = 0; i < 5; ++i) {
    video.add(plain(64, 48, {255, 0, 0}));
    video.add(plain(64, 48, {0, 0, 255}));
  }
  video.finish();
}

TEST(VideoFile, ComesBackWithItsPicturesColorsAndTimes) {
  if (!canWriteVideo())
    GTEST_SKIP() << "no encoder";
  const avatar::test::TemporaryFolder folder;
  writeColors(folder.path("a.mp4"));
  const std::vector<DecodedFrame> frames = decoded(folder.path("a.mp4"));
  ASSERT_EQ(frames.size(), 10U);
  for (std::size_t i = 0; i < frames.size(); ++i) {
    EXPECT_EQ(frames[i].width, 64);
    EXPECT_EQ(frames[i].height, 48);
    EXPECT_NEAR(frames[i].seconds - frames[0].seconds, 0.04 * static_cast<double>(i), 1e-3);
    // BT.601's own figures for red and blue; what the encoder loses of a plain picture is little.
    const std::array<int, 3> expected =
        i % 2 == 0 ? std::array{81, 90, 240} : std::array{41, 240, 110};
    for (std::size_t channel = 0; channel < 3; ++channel)
      EXPECT_NEAR(frames[i].yuv[channel], expected[channel], 6) << i << ", " << channel;
  }
  writeColors(folder.path("b.mp4"));
  EXPECT_TRUE(videoBytes(folder.path("a.mp4")) == videoBytes(folder.path("b.mp4")));
}

TEST(VideoFile, IsWrittenWholeOrNotAtAll) {
  if (!canWriteVideo())
    GTEST_SKIP() << "no encoder";
  const avatar::test::TemporaryFolder folder;
  {
    VideoWriter video(folder.path("a.mp4"), 64, 48, 25.0);
    video.add(plain(64, 48, {0, 0, 0}));
    EXPECT_THROW(video.add(plain(32, 48, {0, 0, 0})), std::invalid_argument);
  }
  EXPECT_TRUE(std::filesystem::is_empty(folder.path()));
  EXPECT_THROW(VideoWriter(folder.path("none/a.mp4"), 64, 48, 25.0), avatar::FileError);
  EXPECT_THROW(VideoWriter(folder.path("a.mp4"), 63, 48, 25.0), std::invalid_argument);
}

}  // namespace
}  // namespace simulcap
