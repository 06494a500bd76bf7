// SPDX-License-Identifier: Apache-2.0
#include "forest/scene/scanpath.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include <fmt/format.h>

#include "forest/core/error.h"
#include "forest/core/number.h"

namespace forest::scene {
namespace {

constexpr std::string_view blanks = " \t\r\"";
std::string_view trimmed(std::string_view text) {
  const auto first = text.find_first_not_of(blanks);
  return first == text.npos ? "" : text.substr(first, text.find_last_not_of(blanks) - first + 1);
}

std::vector<std::string_view> cells_of(std::string_view line) {
  std::vector<std::string_view> cells;
  for (std::size_t from = 0; from <= line.size();) {
    const std::size_t end = std::min(line.find_first_of(",;", from), line.size());
    cells.push_back(trimmed(line.substr(from, end - from)));
    from = end + 1;
  }
  return cells;
}

std::optional<double> number_in(std::string_view cell) {
  const auto value = number_of<double>(cell);
  return value && std::isfinite(*value) ? value : std::nullopt;
}

bool nothing(std::string_view cell) { return cell.empty() || cell == "nan" || cell == "NaN" || cell == "NA"; }

}  // namespace

Scanpath::Scanpath(std::vector<Fixation> samples) : samples_(std::move(samples)) {
  if (samples_.empty()) throw Error("a scanpath needs at least one sample");
  if (!std::ranges::is_sorted(samples_, {}, &Fixation::time))
    throw Error("the samples of a scanpath must be in the order of time");
}

Vec2 Scanpath::at(double time) const {
  const auto after = std::ranges::upper_bound(samples_, samples_.front().time + time, {}, &Fixation::time);
  return (after == samples_.begin() ? after : after - 1)->place;
}

double Scanpath::duration() const { return samples_.back().time - samples_.front().time; }

Scanpath parse_scanpath(std::string_view text, const std::string& name) {
  std::vector<Fixation> samples;
  std::optional<double> closed;  // since when the eyes were, before the first sample
  double last = -std::numeric_limits<double>::infinity();  // the time of the line before
  std::optional<Vec2> size;                                // of the recorded picture, pixels
  bool pixels = false, begun = false;
  std::size_t line_number = 0;
  if (constexpr std::string_view mark = "\xef\xbb\xbf"; text.starts_with(mark))
    text.remove_prefix(mark.size());
  const auto refuse = [&](const std::string& sentence) { throw InputError(name, line_number, sentence); };
  while (!text.empty()) {
    const std::size_t end = std::min(text.find('\n'), text.size());
    const std::string_view line = trimmed(text.substr(0, end));
    text.remove_prefix(std::min(end + 1, text.size()));
    ++line_number;
    if (line.empty()) continue;
    if (line[0] == '#') {
      const std::string_view word = trimmed(line.substr(1));
      if (!word.starts_with("size ")) continue;
      const std::string_view numbers = trimmed(word.substr(5));
      const std::size_t cross = std::min(numbers.find('x'), numbers.size());
      const auto width = number_in(numbers.substr(0, cross)),
                 height = number_in(numbers.substr(std::min(cross + 1, numbers.size())));
      if (!width || !height || !(*width >= 1.) || !(*height >= 1.))
        refuse(fmt::format("'{}' is no size of a picture; write for example # size 1920x1080", numbers));
      size = Vec2(float(*width), float(*height));
      continue;
    }
    const auto cells = cells_of(line);
    if (!begun && cells.size() == 3 && cells[0].starts_with("time")) {
      begun = true;
      pixels = cells[1] == "x_px" && cells[2] == "y_px";
      if (!pixels && (cells[1] != "x" || cells[2] != "y"))
        refuse("the columns must be time,x,y (shares of the picture) or time,x_px,y_px (pixels)");
      if (pixels && !size)
        refuse("pixels of a picture of what size? write it in a line before, for example # size 1920x1080");
      continue;
    }
    begun = true;
    if (cells.size() != 3) refuse(fmt::format("has {} columns instead of three: time, x, y", cells.size()));
    const auto time = number_in(cells[0]);
    if (!time) refuse(fmt::format("'{}' is no time in ms", cells[0]));
    if (*time < last)
      refuse(fmt::format("{} ms is earlier than the sample before; sort the lines by time", cells[0]));
    last = *time;
    if (nothing(cells[1]) && nothing(cells[2])) {  // a blink
      if (samples.empty())
        closed = closed.value_or(*time);
      else
        samples.push_back({*time, samples.back().place});
      continue;
    }
    const auto x = number_in(cells[1]), y = number_in(cells[2]);
    if (!x || !y)
      refuse(
          fmt::format("'{}, {}' is no place of the gaze; leave both empty in a blink", cells[1], cells[2]));
    Vec2 place{float(*x), float(*y)};
    if (pixels) place.array() /= size->array();
    constexpr float far = 3.f;  // what looks beside the screen is recorded, too
    if (!(place.array().abs() <= far).all())
      refuse(fmt::format(
          "{}, {} lies three pictures or more beside the picture; are these pixels? name the columns "
          "x_px and y_px then",
          cells[1], cells[2]));
    if (samples.empty() && closed) samples.push_back({*closed, place});
    samples.push_back({*time, place});
  }
  if (samples.empty())
    throw InputError(name, 0, "holds no sample of the gaze; write time in ms, x, y on each line");
  return Scanpath(std::move(samples));
}

}  // namespace forest::scene
