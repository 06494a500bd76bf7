// SPDX-License-Identifier: Apache-2.0
// A recorded gaze: where somebody looked, and when. What an eye tracker's export is brought into, and what replays it.
#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "forest/core/vec.h"

namespace forest::scene {

struct Fixation {
  double time = 0.;  // ms from the begin of the recording's clock
  Vec2 place;  // shares of the picture's width and height, from its upper left corner; may lie beside it
};

class Scanpath {
 public:
  /// @param samples  at least one, in the order of time; throws Error otherwise
  explicit Scanpath(std::vector<Fixation> samples);

  /// Where the gaze is at a time, ms from the first sample: that of the last sample before. Eyes jump, so nothing is between.
  Vec2 at(double time) const;
  double duration() const;  // ms from the first sample to the last
  const std::vector<Fixation>& samples() const { return samples_; }

 private:
  std::vector<Fixation> samples_;
};

/// CSV: time in ms, x, y on each line. A header names the columns `time,x,y` for shares of the picture or `time,x_px,y_px` for
/// pixels of a picture of `# size 1920x1080`, a line before it; without a header they are shares. Lines that begin with # and
/// empty ones are left out; an x and y left empty or nan is a blink, in which the gaze stays; before
/// the first place it is at that place.
/// Throws InputError with the line of the first bad one: no number, not finite, earlier than the one before.
Scanpath parse_scanpath(std::string_view text, const std::string& name = "scanpath");

}  // namespace forest::scene
