// SPDX-License-Identifier: Apache-2.0
// Films as MP4 files, encoded by the FFmpeg libraries.
#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <span>
#include <string>

namespace forest::io {

/// Takes pictures one by one. The file appears under its name when `finish` returns; an unfinished film leaves nothing.
/// H.264 where the installed FFmpeg can write it, else VP9, else MPEG-4. The same pictures give the same bytes.
class Film {
 public:
  /// @param frames_per_second  at least 1; width and height must be even
  Film(const std::filesystem::path& path, std::uint32_t width, std::uint32_t height, int frames_per_second);
  ~Film();
  Film(const Film&) = delete;
  Film& operator=(const Film&) = delete;

  /// @param pixels  as io/png.h has them
  void add(std::span<const std::uint8_t> pixels);
  void finish();
  std::string codec() const;  // "libx264"

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace forest::io
