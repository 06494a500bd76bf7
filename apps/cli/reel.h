// SPDX-License-Identifier: Apache-2.0
// A film in the making: pictures one after the other, into an MP4 file and a folder.
#pragma once

#include <filesystem>

#include "forest/core/progress.h"
#include "forest/io/film.h"

#include "apps/cli/artist.h"
#include "apps/cli/clock.h"

namespace forest::cli {

class Reel {
 public:
  /// Begins to tell of it. `plan` and `progress` must outlive it.
  Reel(const FilmPlan& plan, const std::filesystem::path& file, Progress& progress);

  int count() const { return count_; }  // pictures that are wanted
  void add(const frame::Image& image);
  double covered() const { return figures_.covered; }
  FilmFigures finish();

 private:
  const FilmPlan& plan_;
  int count_;
  Progress& progress_;
  io::Film film_;
  FilmFigures figures_;
  Clock::time_point start_ = Clock::now();
};

}  // namespace forest::cli
