// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <charconv>
#include <cmath>
#include <numbers>
#include <optional>
#include <vector>

#include <fmt/format.h>

#include "forest/core/error.h"
#include "forest/io/nts.h"
#include "forest/io/nts_words.h"
#include "forest/io/placed_words.h"
#include "forest/io/swc_rows.h"

namespace forest::io {
namespace {

constexpr int circle_points = 12;
constexpr std::size_t most_records = 999999;
constexpr float at_point = .05f;  // half a step: a spine this near to a point sits on it, µm

bool same_place(const Point& a, const Point& b) { return a.x == b.x && a.y == b.y && a.z == b.z; }

std::int32_t tag_of(const Section& section) {
  return swc_kind(section.tag) == section.kind ? section.tag : std::int32_t(section.kind);
}

/// One decimal, and no zero before the point.
std::string decimal(float value) {
  std::array<char, 32> digits;
  const auto end =
      std::to_chars(digits.data(), digits.data() + digits.size(), double(value), std::chars_format::fixed, 1);
  std::string text(digits.data(), end.ptr);
  if (text == "-0.0") text.erase(0, 1);
  if (text.starts_with("0.")) text.erase(0, 1);
  if (text.starts_with("-0.")) text.erase(1, 1);
  return text;
}

struct Record {
  NtsRole role;
  std::string_view code;
  Point point;
  std::int32_t tag = 0;
  std::string behind = {};  // name and attachment
};

class Writer {
 public:
  explicit Writer(const Morphology& m) : m_(m) {}

  std::string write() {
    header();  // first, since outlines among the annotations become records
    soma();
    std::vector<const Spine*> spines;
    for (const Spine& spine : m_.spines()) spines.push_back(&spine);
    std::ranges::stable_sort(spines, [](const Spine* a, const Spine* b) {
      return a->section != b->section ? a->section.value() < b->section.value() : a->position < b->position;
    });
    std::span<const Spine* const> rest(spines);
    for (std::size_t s = 0; s < m_.sections().size(); ++s) {
      const auto own =
          std::ranges::find_if(rest, [&](const Spine* spine) { return spine->section.value() != s; });
      section(SectionId(s), rest.first(std::size_t(own - rest.begin())));
      rest = rest.subspan(std::size_t(own - rest.begin()));
    }
    place_words();
    if (records_.size() > most_records)
      throw LimitError(fmt::format("the neuron has {} points, NTS counts to {}; choose another format",
                                   records_.size(), most_records));
    return text();
  }

 private:
  // Annotations --------------------------------------------------------------------------------------------

  void header() {
    for (const auto& [key, value] : m_.annotations()) {
      const std::string_view trimmed = nts_comment(value);
      if (key == "Text" && text_line_.empty() && trimmed == value && !value.empty() &&
          value != "unassigned" && value.find_first_of("\r\n") == value.npos)
        text_line_ = value;
      else if (key == "eutectic" && is_word(value))
        words_.push_back(value);
      else if (!((key == "outline" || key == "dots") &&
                 outline(key == "outline" ? NtsRole::outline : NtsRole::dots, value)))
        comment(key == "comment" ? value : key + ' ' + value);
    }
  }

  /// A comment line for each line of the text, written as it will be read.
  void comment(std::string_view value) {
    while (true) {
      const std::size_t end = std::min(value.find_first_of("\r\n"), value.size());
      const std::string_view said = nts_comment(value.substr(0, end));
      const auto [key, rest] = swc_comment(said);
      if (!said.empty() && key != nts_sphere_key)
        comments_ += key == "comment" ? fmt::format("# {}\n", said) : fmt::format("# {} {}\n", key, rest);
      if (end == value.size()) return;
      value.remove_prefix(end + 1);
    }
  }

  /// "CODE [name [attachment [number]]] x y z", as the reader makes them.
  static bool is_word(std::string_view value) {
    if (value.find_first_of("\r\n\t\v\f") != value.npos || value.find("  ") != value.npos) return false;
    const auto blanks = std::ranges::count(value, ' ');
    if (blanks < 3 || blanks > 6 || value.ends_with(' ')) return false;
    const NtsCode* code = find_nts_code(value.substr(0, value.find(' ')));
    if (!code) return false;
    if (code->role == NtsRole::swelling || code->role == NtsRole::end)
      return blanks == 3 && code->code != "NE";
    if (code->role != NtsRole::origin) return false;
    const std::string_view last = last_name(value);
    return blanks == 3 ? code->code != "MTO" : last != nts_no_name[std::size_t(blanks - 4)];
  }
  /// Where the place begins.
  static std::size_t place_at(std::string_view value) {
    std::size_t at = value.size();
    for (int k = 0; k < 3; ++k) at = value.rfind(' ', at - 1);
    return at + 1;
  }
  static std::string_view last_name(std::string_view value) {
    const std::string_view names = value.substr(0, place_at(value) - 1);
    return names.substr(names.rfind(' ') + 1);
  }

  bool outline(NtsRole role, std::string_view value) {
    std::vector<Point> points;
    while (!value.empty()) {
      std::array<float, 4> v{};
      for (std::size_t i = 0; i < 4; ++i) {
        const std::size_t end = std::min(value.find_first_of(i < 3 ? " " : ";"), value.size());
        const auto [stop, error] = std::from_chars(value.data(), value.data() + end, v[i]);
        const float most = i < 3 ? nts_keeps.largest_place : nts_keeps.largest_diameter;
        if (error != std::errc() || stop != value.data() + end || !(std::abs(v[i]) <= most)) return false;
        value.remove_prefix(std::min(end + 1, value.size()));
      }
      if (v[3] < 0.f) return false;
      if (value.starts_with(' ')) value.remove_prefix(1);
      points.push_back({v[0], v[1], v[2], .5f * v[3]});
    }
    outline(role, points);
    return !points.empty();
  }

  void outline(NtsRole role, std::span<const Point> points) {
    const auto start = std::ranges::find_if(nts_codes, [&](const NtsCode& row) { return row.role == role; });
    for (std::size_t i = 0; i < points.size(); ++i) {
      const bool last = i + 1 == points.size();
      records_.push_back({role, start[i == 0 ? 0 : last ? 2 : 1].code, points[i]});
    }
  }

  /// Codes and names that a file had, put back where a point of their kind is at their place.
  void place_words() {
    if (words_.empty()) return;
    PlacedWords origins, swellings, ends;
    const auto words_for = [&](NtsRole role) -> PlacedWords* {
      return role == NtsRole::origin                               ? &origins
             : role == NtsRole::point || role == NtsRole::swelling ? &swellings
             : role == NtsRole::end                                ? &ends
                                                                   : nullptr;
    };
    for (const Record& record : records_)
      if (PlacedWords* words = words_for(record.role)) words->offer(record.point);
    for (const std::string& value : words_) {
      const NtsCode* code = find_nts_code(std::string_view(value).substr(0, value.find(' ')));
      const std::size_t at = place_at(value);
      if (!words_for(code->role)->add(value.substr(at), value.substr(0, at - 1)))
        comment("eutectic " + value);
    }
    for (Record& record : records_)
      if (PlacedWords* words = words_for(record.role))
        if (const std::string word = words->take(record.point); !word.empty()) {
          const std::size_t end = std::min(word.find(' '), word.size());
          record.code = find_nts_code(std::string_view(word).substr(0, end))->code;
          if (end < word.size()) record.behind = word.substr(end + 1);
        }
  }

  // Points -------------------------------------------------------------------------------------------------

  void soma() {
    const Soma& soma = m_.soma();
    if (soma.kind == SomaKind::none) return;
    if (soma.kind == SomaKind::contours) {
      for (std::size_t i = 0; i < soma.contour_starts.size(); ++i) outline(NtsRole::soma, soma.contour(i));
      return;
    }
    const Point sphere = soma.sphere();
    sphere_ = fmt::format("# {}", nts_sphere_key);
    for (const float number : {sphere.x, sphere.y, sphere.z, sphere.radius})
      sphere_ += ' ', append_number(sphere_, number);
    sphere_ += '\n';
    std::vector<Point> circle;
    const auto inside = [](float value) {
      return std::clamp(value, -nts_keeps.largest_place, nts_keeps.largest_place);
    };
    for (int i = 0; i < circle_points; ++i) {
      const double angle = 2. * std::numbers::pi * i / circle_points;
      circle.push_back({inside(sphere.x + sphere.radius * float(std::cos(angle))),
                        inside(sphere.y + sphere.radius * float(std::sin(angle))), sphere.z, 0.f});
    }
    outline(NtsRole::soma, circle);
  }

  void section(SectionId id, std::span<const Spine* const> spines) {
    const Section& s = m_.section(id);
    const auto own = m_.points(id);
    const std::size_t daughters = m_.children(id).size();
    const bool root = !s.parent.valid();
    std::vector<Point> points(own.begin(), own.end());
    if (root) {
      // A branch point on the origin adds no point, so that a root of one point can branch; here two are meant.
      if (points.size() == 1 && !spines.empty()) points.push_back(points[0]);
      if (points.size() == 2 && daughters > 1 && points[0] == points[1]) points.push_back(points[0]);
    } else {
      // The branch point is written by the parent. It is repeated where the reader could not tell this section's first
      // point from it.
      const bool still = same_place(points[0], points[1]);
      const bool said =
          points[0].radius != points[1].radius || (still && (points.size() > 2 || daughters > 1));
      if (!said) points.erase(points.begin());
    }
    const std::int32_t tag = tag_of(s);
    const auto put = [&](NtsRole role, const Point& point) {
      const auto code = std::ranges::find(nts_codes, role, &NtsCode::role);
      records_.push_back({role, code->code, point, tag});
    };

    Point before = own[0];
    float at = 0.f;  // path distance of `before`
    std::size_t spine = 0;
    float length = 0.f;
    for (std::size_t k = 0; k < points.size(); ++k)
      length += (points[k].position() - (k ? points[k - 1] : own[0]).position()).norm();
    const auto position = [&] { return std::clamp(spines[spine]->position, 0.f, length); };
    for (std::size_t k = 0; k < points.size(); ++k) {
      const bool origin = root && k == 0, last = k + 1 == points.size() && !origin;
      const float step = (points[k].position() - before.position()).norm(), here = at + step;
      for (; !origin && spine < spines.size() && (position() < here - at_point || (last && daughters != 1));
           ++spine) {
        const float t = step > 0.f ? std::clamp((position() - at) / step, 0.f, 1.f) : 0.f;
        const Vec3 place = before.position() + t * (points[k].position() - before.position());
        put(NtsRole::spine,
            {place.x(), place.y(), place.z(), before.radius + t * (points[k].radius - before.radius)});
      }
      if (origin) {
        put(NtsRole::origin, points[k]);
      } else if (last && daughters == 0) {
        put(NtsRole::end, points[k]);
      } else if (last && daughters > 1) {
        put(NtsRole::branch, points[k]);
      } else {
        const bool sits = spine < spines.size() && position() <= here + at_point;
        put(sits ? NtsRole::spine : NtsRole::point, points[k]);
        spine += sits;
        if (last)  // an only daughter of another kind follows
          for (; spine < spines.size(); ++spine) put(NtsRole::spine, points[k]);
      }
      before = points[k], at = here;
    }
    if (points.size() == 1 && root && daughters > 1) put(NtsRole::branch, points[0]);
    for (std::size_t k = 2; k < daughters; ++k) put(NtsRole::branch, points.back());
  }

  // Text ---------------------------------------------------------------------------------------------------

  std::string text() const {
    const auto trees = std::ranges::count(records_, NtsRole::origin, &Record::role);
    std::string text =
        fmt::format("{}\n{}{}No. points {:6}\nNo. trees  {:6}\nText  {}\n\n", nts_marker, sphere_, comments_,
                    records_.size(), trees, text_line_.empty() ? "unassigned" : text_line_);
    text += " Point  Type  Tag      X       Y       Z  Thick   Name    Attachment\n\n";
    text.reserve(text.size() + 48 * records_.size());
    std::size_t number = 0;
    for (const Record& r : records_) {
      text += fmt::format("{:6}  {:>3}{:5}{:>8}{:>8}{:>8}{:>6}", ++number, r.code, r.tag, decimal(r.point.x),
                          decimal(r.point.y), decimal(r.point.z), decimal(2.f * r.point.radius));
      if (r.code == "SOS" && r.behind.empty()) text += "  soma    ------     0";
      if (r.role == NtsRole::origin) {
        std::array<std::string_view, 3> names = nts_no_name;
        std::string_view rest = r.behind;
        for (std::size_t i = 0; i < names.size() && !rest.empty(); ++i) {
          names[i] = rest.substr(0, rest.find(' '));
          rest.remove_prefix(std::min(names[i].size() + 1, rest.size()));
        }
        text += fmt::format("  {:<6}  {:<6} {:>5}", names[0], names[1], names[2]);
      }
      text += '\n';
    }
    return text;
  }

  const Morphology& m_;
  std::string sphere_, comments_, text_line_;
  std::vector<std::string> words_;
  std::vector<Record> records_;
};

}  // namespace

std::string write_nts(const Morphology& morphology) {
  check_fits(morphology, nts_keeps);
  const Morphology left = as_kept(morphology, nts_keeps);
  return Writer(left).write();
}

}  // namespace forest::io
