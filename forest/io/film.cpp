// SPDX-License-Identifier: Apache-2.0
#include "forest/io/film.h"

#include <algorithm>
#include <cstdio>
#include <exception>

extern "C" {
#include <libavcodec/avcodec.h>
#include <libavformat/avformat.h>
#include <libavutil/opt.h>
#include <libswscale/swscale.h>
}

#include "forest/core/error.h"
#include "forest/core/file.h"

namespace forest::io {
namespace {

struct Codec {
  const char* name;
  const char* option;  // quality, as the encoder calls it
  const char* value;
};
// In order of preference. Thin bright branches on a dark ground need a low quantizer.
constexpr Codec codecs[] = {{"libx264", "crf", "17"},
                            {"libopenh264", "b", "12000000"},
                            {"libvpx-vp9", "crf", "24"},
                            {"mpeg4", "b", "16000000"}};

}  // namespace

struct Film::State {
  NewFile file;
  std::filesystem::path path;
  std::uint32_t width, height;
  AVFormatContext* format = nullptr;
  AVCodecContext* encoder = nullptr;
  AVStream* stream = nullptr;
  AVFrame* frame = nullptr;
  AVPacket* packet = nullptr;
  SwsContext* colours = nullptr;
  std::int64_t count = 0;
  std::uint64_t at = 0, end = 0;  // where the muxer writes, and how far the file reaches
  std::exception_ptr refused;     // by the disk

  explicit State(const std::filesystem::path& wanted) : file(wanted), path(wanted) {}

  // The muxer writes into the file that has no name yet, so that a program that is killed leaves nothing behind.
  static int write(void* to, std::uint8_t* bytes, int size) {
    State& s = *static_cast<State*>(to);
    try {
      s.file.overwrite(s.at, std::as_bytes(std::span(bytes, std::size_t(size))));
    } catch (...) {  // not through FFmpeg
      s.refused = std::current_exception();
      return AVERROR(EIO);
    }
    s.at += std::uint64_t(size);
    s.end = std::max(s.end, s.at);
    return size;
  }
  static std::int64_t seek(void* to, std::int64_t offset, int whence) {
    State& s = *static_cast<State*>(to);
    if (whence & AVSEEK_SIZE) return std::int64_t(s.end);
    s.at = std::uint64_t(offset) + (whence == SEEK_CUR ? s.at : whence == SEEK_END ? s.end : 0);
    return std::int64_t(s.at);
  }
  void open() {
    constexpr int room = 1 << 16;
    auto* buffer = static_cast<unsigned char*>(av_malloc(room));
    format->pb = avio_alloc_context(buffer, room, 1, this, nullptr, &State::write, &State::seek);
    if (!format->pb) av_free(buffer), fail("made");
    format->flags |= AVFMT_FLAG_CUSTOM_IO;
  }

  [[noreturn]] void fail(const std::string& what, int code = 0) const {
    if (refused) std::rethrow_exception(refused);
    char reason[AV_ERROR_MAX_STRING_SIZE] = "";
    if (code) av_strerror(code, reason, sizeof reason);
    throw Error(path.string() + ": the film cannot be " + what +
                (code ? std::string(" (") + reason + ")" : "") +
                "; check that the folder exists, the disk has room and FFmpeg is whole");
  }

  void drain() {
    for (;;) {
      const int code = avcodec_receive_packet(encoder, packet);
      if (code == AVERROR(EAGAIN) || code == AVERROR_EOF) return;
      if (code < 0) fail("encoded", code);
      packet->duration = 1;  // else the last picture has none and players drop it
      av_packet_rescale_ts(packet, encoder->time_base, stream->time_base);
      packet->stream_index = stream->index;
      if (const int wrote = av_interleaved_write_frame(format, packet); wrote < 0) fail("written", wrote);
    }
  }

  ~State() {
    sws_freeContext(colours);
    av_packet_free(&packet);
    av_frame_free(&frame);
    avcodec_free_context(&encoder);
    if (format) {
      if (format->pb) av_freep(&format->pb->buffer), avio_context_free(&format->pb);
      avformat_free_context(format);
    }
  }
};

Film::Film(const std::filesystem::path& path, std::uint32_t width, std::uint32_t height,
           int frames_per_second)
    : state_(std::make_unique<State>(path)) {
  State& s = *state_;
  s.width = width, s.height = height;
  if (width % 2 || height % 2 || !width || !height) s.fail("made: its width and height must be even");
  av_log_set_level(AV_LOG_QUIET);
  if (const int code = avformat_alloc_output_context2(&s.format, nullptr, "mp4", nullptr); code < 0)
    s.fail("made", code);
  for (const Codec& row : codecs) {
    const AVCodec* codec = avcodec_find_encoder_by_name(row.name);
    if (!codec) continue;
    s.encoder = avcodec_alloc_context3(codec);
    s.encoder->width = int(width), s.encoder->height = int(height);
    s.encoder->time_base = {1, frames_per_second};
    s.encoder->framerate = {frames_per_second, 1};
    s.encoder->pix_fmt = AV_PIX_FMT_YUV420P;
    s.encoder->color_range = AVCOL_RANGE_MPEG;
    s.encoder->colorspace = AVCOL_SPC_BT709;
    s.encoder->color_primaries = AVCOL_PRI_BT709;
    s.encoder->color_trc = AVCOL_TRC_BT709;
    s.encoder->thread_count = 2;  // fixed: the bytes depend on it
    if (s.format->oformat->flags & AVFMT_GLOBALHEADER) s.encoder->flags |= AV_CODEC_FLAG_GLOBAL_HEADER;
    s.encoder->flags |= AV_CODEC_FLAG_BITEXACT;
    av_opt_set(s.encoder, row.option, row.value, AV_OPT_SEARCH_CHILDREN);
    av_opt_set(s.encoder, "preset", "veryfast", AV_OPT_SEARCH_CHILDREN);
    if (avcodec_open2(s.encoder, codec, nullptr) == 0) break;
    avcodec_free_context(&s.encoder);
  }
  if (!s.encoder) s.fail("encoded: the installed FFmpeg has no encoder for MP4");
  s.stream = avformat_new_stream(s.format, nullptr);
  s.stream->time_base = s.encoder->time_base;
  s.format->flags |= AVFMT_FLAG_BITEXACT;
  avcodec_parameters_from_context(s.stream->codecpar, s.encoder);
  s.open();
  if (const int code = avformat_write_header(s.format, nullptr); code < 0) s.fail("written", code);
  s.packet = av_packet_alloc();
  s.frame = av_frame_alloc();
  s.frame->format = s.encoder->pix_fmt, s.frame->width = int(width), s.frame->height = int(height);
  if (av_frame_get_buffer(s.frame, 0) < 0) s.fail("made");
  s.colours = sws_getContext(int(width), int(height), AV_PIX_FMT_RGBA, int(width), int(height),
                             AV_PIX_FMT_YUV420P, SWS_BICUBIC, nullptr, nullptr, nullptr);
  if (!s.colours) s.fail("made");
  sws_setColorspaceDetails(s.colours, sws_getCoefficients(SWS_CS_ITU709), 1,
                           sws_getCoefficients(SWS_CS_ITU709), 0, 0, 1 << 16, 1 << 16);
}

Film::~Film() = default;

void Film::add(std::span<const std::uint8_t> pixels) {
  State& s = *state_;
  if (pixels.size() != std::size_t(s.width) * s.height * 4)
    throw Error("a picture of the film needs width × height × 4 bytes");
  if (const int code = av_frame_make_writable(s.frame); code < 0) s.fail("encoded", code);
  const std::uint8_t* rows[] = {pixels.data()};
  const int stride[] = {int(s.width) * 4};
  sws_scale(s.colours, rows, stride, 0, int(s.height), s.frame->data, s.frame->linesize);
  s.frame->pts = s.count++;
  if (const int code = avcodec_send_frame(s.encoder, s.frame); code < 0) s.fail("encoded", code);
  s.drain();
}

void Film::finish() {
  State& s = *state_;
  if (const int code = avcodec_send_frame(s.encoder, nullptr); code < 0) s.fail("encoded", code);
  s.drain();
  if (const int code = av_write_trailer(s.format); code < 0) s.fail("written", code);
  avio_flush(s.format->pb);
  if (const int code = s.format->pb->error; code < 0) s.fail("written", code);
  s.file.commit();
}

std::string Film::codec() const { return state_->encoder->codec->name; }

}  // namespace forest::io
