// SPDX-License-Identifier: Apache-2.0
#include "forest/io/nts.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <optional>
#include <utility>
#include <vector>

#include <fmt/format.h>

#include "forest/core/error.h"
#include "forest/core/number.h"
#include "forest/io/nts_words.h"
#include "forest/io/numbers.h"
#include "forest/io/oddity.h"
#include "forest/io/placed_words.h"
#include "forest/io/plain_text.h"
#include "forest/io/swc_rows.h"
#include "forest/io/traced_branch.h"
#include "forest/io/words.h"

namespace forest::io {
namespace {

enum class NtsOddity : std::uint8_t {
  byte_order_mark,
  columns,
  no_header,
  point_count,
  tree_count,
  late_comment,
  second_header,
  small_letters,
  unknown_code,
  negative_diameter,
  tag_change,
  point_without_origin,
  origin_alone,
  unfinished_branch,
  open_branches,
  outline_without_start,
  several_outlines,
  small_outline,
  count
};

constexpr std::array<Oddity, static_cast<std::size_t>(NtsOddity::count)> table{{
    {"byte-order-mark", false, "the mark is skipped"},
    {"columns", false, "read at the blanks between them"},
    {"no-header", false, "read from the first record"},
    {"point-count", false, "the records that are there are read",
     "get the whole file, or correct the number"},
    {"tree-count", false, "the trees that are there are read", "get the whole file, or correct the number"},
    {"late-comment", false, "kept with the comments of the header"},
    {"second-header", true, "read as one neuron", "split the file if it holds several cells"},
    {"small-letters", false, "read like capital ones"},
    {"unknown-code", true, "read as a continuation point", "write the code that is meant"},
    {"negative-diameter", true, "read as that of the point before", "measure it where thickness matters"},
    {"tag-change", true, "the branch keeps the tag of its first point",
     "nothing, if the tag marks points and no kind"},
    {"point-without-origin", true, "read as a tree of its own", "attach it to the branch it was traced from"},
    {"origin-alone", true, "read as a neurite of one point", "nothing, if only its origin was traced"},
    {"unfinished-branch", true, "read as far as it goes",
     "get the whole file, or trace the branch to its end"},
    {"open-branches", true, "what was not traced is left out", "get the whole file, or trace them"},
    {"outline-without-start", true, "an outline begins here"},
    {"several-outlines", false, "read as one soma, a stack of outlines",
     "nothing, if they are outlines of one soma; split the file if it holds several cells"},
    {"small-outline", false, "read as a sphere of its size", "trace the outline with three points or more"},
}};

constexpr std::string_view layout =
    "a record is: number code tag x y z thickness, in columns 0-5, 8-10, 11-15, 16-23, "
    "24-31, 32-39, 40-45";

template <class Number>
bool parse(std::string_view text, Number& value) {
  const auto found = number_of<Number>(text);
  if (found) value = *found;
  return found.has_value();
}

bool same_place(const Point& a, const Point& b) { return a.x == b.x && a.y == b.y && a.z == b.z; }

struct Record {
  std::string_view code;
  std::int64_t number = 0, tag = 0;
  std::array<float, 4> v{};
  std::string_view rest;  // behind the thickness
  bool by_blanks = false;
};

std::string_view field(std::string_view line, std::size_t first, std::size_t last) {
  return first >= line.size() ? std::string_view{} : trimmed(line.substr(first, last - first + 1));
}

bool is_code(std::string_view text) {
  return !text.empty() && text.size() <= 3 &&
         std::ranges::all_of(text, [](char c) { return (c >= 'A' && c <= 'Z') || (c >= 'a' && c <= 'z'); });
}

/// In fixed columns fields may touch; edited files may have lost the columns. Where blanks part all fields, they decide.
std::optional<Record> record_of(std::string_view line) {
  Record r;
  std::array<std::string_view, 7> tokens;
  std::string_view rest = line;
  for (std::string_view& token : tokens) token = next_word(rest);
  const auto reads = [&](const std::array<std::string_view, 7>& fields) {
    bool good =
        parse(fields[0], r.number) && is_code(fields[1]) && (fields[2].empty() || parse(fields[2], r.tag));
    for (std::size_t i = 0; i < 4; ++i) good = good && parse(fields[i + 3], r.v[i]);
    r.code = fields[1];
    return good;
  };
  constexpr std::array<std::pair<std::size_t, std::size_t>, 7> columns{
      {{0, 5}, {8, 10}, {11, 15}, {16, 23}, {24, 31}, {32, 39}, {40, 45}}};
  std::array<std::string_view, 7> fields;
  for (std::size_t i = 0; i < fields.size(); ++i)
    fields[i] = field(line, columns[i].first, columns[i].second);
  if (!tokens.back().empty() && reads(tokens)) {
    r.by_blanks = fields != tokens;
    r.rest = trimmed(rest);
    return r;
  }
  if (!reads(fields)) return std::nullopt;
  r.rest = line.size() > 46 ? trimmed(line.substr(46)) : std::string_view{};
  return r;
}

bool same_start(std::string_view text, std::string_view lower) {
  return same_word(text.substr(0, lower.size()), lower);
}

class Reader {
 public:
  explicit Reader(const std::string& name) : name_(name), oddities_(table) {}

  ReadResult read(std::string_view bytes) {
    const PlainText plain = plain_text(bytes, name_);  // padding is usual: CP/M and DOS end files by Ctrl-Z
    if (plain.byte_order_mark)
      oddities_.add(NtsOddity::byte_order_mark, 1, "the file begins with a byte order mark");
    each_line(plain.text, [&](std::string_view line, std::size_t number) {
      line_ = number;
      if (const std::string_view text = trimmed(line); !text.empty()) this->line(line, text);
      return true;
    });
    finish_tree();
    if (records_ == 0 && !(to_the_letter_ && said_points_ == 0))
      throw InputError(name_, 0, fmt::format("holds no point; {}", layout));
    compare_counts();
    set_soma();
    finish_outline();
    for (const Spine& spine : spines_) builder_.add_spine(spine);
    for (auto& [key, value] : annotations_) builder_.annotate(std::move(key), std::move(value));
    return {builder_.build(), oddities_.take()};
  }

 private:
  // Lines --------------------------------------------------------------------------------------------------

  void line(std::string_view line, std::string_view text) {
    if (is_digit(text[0])) return record(line);
    if (line_ == 1 && text == nts_marker) {
      to_the_letter_ = true;
    } else if (same_start(text, "no. points")) {
      if (header_) oddities_.add(NtsOddity::second_header, line_, "another header begins");
      header_ = true;
      if (std::int64_t count = 0; parse(trimmed(text.substr(10)), count))
        said_points_ = said_points_.value_or(0) + count;
    } else if (same_start(text, "no. trees")) {
      if (std::int64_t count = 0; parse(trimmed(text.substr(9)), count))
        said_trees_ = said_trees_.value_or(0) + count;
    } else if (same_start(text, "point ") && text.find("Type") != text.npos) {
    } else if (same_start(text, "text ") && header_) {
      if (const std::string_view value = trimmed(text.substr(5)); value != "unassigned")
        annotations_.emplace_back("Text", value);
    } else {
      comment(text);
    }
  }

  void comment(std::string_view text) {
    if (records_ > 0) oddities_.add(NtsOddity::late_comment, line_, "a line of text among the records");
    text = nts_comment(text);
    if (text.empty()) return;
    const auto [key, value] = swc_comment(text);
    if (to_the_letter_ && key == nts_sphere_key)
      own_sphere(value);
    else
      annotations_.emplace_back(key, value);
  }

  void own_sphere(std::string_view text) {
    std::array<float, 4> v{};
    std::size_t count = 0;
    while (count < 4) {
      const std::size_t end = std::min(text.find(' '), text.size());
      if (!parse(text.substr(0, end), v[count]) || !std::isfinite(v[count])) break;
      ++count;
      text = trimmed(text.substr(end));
    }
    const Point sphere{v[0], v[1], v[2], v[3]};
    if (count < 4 || !text.empty() || sphere.radius < 0.f || too_large({sphere.x, sphere.y, sphere.z, 0.f}))
      throw InputError(name_, line_,
                       fmt::format("the comment {} does not hold four numbers; remove it", nts_sphere_key));
    sphere_ = sphere;
  }

  static bool too_large(const Point& p) {
    const auto inside = [](float value) { return std::abs(value) <= nts_keeps.largest_place; };
    return !inside(p.x) || !inside(p.y) || !inside(p.z) || !(2.f * p.radius <= nts_keeps.largest_diameter);
  }

  void record(std::string_view line) {
    const auto found = record_of(line);
    if (!found)
      throw InputError(name_, line_,
                       fmt::format("\"{}\" is no record; {}", shown(trimmed(line), 60), layout));
    Record r = *found;
    if (records_++ == 0 && !header_ && !to_the_letter_)
      oddities_.add(NtsOddity::no_header, line_, "records begin without \"No. points\"");
    if (r.by_blanks) oddities_.add(NtsOddity::columns, line_, "the numbers do not stand in their columns");
    if (r.v[3] < 0.f) {
      oddities_.add(NtsOddity::negative_diameter, line_,
                    [&] { return fmt::format("the thickness is {}", r.v[3]); });
      r.v[3] = 2.f * last_.radius;
    }
    const Point point{r.v[0], r.v[1], r.v[2], .5f * r.v[3]};
    if (too_large(point))
      throw InputError(
          name_, line_,
          fmt::format("{} {} {} {} lies outside of what the format can hold, places up to {} µm and "
                      "diameters up to {} µm; correct it",
                      r.v[0], r.v[1], r.v[2], r.v[3], nts_keeps.largest_place, nts_keeps.largest_diameter));
    if (std::abs(double(r.tag)) > 99999.)
      throw InputError(name_, line_, fmt::format("the tag {} has more than five digits; correct it", r.tag));
    last_ = point;
    std::string upper(r.code);
    for (char& c : upper) c = c >= 'a' && c <= 'z' ? char(c - 'a' + 'A') : c;
    if (upper != r.code) oddities_.add(NtsOddity::small_letters, line_, "a code is written in small letters");
    const NtsCode* code = find_nts_code(upper);
    if (!code) {
      oddities_.add(NtsOddity::unknown_code, line_,
                    [&] { return fmt::format("the code is \"{}\"", r.code); });
      code = find_nts_code("CP");
    }
    take(*code, point, static_cast<std::int32_t>(r.tag), r.rest);
  }

  void take(const NtsCode& code, const Point& point, std::int32_t tag, std::string_view rest) {
    switch (code.role) {
      case NtsRole::origin:
        return begin_tree(code, point, tag, rest);
      case NtsRole::point:
        return add(point, tag);
      case NtsRole::swelling:
        add(point, tag);
        return note(code.code, point);
      case NtsRole::spine:
        add(point, tag);
        seats_.push_back(points_.size() - 1);
        return;
      case NtsRole::branch:
        return branch(point, tag);
      case NtsRole::end:
        add(point, tag);
        close();
        active_ = false;
        if (code.code != "NE") note(code.code, point);
        return;
      case NtsRole::soma:
        return soma(code, point);
      case NtsRole::outline:
      case NtsRole::dots:
        return outline(code, point);
    }
  }

  void note(std::string_view word, const Point& point) {
    annotations_.emplace_back("eutectic", fmt::format("{} {}", word, place_text(point)));
  }

  void compare_counts() {
    if (said_points_ && *said_points_ != std::int64_t(records_))
      oddities_.add(NtsOddity::point_count, 0, [&] {
        return fmt::format("the header says {} points, there are {}", *said_points_, records_);
      });
    if (said_trees_ && *said_trees_ != trees_ && *said_trees_ != trees_ + outlines_)
      oddities_.add(NtsOddity::tree_count, 0, [&] {
        return fmt::format("the header says {} trees, there are {}", *said_trees_, trees_);
      });
  }

  // Trees --------------------------------------------------------------------------------------------------

  void begin_tree(const NtsCode& code, const Point& point, std::int32_t tag, std::string_view rest) {
    finish_tree();
    ++trees_;
    active_ = true;
    node_ = {};
    points_ = {point};
    tag_ = tag;
    // The cell's name and what the tree is attached to; dashes stand for nothing.
    std::vector<std::string_view> parts;
    while (parts.size() < nts_no_name.size() && !rest.empty()) {
      parts.push_back(rest.substr(0, std::min(rest.find_first_of(blanks), rest.size())));
      rest = trimmed(rest.substr(parts.back().size()));
    }
    while (!parts.empty() && parts.back() == nts_no_name[parts.size() - 1]) parts.pop_back();
    std::string word(code.code);
    for (const std::string_view part : parts) (word += ' ') += part;
    if (!parts.empty() || code.code != "MTO") note(word, point);
  }

  /// After an end: from the branch point opened last.
  void resume(const Point& point) {
    if (active_) return;
    points_.clear();
    active_ = true;
    node_ = {};
    if (!open_.empty()) {
      node_ = open_.back();
      open_.pop_back();
      return;
    }
    oddities_.add(NtsOddity::point_without_origin, line_, [&] {
      return fmt::format("the point at {} follows the end of its tree", place_text(point));
    });
    ++trees_;
  }

  void add(const Point& point, std::int32_t tag) {
    resume(point);
    if (points_.empty()) tag_ = tag;
    if (tag != tag_) {
      if (to_the_letter_) {
        node_ = close();
        tag_ = tag;
      } else {
        oddities_.add(NtsOddity::tag_change, line_, [&] { return fmt::format("the tag becomes {}", tag); });
      }
    }
    points_.push_back(point);
  }

  void branch(const Point& point, std::int32_t tag) {
    resume(point);
    if (points_.empty() && node_.valid() && same_place(point, ends_[node_.value()])) {
      open_.push_back(node_);  // one more daughter of the same node
      return;
    }
    const bool at_origin = !node_.valid() && points_.size() == 1 && points_[0] == point;
    if (!at_origin) add(point, tag);
    node_ = close();
    open_.push_back(node_);
  }

  /// The points up to here are a section.
  SectionId close() {
    std::size_t joint = 0;
    if (node_.valid()) {
      // As in NEURON a daughter begins with its own thickness, unless it repeats the branch point.
      const Point& node = ends_[node_.value()];
      if (points_.size() < 2 || !same_place(points_[0], node)) {
        points_.insert(points_.begin(), {node.x, node.y, node.z, points_[0].radius});
        joint = 1;
      }
    }
    const SectionId id = builder_.add_section(node_, swc_kind(tag_), points_, tag_);
    ends_.push_back(points_.back());
    float position = 0.f;
    std::size_t at = 0;
    for (const std::size_t seat : seats_) {
      for (; at < seat + joint; ++at)
        position += (points_[at + 1].position() - points_[at].position()).norm();
      spines_.push_back({.section = id, .position = position});
    }
    seats_.clear();
    points_.clear();
    return id;
  }

  void finish_tree() {
    if (active_ && points_.size() == 1 && !node_.valid()) {
      if (!to_the_letter_) oddities_.add(NtsOddity::origin_alone, line_, "a tree is nothing but its origin");
      close();
    } else if (active_) {
      oddities_.add(NtsOddity::unfinished_branch, line_, "a tree breaks off before an end");
      if (!points_.empty()) close();
    }
    if (!open_.empty())
      oddities_.add(NtsOddity::open_branches, line_,
                    [&] { return fmt::format("{} branch points have no second branch", open_.size()); });
    open_.clear();
    active_ = false;
  }

  // Outlines -----------------------------------------------------------------------------------------------

  void soma(const NtsCode& code, const Point& point) {
    if (code.part == NtsPart::start || soma_.points.empty()) {
      if (code.part != NtsPart::start)
        oddities_.add(NtsOddity::outline_without_start, line_,
                      [&] { return fmt::format("{} without SOS", code.code); });
      if (!soma_.points.empty())
        oddities_.add(NtsOddity::several_outlines, line_, "the soma has several outlines");
      soma_.contour_starts.push_back(static_cast<std::uint32_t>(soma_.points.size()));
      ++outlines_;
    }
    soma_.points.push_back(point);
  }

  void set_soma() {
    if (sphere_) {
      soma_ = {.kind = SomaKind::sphere, .points = {*sphere_}, .parents = {}, .contour_starts = {}};
    } else if (!soma_.points.empty()) {
      if (soma_.points.size() < 3)
        oddities_.add(NtsOddity::small_outline, 0, [&] {
          return fmt::format("the outline of the soma has {} points", soma_.points.size());
        });
      soma_ = soma_of_outlines(std::move(soma_));
    }
    builder_.set_soma(std::move(soma_));
  }

  void outline(const NtsCode& code, const Point& point) {
    if (code.part == NtsPart::start || outline_role_ != code.role || outline_.empty()) {
      if (code.part != NtsPart::start)
        oddities_.add(NtsOddity::outline_without_start, line_,
                      [&] { return fmt::format("{} without a start", code.code); });
      finish_outline();
      outline_role_ = code.role;
      ++outlines_;
    } else {
      outline_ += "; ";
    }
    outline_ += place_text(point) + ' ';
    append_number(outline_, 2.f * point.radius);
  }

  void finish_outline() {
    if (!outline_.empty())
      annotations_.emplace_back(outline_role_ == NtsRole::dots ? "dots" : "outline",
                                std::exchange(outline_, {}));
  }

  const std::string& name_;
  OddityList<NtsOddity> oddities_;
  std::size_t line_ = 0, records_ = 0;
  bool to_the_letter_ = false, header_ = false;
  std::optional<std::int64_t> said_points_, said_trees_;
  std::int64_t trees_ = 0, outlines_ = 0;
  Point last_;

  MorphologyBuilder builder_;
  Annotations annotations_;
  Soma soma_;
  std::optional<Point> sphere_;
  NtsRole outline_role_ = NtsRole::outline;
  std::string outline_;

  bool active_ = false;             // a branch is being traced
  SectionId node_;                  // it leaves from
  std::int32_t tag_ = 0;            // of it
  std::vector<Point> points_;       // of it
  std::vector<std::size_t> seats_;  // of its spines, among these points
  std::vector<SectionId> open_;     // branch points that lack a daughter
  std::vector<Point> ends_;         // of each section
  std::vector<Spine> spines_;
};

}  // namespace

bool recognises_nts(std::string_view bytes) {
  bool found = false;
  each_line(bytes, [&](std::string_view line, std::size_t number) {
    const auto record = line.size() < 200 && !trimmed(line).empty() && is_digit(trimmed(line)[0])
                            ? record_of(line)
                            : std::nullopt;
    found = same_start(trimmed(line), "no. points") || (record && find_nts_code(record->code));
    return !found && number < 100;
  });
  return found;
}

ReadResult read_nts(std::string_view bytes, const std::string& name) { return Reader(name).read(bytes); }

std::span<const Oddity> nts_oddities() { return table; }

}  // namespace forest::io
