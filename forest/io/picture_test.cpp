// SPDX-License-Identifier: Apache-2.0
#include <filesystem>
#include <unistd.h>

#include <gtest/gtest.h>

extern "C" {
#include <libavcodec/avcodec.h>
#include <libavformat/avformat.h>
}

#include "forest/core/error.h"
#include "forest/core/file.h"
#include "forest/core/random.h"
#include "forest/io/film.h"
#include "forest/io/png.h"

namespace forest::io {
namespace {

std::filesystem::path folder() {
  const auto path =
      std::filesystem::temp_directory_path() / ("forest_picture_test_" + std::to_string(::getpid()));
  std::filesystem::create_directories(path);
  return path;
}

TEST(Png, IsReadBackPixelForPixel) {
  Random random(1);
  std::vector<std::uint8_t> pixels(33 * 17 * 4);
  for (auto& p : pixels) p = std::uint8_t(random());
  write_png(folder() / "a.png", 33, 17, pixels);
  const Picture back = read_png(folder() / "a.png");
  EXPECT_EQ(back.width, 33u);
  EXPECT_EQ(back.pixels, pixels);
  const std::string whole(MappedFile(folder() / "a.png").text());
  for (std::size_t size = 0; size < whole.size(); size += 7) {
    write_file(folder() / "b.png", whole.substr(0, size));
    try {
      read_png(folder() / "b.png");  // an error or a value, never a crash
    } catch (const InputError&) {
    }
  }
  EXPECT_THROW(write_png("/nowhere/a.png", 33, 17, pixels), Error);
  EXPECT_THROW(write_png(folder() / "c.png", 34, 17, pixels), Error);
}

// How many pictures a player shows, and for how many seconds.
std::pair<int, double> shown(const std::filesystem::path& path) {
  AVFormatContext* format = nullptr;
  if (avformat_open_input(&format, path.c_str(), nullptr, nullptr) < 0) return {0, 0.};
  avformat_find_stream_info(format, nullptr);
  AVStream* stream = format->streams[0];
  AVCodecContext* decoder = avcodec_alloc_context3(avcodec_find_decoder(stream->codecpar->codec_id));
  avcodec_parameters_to_context(decoder, stream->codecpar);
  avcodec_open2(decoder, nullptr, nullptr);
  AVPacket* packet = av_packet_alloc();
  AVFrame* picture = av_frame_alloc();
  int count = 0;
  for (bool more = true; more;) {
    more = av_read_frame(format, packet) >= 0;
    avcodec_send_packet(decoder, more ? packet : nullptr);
    if (more) av_packet_unref(packet);
    while (avcodec_receive_frame(decoder, picture) >= 0) ++count;
  }
  const double seconds = double(stream->duration) * av_q2d(stream->time_base);
  av_frame_free(&picture);
  av_packet_free(&packet);
  avcodec_free_context(&decoder);
  avformat_close_input(&format);
  return {count, seconds};
}

TEST(Film, IsAFileOnlyWhenFinishedAndTheSameEachTime) {
  const auto make = [](const std::filesystem::path& path, bool finish) {
    Film film(path, 64, 48, 25);
    std::vector<std::uint8_t> pixels(64 * 48 * 4);
    for (int f = 0; f < 12; ++f) {
      for (std::size_t i = 0; i < pixels.size(); ++i) pixels[i] = std::uint8_t(i * 3 + std::size_t(f) * 5);
      film.add(pixels);
    }
    for (const auto& entry :
         std::filesystem::directory_iterator(path.parent_path()))  // nothing that a kill would leave
      EXPECT_FALSE(entry.path().filename().string().starts_with("unfinished"));
    if (finish) film.finish();
  };
  make(folder() / "unfinished.mp4", false);
  EXPECT_FALSE(std::filesystem::exists(folder() / "unfinished.mp4"));
  make(folder() / "one.mp4", true);
  make(folder() / "two.mp4", true);
  EXPECT_EQ(shown(folder() / "one.mp4"), std::pair(12, 12 / 25.));
  EXPECT_EQ(MappedFile(folder() / "one.mp4").text(), MappedFile(folder() / "two.mp4").text());
  std::filesystem::create_symlink("one.mp4", folder() / "link.mp4");
  make(folder() / "link.mp4", true);
  EXPECT_TRUE(std::filesystem::is_symlink(folder() / "link.mp4"));
  make("/dev/null", true);
  EXPECT_TRUE(std::filesystem::is_character_file("/dev/null"));
  EXPECT_THROW(make("/dev/full", true), Error);
  std::size_t files = 0;
  for (const auto& entry : std::filesystem::directory_iterator(folder()))
    files += entry.path().filename().string().find(".mp4") != std::string::npos;
  EXPECT_EQ(files, 3u);  // nothing unfinished is left
  EXPECT_THROW(Film(folder() / "odd.mp4", 63, 48, 25), Error);
  EXPECT_THROW(Film("/nowhere/a.mp4", 64, 48, 25), Error);
}

}  // namespace
}  // namespace forest::io
