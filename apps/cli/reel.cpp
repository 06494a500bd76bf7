// SPDX-License-Identifier: Apache-2.0
#include "apps/cli/reel.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include <fmt/format.h>

#include "forest/io/png.h"

#include "apps/cli/files.h"

namespace forest::cli {
namespace {

// Makes room for so many pictures: none of what they replace is anything else, and those of a longer film that was there before go.
void take_pictures(const std::filesystem::path& folder, std::size_t count) {
  std::error_code none;
  std::vector<std::filesystem::path> more;
  for (std::size_t i = 0;; ++i) {
    const std::filesystem::path picture = folder / fmt::format("{:05}.png", i);
    const bool there = std::filesystem::exists(picture, none);
    if (!there && i >= count) break;
    if (there) must_take(picture, png_picture);
    if (i >= count) more.push_back(picture);
  }
  for (const std::filesystem::path& picture : more) std::filesystem::remove(picture);
}

}  // namespace

Reel::Reel(const FilmPlan& plan, const std::filesystem::path& file, Progress& progress)
    : plan_(plan),
      count_(std::max(1, int(std::lround(plan.seconds * plan.frames_per_second)))),
      progress_(progress),
      film_(file, plan.width, plan.height, plan.frames_per_second) {
  if (!plan.pictures.empty()) {
    std::filesystem::create_directories(plan.pictures);
    take_pictures(plan.pictures, std::size_t(count_));
  }
  progress_.begin("filming", std::size_t(count_));
}

void Reel::add(const frame::Image& image) {
  figures_.covered += image.covered / count_;
  film_.add(image.pixels);
  if (!plan_.pictures.empty())
    io::write_png(plan_.pictures / fmt::format("{:05}.png", figures_.pictures), plan_.width, plan_.height,
                  image.pixels);
  ++figures_.pictures;
  progress_.advance();
}

FilmFigures Reel::finish() {
  film_.finish();
  progress_.end();
  figures_.seconds = milliseconds_since(start_) / 1000.;
  figures_.codec = film_.codec();
  return figures_;
}

}  // namespace forest::cli
