// SPDX-License-Identifier: Apache-2.0
#include "forest/io/swc_rows.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <limits>
#include <utility>

#include <fmt/format.h>

#include "forest/core/error.h"
#include "forest/io/numbers.h"
#include "forest/io/oddity.h"
#include "forest/io/own_file.h"
#include "forest/io/plain_text.h"
#include "forest/io/words.h"

namespace forest::io {
namespace {

constexpr float unknown = std::numeric_limits<float>::quiet_NaN();

// Header keys of Cannon et al. 1998 that are plain words; any KEY_WITH_UNDERSCORE or KEY/SLASH counts too.
constexpr std::array<std::string_view, 8> plain_keys{"CREATURE",  "REGION", "TYPE",   "CONTRIBUTOR",
                                                     "REFERENCE", "RAW",    "EXTRAS", "SCALE"};

constexpr std::array<std::string_view, 7> columns{"id", "type", "x", "y", "z", "radius", "parent"};
constexpr std::string_view layout = "a row is: id type x y z radius parent";

bool means_unknown(std::string_view token) {
  if (!token.empty() && (token[0] == '-' || token[0] == '+')) token.remove_prefix(1);
  constexpr std::array<std::string_view, 8> words{"nan", "na", "n/a", "null", "none", "inf", "infinity", "?"};
  return std::ranges::any_of(words, [&](std::string_view word) { return same_word(token, word); });
}

class Scanner {
 public:
  Scanner(const std::string& name, OddityList<SwcOddity>& oddities) : name_(name), oddities_(oddities) {}

  SwcRows scan(std::string_view bytes) {
    const auto [text, byte_order_mark, padding] = plain_text(bytes, name_);
    if (byte_order_mark)
      oddities_.add(SwcOddity::byte_order_mark, 1, "the file begins with a byte order mark");
    if (padding) oddities_.add(SwcOddity::padding, 0, "zero bytes or Ctrl-Z stand at the end");
    const std::size_t rows = text.size() / 16;
    rows_.ids.reserve(rows), rows_.parents.reserve(rows), rows_.types.reserve(rows),
        rows_.points.reserve(rows);

    // Every line that the scanner sees ends in a line end, so that reading a number needs no other bound.
    const std::size_t whole = text.find_last_of("\r\n") + 1;  // npos + 1 == 0
    lines(text.data(), text.data() + whole);
    if (whole < text.size()) {
      const std::string last = std::string(text.substr(whole)) + '\n';
      lines(last.data(), last.data() + last.size());
    }
    for (auto& [line, said] : trailing_) rows_.annotations.emplace_back("comment", std::move(said));
    if (!trailing_.empty())
      oddities_.add(SwcOddity::trailing_text, trailing_[0].first, "words follow the last row");
    return std::move(rows_);
  }

 private:
  void lines(const char* p, const char* const end) {
    while (p < end) {
      ++line_;
      const char* const begin = p;
      if (footer_ || !row(p)) {
        p = begin;
        while (!is_line_end(*p)) ++p;
        odd_line({begin, p});
        place_ = nullptr;
      }
      if (*p == '\r') {
        oddities_.add(SwcOddity::line_ends, line_, "lines end in a carriage return");
        ++p;
        if (p < end && *p == '\n') ++p;
      } else {
        ++p;
      }
    }
  }

  /// The common row: seven plain numbers. Leaves p at the line end; false when the line is anything else.
  bool row(const char*& p) {
    bool tabs = false, exponent = false;
    const auto skip = [&] {
      for (; is_blank(*p); ++p) tabs |= *p == '\t';
    };
    std::int64_t id = 0, type = 0, parent = 0;
    Point point;
    skip();
    if (!read_integer(p, id)) return false;
    skip();
    if (!read_integer(p, type)) return false;
    skip();
    const char* const place = p;
    if (!read_real(p, point.x, exponent)) return false;
    skip();
    if (!read_real(p, point.y, exponent)) return false;
    skip();
    if (!read_real(p, point.z, exponent)) return false;
    skip();
    if (!read_real(p, point.radius, exponent)) return false;
    skip();
    if (!read_integer(p, parent)) return false;
    skip();
    if (!is_line_end(*p)) return false;
    add(id, type, point, parent);
    look_for_twin(place);
    if (tabs) oddities_.add(SwcOddity::tabs, line_, "columns are separated by tabs");
    if (exponent) oddities_.add(SwcOddity::exponent, line_, "a number has an exponent");
    return true;
  }

  /// Places that the file tells apart and 32-bit numbers do not, as those far from the origin.
  /// @param place  where the coordinates of the last row stand
  void look_for_twin(const char* place) {
    const char* const before = std::exchange(place_, place);
    const auto& points = rows_.points;
    if (!before || points.size() < 2) return;
    const Point &a = points[points.size() - 2], &b = points.back();
    if (a.x != b.x || a.y != b.y || a.z != b.z) [[likely]]
      return;
    constexpr double least = 1e-3;  // µm; nearer ones are noise of who wrote them
    double apart = 0.;
    for (const char *p = before, *q = place; [[maybe_unused]] const int axis : {0, 1, 2})
      apart = std::max(apart, std::abs(exact(p) - exact(q)));
    if (apart >= least)
      oddities_.add(SwcOddity::precision, line_, [&] {
        return fmt::format(
            "the point is {:.3g} µm from that of the row before, which 32-bit numbers do not tell apart so "
            "far from the origin",
            apart);
      });
  }
  static double exact(const char*& p) {
    while (is_blank(*p) || *p == '+') ++p;
    const char* const begin = p;
    while (!ends_number(*p)) ++p;
    double value = 0.;
    std::from_chars(begin, p, value);
    return value;
  }

  void add(std::int64_t id, std::int64_t type, Point point, std::int64_t parent) {
    SwcRows& rows = rows_;
    const std::size_t row = rows.ids.size();
    if (!trailing_.empty()) [[unlikely]]
      refuse_words(trailing_[0].first, trailing_[0].second);
    if (line_ != row + lines_before_ + 1) {
      lines_before_ = line_ - row - 1;
      rows.jumps.push_back({row, lines_before_});
    }
    if (row != 0) {
      rows.consecutive = rows.consecutive && id == rows.ids.back() + 1;
      if (blank_line_) {
        oddities_.add(SwcOddity::blank_line, blank_line_,
                      "a blank line among the rows, where some programs stop reading");
        blank_line_ = 0;
      }
      if (late_comment_) {
        oddities_.add(SwcOddity::late_comment, late_comment_, "a comment line among the rows");
        late_comment_ = 0;
      }
    }
    if (type < std::numeric_limits<std::int32_t>::min() || type > std::numeric_limits<std::int32_t>::max())
      throw InputError(
          name_, line_,
          fmt::format("the type {} is too large; types 0 to 7 are standard, others custom", type));
    const float sum = point.x + point.y + point.z;
    if (!(std::abs(sum) < std::numeric_limits<float>::infinity()) ||
        !(point.radius < std::numeric_limits<float>::infinity()) || !(point.radius > 0.f)) [[unlikely]]
      unknowns(point);
    rows.ids.push_back(id);
    rows.parents.push_back(parent);
    rows.types.push_back(static_cast<std::int32_t>(type));
    rows.points.push_back(point);
  }

  void unknowns(Point& point) {
    for (float* const number : {&point.x, &point.y, &point.z})
      if (!std::isfinite(*number)) {
        *number = unknown;
        rows_.unknown_numbers = true;
        oddities_.add(SwcOddity::unknown_place, line_, "a coordinate is not known or not finite");
      }
    if (point.radius < 0.f) {
      oddities_.add(SwcOddity::negative_radius, line_,
                    [&] { return fmt::format("the radius is {}", point.radius); });
      point.radius = unknown;
      rows_.unknown_numbers = true;
    } else if (point.radius == 0.f) {
      rows_.zero_radii.push_back(line_);
    } else if (!std::isfinite(point.radius)) {
      oddities_.add(SwcOddity::unknown_radius, line_, "the radius is not known or not finite");
      point.radius = unknown;
      rows_.unknown_numbers = true;
    }
  }

  // Everything that is no common row
  // ---------------------------------------------------------------------------

  void odd_line(std::string_view line) {
    const std::string_view text = trimmed(line);
    if (footer_) return footer(text);
    if (text.empty()) {
      if (rows_.size() && !blank_line_) blank_line_ = line_;
    } else if (text[0] == '#') {
      comment(trimmed(text.substr(1)));
    } else {
      odd_row(text);
    }
  }

  void footer(std::string_view text) {
    if (text.starts_with('#')) text = trimmed(text.substr(1));
    if (text == "end synapse")
      footer_ = false;
    else if (!text.empty())
      rows_.annotations.emplace_back("synapse", text);
  }

  void comment(std::string_view text) {
    if (rows_.size() && !late_comment_) late_comment_ = line_;
    if (text == "start synapse") {
      footer_ = true;
      late_comment_ = 0;
    } else if (const OwnFile own = own_file(text, swc_marker); own.ours) {
      if (line_ == 1) rows_.to_the_letter = true, rows_.without_points = own.without_points;
    } else if (!rows_.to_the_letter || !own_comment(text)) {
      const auto [key, value] = swc_comment(text);
      rows_.annotations.emplace_back(key, value);
    }
  }

  /// What write_swc put into comments: a key, a whole number, and as many others as the key has.
  bool own_comment(std::string_view text) {
    const auto [key, value] = swc_comment(text);
    if (!swc_own_key(key)) return false;
    const std::string numbers = std::string(value) + '\n';
    const char* p = numbers.data();
    const auto skip = [&] {
      while (is_blank(*p)) ++p;
    };
    std::int64_t id = 0;
    std::array<float, 7> values{};
    const std::size_t count = key == swc_node_key ? 0 : key == swc_outline_key ? 4 : values.size();
    bool good = read_integer(p, id) && id >= 0, exponent = false;
    for (std::size_t i = 0; i < count; ++i) {
      skip();
      good = good && read_real(p, values[i], exponent) && std::isfinite(values[i]);
    }
    skip();
    good = good && is_line_end(*p);
    if (key == swc_node_key) {
      rows_.nodes.push_back(id);
    } else if (key == swc_outline_key) {
      auto& starts = rows_.outline_starts;
      if (static_cast<std::size_t>(id) == starts.size())
        starts.push_back(static_cast<std::uint32_t>(rows_.outline.size()));
      good = good && static_cast<std::size_t>(id) + 1 == starts.size() && values[3] >= 0.f;
      rows_.outline.push_back({values[0], values[1], values[2], values[3]});
    } else {
      good = good && id < 0xffffffff && values[6] >= 0.f && values[6] <= float(SpineShape::branched);
      if (good)
        rows_.spines.push_back({SectionId(static_cast<std::size_t>(id)), values[0],
                                Vec3(values[1], values[2], values[3]), values[4], values[5],
                                static_cast<SpineShape>(values[6])});
    }
    if (!good)
      throw InputError(
          name_, line_,
          fmt::format("the comment {} does not hold the numbers it should; remove the line", key));
    return true;
  }

  [[noreturn]] void refuse_words(std::size_t line, std::string_view text) {
    throw InputError(name_, line,
                     fmt::format("\"{}\" has {} of 7 columns; {}; complete it, or get the whole file",
                                 shown(text), split(text).size(), layout));
  }

  void odd_row(std::string_view text) {
    const std::size_t hash = text.find('#');
    const std::string plain = without_typography(trimmed(text.substr(0, hash)));
    const std::string_view data = trimmed(plain);
    std::vector<std::string> tokens = split(data);
    if (tokens.empty()) tokens.emplace_back();
    const bool number =
        data.empty() || is_digit(data[0]) || data[0] == '-' || data[0] == '+' || data[0] == '.';
    if (rows_.size() == 0 && tokens.size() != 1 && !number) {
      oddities_.add(SwcOddity::text_header, line_, "a line of words");
      rows_.annotations.emplace_back("comment", text);
      return;
    }
    if (rows_.size() > 0 && !number) {  // allowed behind the rows only
      trailing_.emplace_back(line_, text);
      return;
    }
    if (tokens.size() < columns.size()) refuse_words(line_, data);
    const std::int64_t id = integer(tokens, 0), type = integer(tokens, 1);
    Point point;
    point.x = real(tokens, 2), point.y = real(tokens, 3), point.z = real(tokens, 4),
    point.radius = real(tokens, 5);
    add(id, type, point, integer(tokens, 6));
    if (data.find('\t') != data.npos) oddities_.add(SwcOddity::tabs, line_, "columns are separated by tabs");
    if (tokens.size() > columns.size() && !rows_.to_the_letter)
      oddities_.add(SwcOddity::extra_columns, line_,
                    [&] { return fmt::format("there are {} columns", tokens.size()); });
    if (hash != text.npos) oddities_.add(SwcOddity::trailing_comment, line_, "a comment follows the row");
  }

  /// What texts have that went through a spreadsheet or a web page: quotation marks, no-break blanks, minus signs of
  /// typesetters.
  std::string without_typography(std::string_view data) {
    constexpr std::array<std::pair<std::string_view, std::string_view>, 4> signs{
        {{"\xc2\xa0", " "}, {"\xe2\x88\x92", "-"}, {"\xe2\x80\x93", "-"}, {"\"", ""}}};
    std::string text(data);
    for (const auto& [sign, plain] : signs)
      for (std::size_t at = text.find(sign); at != text.npos; at = text.find(sign, at + plain.size())) {
        text.replace(at, sign.size(), plain);
        if (is_digit(data[0]) || data[0] == sign[0])
          oddities_.add(SwcOddity::typography, line_, "a row has quotation marks or signs of typesetting");
      }
    return text;
  }

  /// At blanks, commas and semicolons; but commas inside numbers, of a row that has its columns without them, are
  /// decimal points.
  std::vector<std::string> split(std::string_view data) {
    const auto at = [&](std::string_view separators) {
      const auto words = words_of(data, separators);
      return std::vector<std::string>(words.begin(), words.end());
    };
    const bool semicolons = data.find(';') != data.npos;
    if (semicolons) oddities_.add(SwcOddity::commas, line_, "columns are separated by semicolons");
    std::vector<std::string> tokens = at(semicolons ? " \t\v\f;" : blanks);
    if (data.find(',') == data.npos) return tokens;
    const auto inside = [](const std::string& token) { return token.find(',') < token.size() - 1; };
    if (tokens.size() >= columns.size() && std::ranges::any_of(tokens, inside)) {
      oddities_.add(SwcOddity::decimal_commas, line_, "numbers have a decimal comma");
      for (std::string& token : tokens) std::ranges::replace(token, ',', '.');
      return tokens;
    }
    oddities_.add(SwcOddity::commas, line_, "columns are separated by commas");
    return at(" \t\v\f,");
  }

  std::int64_t integer(const std::vector<std::string>& tokens, std::size_t column) {
    const std::string text = tokens[column] + '\n';
    const char* p = text.data() + (text[0] == '+');
    std::int64_t value = 0;
    if (read_integer(p, value)) return value;
    double decimal = 0.;
    const char* const end = text.data() + text.size() - 1;
    const auto [stop, error] = std::from_chars(text.data(), end, decimal);
    constexpr double most = 9e15;  // up to where a double has every whole number
    if (error == std::errc() && stop == end && std::abs(decimal) > most)
      throw InputError(name_, line_,
                       fmt::format("column {} ({}) is {}, beyond {}; {}", column + 1, columns[column],
                                   shown(tokens[column]), std::int64_t(most), layout));
    if (error != std::errc() || stop != end || decimal != std::floor(decimal))
      throw InputError(name_, line_,
                       fmt::format("column {} ({}) is \"{}\", not a whole number; {}", column + 1,
                                   columns[column], shown(tokens[column]), layout));
    oddities_.add(SwcOddity::decimal_integer, line_, [&] {
      return fmt::format("the {} is written \"{}\"", columns[column], shown(tokens[column]));
    });
    return static_cast<std::int64_t>(decimal);
  }

  float real(const std::vector<std::string>& tokens, std::size_t column) {
    const std::string text = tokens[column] + '\n';
    const char* p = text.data();
    float value = 0.f;
    bool exponent = false;
    if (read_real(p, value, exponent) && *p == '\n') {
      if (exponent) oddities_.add(SwcOddity::exponent, line_, "a number has an exponent");
      return value;
    }
    if (!means_unknown(tokens[column]))
      throw InputError(name_, line_,
                       fmt::format("column {} ({}) is \"{}\", not a number; {}", column + 1, columns[column],
                                   shown(tokens[column]), layout));
    return unknown;
  }

  const std::string& name_;
  OddityList<SwcOddity>& oddities_;
  SwcRows rows_;
  const char* place_ = nullptr;  // where the coordinates of the row before stand, in the text
  std::size_t line_ = 0, lines_before_ = 0, blank_line_ = 0, late_comment_ = 0;
  std::vector<std::pair<std::size_t, std::string>> trailing_;  // lines of words after a row
  bool footer_ = false;
};

}  // namespace

std::size_t SwcRows::line(std::size_t row) const {
  const auto after = std::ranges::upper_bound(jumps, row, {}, &Jump::row);
  return row + 1 + (after == jumps.begin() ? 0 : std::prev(after)->lines_before);
}

std::pair<std::string_view, std::string_view> swc_comment(std::string_view text) {
  text = trimmed(text);
  const std::string_view word = text.substr(0, text.find_first_of(blanks));
  const bool capital =
      !word.empty() && word[0] >= 'A' && word[0] <= 'Z' && std::ranges::all_of(word, [](char c) {
        return (c >= 'A' && c <= 'Z') || is_digit(c) || c == '_' || c == '/';
      });
  const bool key =
      std::ranges::find(plain_keys, word) != plain_keys.end() || word.find_first_of("_/") != word.npos;
  if (!capital || !key) return {"comment", text};
  return {word, trimmed(text.substr(word.size()))};
}

SwcRows scan_swc(std::string_view bytes, const std::string& name, OddityList<SwcOddity>& oddities) {
  return Scanner(name, oddities).scan(bytes);
}

}  // namespace forest::io
