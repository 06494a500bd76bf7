// SPDX-License-Identifier: Apache-2.0
#include "forest/io/contours.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <map>
#include <optional>
#include <pugixml.hpp>

#include <Eigen/Geometry>
#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "forest/core/error.h"
#include "forest/core/json.h"
#include "forest/core/number.h"
#include "forest/core/round_numbers.h"
#include "forest/io/plain_text.h"
#include "forest/io/words.h"

namespace forest::io {
namespace {

using cortex::Axis;
using cortex::Contour;
using cortex::ContourStack;
using cortex::Section;
using nlohmann::json;

constexpr std::array<std::string_view, 3> axis_names{"x", "y", "z"};

std::uint32_t object_of(ContourStack& stack, const std::string& name) {
  const auto found = std::ranges::find(stack.objects, name);
  if (found == stack.objects.end()) stack.objects.push_back(name);
  return std::uint32_t(std::ranges::find(stack.objects, name) - stack.objects.begin());
}

// What a file holds and a stack does not.
struct Fault {
  const char *of_one, *of_many;
};
constexpr Fault open_line{"is an open line", "are open lines"};
std::string without(std::size_t count, const char* noun, const std::string& whose, const Fault& fault) {
  return count == 1 ? fmt::format("a {}{} {} and was left out", noun, whose, fault.of_one)
                    : fmt::format("{} {}s{} {} and were left out", count, noun, whose, fault.of_many);
}

std::string number(double value) {
  std::array<char, 32> digits;
  return {digits.data(), std::to_chars(digits.data(), digits.data() + digits.size(), value).ptr};
}

bool contains(std::span<const Place> polygon, const Place& point) {
  bool inside = false;
  for (std::size_t i = 0; i < polygon.size(); ++i) {
    const Place &a = polygon[i], &b = polygon[(i + 1) % polygon.size()];
    if ((a.y() <= point.y()) != (b.y() <= point.y()) &&
        a.x() + (point.y() - a.y()) / (b.y() - a.y()) * (b.x() - a.x()) > point.x())
      inside = !inside;
  }
  return inside;
}

// Anticlockwise where a contour lies in an even number of others of its object, else clockwise.
// Refuses what no brain spreads over: the smaller an arc is beside its contour, the more points it has.
void turn_insides_left(Section& section, const std::string& name) {
  Eigen::AlignedBox2d all;
  for (const Contour& contour : section.contours)
    for (const Place& p : contour.curve.points) all.extend(p);
  if (!all.isEmpty() && !(all.sizes().maxCoeff() <= cortex::largest_brain))
    throw InputError(
        name, 0,
        fmt::format("has contours that spread over {:.3g} m, as no brain does; look at their unit",
                    all.sizes().maxCoeff() / 1e6));
  std::vector<std::vector<Place>> polygons;
  std::vector<Eigen::AlignedBox2d> boxes;
  for (const Contour& contour : section.contours) {
    const auto& polygon = polygons.emplace_back(flattened(contour.curve, 10.));
    for (Eigen::AlignedBox2d& box = boxes.emplace_back(); const Place& p : polygon) box.extend(p);
  }
  for (std::size_t i = 0; i < polygons.size(); ++i) {
    Contour& contour = section.contours[i];
    int around = 0;
    for (std::size_t j = 0; j < polygons.size(); ++j)
      around += i != j && section.contours[j].object == contour.object && boxes[j].contains(polygons[i][0]) &&
                contains(polygons[j], polygons[i][0]);
    if ((area(contour.curve) > 0.) == (around % 2 == 0)) continue;
    std::vector<Place>& points = contour.curve.points;
    std::reverse(points.begin() + 1, points.end());
  }
}

// @param how  a place is given, to be said where two have the same
void sort_sections(ContourStack& stack, const std::string& name, std::string_view how = {}) {
  std::ranges::stable_sort(stack.sections, {}, &Section::at);
  for (std::size_t i = 1; i < stack.sections.size(); ++i)
    if (stack.sections[i].at == stack.sections[i - 1].at)
      throw InputError(name, 0,
                       fmt::format("has two sections at {:.6g} mm; give each a place of its own{}",
                                   stack.sections[i].at / 1e3, how));
}

// ── our own, and Reconstruct's ──

class JsonReader {
 public:
  JsonReader(std::string_view text, const std::string& name)
      : name_(name),
        json_(parse_json<json>(text, name, "get the whole file, or write it again",
                               {.most_members = std::size_t(-1)})) {}

  ReadContours read() const {
    if (!json_.is_object()) fail("is no stack of contours; give a .contours, .jser, .slc or .svg file");
    ReadContours result = json_.contains("brainforest_contours") ? own() : reconstruct();
    sort_sections(result.stack, name_);
    return result;
  }

 private:
  [[noreturn]] void fail(const std::string& sentence) const { throw InputError(name_, 0, sentence); }

  const json& member(const json& of, const char* key, const std::string& where) const {
    const auto found = of.is_object() ? of.find(key) : of.end();
    if (found == of.end()) fail(fmt::format("{} has no \"{}\"; get the whole file", where, key));
    return *found;
  }
  double real(const json& value, const std::string& where) const {
    if (!value.is_number() || !std::isfinite(value.get<double>()) || std::abs(value.get<double>()) > 1e12)
      fail(fmt::format("{} has something that is no number; trace it again", where));
    return value.get<double>();
  }
  std::string word(const json& value, const std::string& where) const {
    if (!value.is_string()) fail(fmt::format("{} has a name that is no text; write it in quotes", where));
    return value.get<std::string>();
  }
  std::vector<Place> places(const json& rows, double scale, const std::string& where) const {
    if (!rows.is_array()) fail(fmt::format("{} has no list of points; get the whole file", where));
    std::vector<Place> points;
    for (const json& row : rows) {
      if (!row.is_array() || row.size() != 2)
        fail(fmt::format("{} has a point that is not two numbers", where));
      points.push_back({scale * real(row[0], where), scale * real(row[1], where)});
    }
    return points;
  }

  ReadContours own() const {
    ReadContours result;
    if (json_["brainforest_contours"] != 1)
      fail("is of a version that is not known; read it by a newer program");
    const std::string axis = word(member(json_, "axis", "the stack"), "the stack"),
                      unit = word(member(json_, "unit", "the stack"), "the stack");
    const auto which = std::ranges::find(axis_names, axis);
    if (which == axis_names.end()) fail(fmt::format("has the axis '{}'; give x, y or z", shown(axis)));
    result.stack.axis = Axis(which - axis_names.begin());
    if (unit != "um" && unit != "mm") fail(fmt::format("has the unit '{}'; give um or mm", shown(unit)));
    const double scale = unit == "um" ? 1. : 1000.;
    if (json_.contains("objects") && json_["objects"].is_array())
      for (const json& object : json_["objects"]) object_of(result.stack, word(object, "the stack"));
    const json& sections = member(json_, "sections", "the stack");
    if (!sections.is_array()) fail("has sections that are no list; get the whole file");
    for (const json& one : sections) {
      const std::string where = fmt::format("section {}", result.stack.sections.size() + 1);
      Section& section = result.stack.sections.emplace_back();
      section.at = scale * real(member(one, "at", where), where);
      const json& contours = member(one, "contours", where);
      if (!contours.is_array()) fail(fmt::format("{} has contours that are no list", where));
      for (const json& contour : contours) {
        const std::uint32_t object = object_of(result.stack, word(member(contour, "object", where), where));
        const bool polygon = contour.contains("polygon");
        auto points = places(member(contour, polygon ? "polygon" : "curve", where), scale, where);
        if (points.size() < 3 || (!polygon && points.size() % 3))
          fail(fmt::format("{} has a {} of {} points; a polygon has 3 or more, a curve 3 a piece", where,
                           polygon ? "polygon" : "curve", points.size()));
        section.contours.push_back({object, polygon ? straight_loop(points) : BezierLoop{std::move(points)}});
      }
    }
    return result;
  }

  // Sections are members named SERIES.NUMBER; tforms places traces of a section by an affine map (a, b, c, d, e, f): x' = ax +
  // by + c, y' = dx + ey + f.
  ReadContours reconstruct() const {
    ReadContours result;
    result.stack.axis = Axis::z;
    std::size_t open = 0;
    std::map<std::string, std::size_t> left_out;
    const json* sections = &json_;
    if (json_.contains("sections") && json_["sections"].is_object()) sections = &json_["sections"];
    for (const auto& [key, value] : sections->items()) {
      if (!value.is_object() || !value.contains("contours") || !value.contains("thickness")) continue;
      const auto dot = key.rfind('.');
      const std::string_view digits = std::string_view(key).substr(dot == key.npos ? 0 : dot + 1);
      double index = 0.;
      if (std::from_chars(digits.data(), digits.data() + digits.size(), index).ec != std::errc()) continue;
      const std::string where = fmt::format("section '{}'", shown(key));
      Section& section = result.stack.sections.emplace_back();
      section.at = index * real(value["thickness"], where);
      if (!std::isfinite(section.at)) fail(fmt::format("{} has no number at its end", where));
      Eigen::Matrix<double, 2, 3> place;
      place << 1., 0., 0., 0., 1., 0.;
      if (value.contains("tforms") && value["tforms"].is_object() && value["tforms"].contains("default")) {
        const json& six = value["tforms"]["default"];
        if (!six.is_array() || six.size() != 6)
          fail(fmt::format("{} is placed by what is not six numbers", where));
        for (int k = 0; k < 6; ++k) place(k / 3, k % 3) = real(six[std::size_t(k)], where);
      }
      if (!value["contours"].is_object()) fail(fmt::format("{} has contours that are no table", where));
      for (const auto& [object, traces] : value["contours"].items()) {
        if (!traces.is_array()) fail(fmt::format("{} has traces that are no list", where));
        for (const json& trace : traces) {
          // A table, or a list of x, y, colour, closed, …
          const bool list = trace.is_array() && trace.size() >= 4;
          const json& xs = list ? trace[0] : member(trace, "x", where);
          const json& ys = list ? trace[1] : member(trace, "y", where);
          const json& closed = list ? trace[3] : member(trace, "closed", where);
          if (!xs.is_array() || !ys.is_array() || xs.size() != ys.size())
            fail(fmt::format("{} has a trace of '{}' with as many x as y missing", where, shown(object)));
          if (!closed.is_boolean() || !closed.get<bool>()) {
            ++open;
            continue;
          }
          std::vector<Place> points;
          for (std::size_t i = 0; i < xs.size(); ++i) {
            const Eigen::Vector3d p(real(xs[i], where), real(ys[i], where), 1.);
            const Place placed = place * p;
            if (points.empty() || points.back() != placed) points.push_back(placed);
          }
          while (points.size() > 1 && points.back() == points.front()) points.pop_back();
          if (points.size() < 3) {
            ++left_out[object];
            continue;
          }
          section.contours.push_back({object_of(result.stack, object), straight_loop(points)});
        }
      }
      turn_insides_left(section, name_);
    }
    if (result.stack.sections.empty())
      fail("has no section with contours; give a .contours, .jser, .slc or .svg file");
    if (open) result.oddities.push_back(without(open, "trace", "", open_line));
    for (const auto& [object, count] : left_out)
      result.oddities.push_back(without(count, "trace", fmt::format(" of '{}'", shown(object)),
                                        {"has fewer than three points", "have fewer than three points"}));
    return result;
  }

  const std::string& name_;
  json json_;
};

// ── slices of SurfaceReconstructionLibrary ──

ReadContours read_slc(std::string_view text, const std::string& name, double unit) {
  ReadContours result;
  result.stack = {.axis = Axis::z, .objects = {"outer"}, .sections = {}};
  std::size_t line_number = 0, open = 0;
  bool closed = false, tracing = false, neighbours = false;
  std::vector<Place> points;
  const auto fail = [&](const std::string& sentence) { throw InputError(name, line_number, sentence); };
  const auto finish = [&] {
    if (!tracing) return;
    tracing = false;
    while (points.size() > 1 && points.back() == points.front()) points.pop_back();
    if (!closed || points.size() < 3)
      ++open;
    else
      result.stack.sections.back().contours.push_back({0, straight_loop(points)});
    points.clear();
  };
  const auto real = [&](std::string_view word) {
    const auto value = number_of<double>(word);
    if (!value || !(std::abs(*value) < 1e12))
      fail(fmt::format("'{}' is no number; give x and y", shown(word)));
    return *value;
  };
  while (!text.empty()) {
    ++line_number;
    const std::size_t end = std::min(text.find('\n'), text.size());
    const std::string_view line = trimmed(text.substr(0, end), " \t\r");
    text.remove_prefix(std::min(end + 1, text.size()));
    if (line.empty()) continue;
    if (line.starts_with("slice")) {
      finish();
      result.stack.sections.push_back({.at = unit * real(trimmed(line.substr(5))), .contours = {}});
      neighbours = false;
    } else if (line.starts_with("contour")) {
      finish();
      if (result.stack.sections.empty()) fail("a contour comes before any slice; begin with 'slice Z'");
      closed = trimmed(line.substr(7)) == "closed", tracing = true, neighbours = false;
    } else if (line.starts_with("adjacent")) {
      finish();
      neighbours = true;  // which contours they go on in: -1 ends the list
    } else if (neighbours || result.stack.sections.empty()) {
      if (result.stack.sections.empty() && line_number > 1)
        fail("is no stack of slices; begin with 'slice Z'");
    } else if (tracing) {
      const auto blank = line.find_first_of(" \t");
      if (blank == line.npos) fail("a point needs x and y; get the whole file");
      points.push_back({unit * real(line.substr(0, blank)), unit * real(trimmed(line.substr(blank)))});
    } else {
      fail(fmt::format("'{}' stands outside any contour; write 'contour closed' before points", shown(line)));
    }
  }
  finish();
  // Slices may be named more than once.
  std::ranges::stable_sort(result.stack.sections, {}, &Section::at);
  std::vector<Section> sections;
  for (Section& section : result.stack.sections) {
    if (sections.empty() || sections.back().at != section.at) sections.push_back({section.at, {}});
    for (Contour& contour : section.contours) sections.back().contours.push_back(std::move(contour));
  }
  for (Section& section : sections) turn_insides_left(section, name);
  result.stack.sections = std::move(sections);
  if (result.stack.sections.empty()) throw InputError(name, 0, "has no slice; begin with 'slice Z'");
  if (open) result.oddities.push_back(without(open, "contour", "", open_line));
  return result;
}

// ── drawings ──

// The curves of a path's d attribute.
class PathReader {
 public:
  PathReader(std::string_view text, const std::string& name, double scale)
      : text_(text), name_(name), scale_(scale) {}

  std::vector<BezierLoop> read() {
    char command = 0;
    while (skip_blanks(), at_ < text_.size()) {
      const char c = text_[at_];
      if ((c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z')) {
        command = c;
        ++at_;
      } else if (command == 0 || command == 'z' || command == 'Z') {
        fail("a path begins with a number; begin with M");
      }
      step(command);
      if (command == 'm') command = 'l';
      if (command == 'M') command = 'L';
    }
    if (drawing_) close(false);
    return std::move(loops_);
  }

 private:
  [[noreturn]] void fail(const std::string& sentence) const {
    throw InputError(name_, 0, sentence + fmt::format(" (at character {} of a path)", at_ + 1));
  }
  void skip_blanks() {
    while (at_ < text_.size() && (trimmed(text_.substr(at_, 1), " \t\r\n\f,").empty())) ++at_;
  }
  double real() {
    skip_blanks();
    if (at_ < text_.size() && text_[at_] == '+') ++at_;
    double value = 0.;
    const auto [end, error] = std::from_chars(text_.data() + at_, text_.data() + text_.size(), value);
    if (error != std::errc() || !(std::abs(value) < 1e12)) fail("a number is missing; draw it again");
    at_ = std::size_t(end - text_.data());
    return value;
  }
  Place place(bool relative) {
    const double x = real(), y = real();
    return relative ? Place(here_ + Place(x, y)) : Place(x, y);
  }
  void to(const Place& first, const Place& second, const Place& end) {
    if (!drawing_) fail("a path has no beginning; begin with M");
    if (!(first == here_ && second == end && end == here_))
      curve_.insert(curve_.end(), {here_, first, second});
    control_ = second, here_ = end;
  }
  void line(const Place& end) { to(here_, end, end); }
  void close(bool said) {
    if (here_ != start_) {
      if (!said)
        fail(fmt::format("a path is open between ({:.3f}, {:.3f}) and ({:.3f}, {:.3f}); close it by Z",
                         start_.x(), start_.y(), here_.x(), here_.y()));
      line(start_);
    }
    if (curve_.size() == 3) {  // one cubic that ends where it begins, as two
      const Place a = curve_[0], b = .5 * (a + curve_[1]), c = .5 * (curve_[1] + curve_[2]),
                  d = .5 * (curve_[2] + a), bc = .5 * (b + c), cd = .5 * (c + d);
      curve_ = {a, b, bc, .5 * (bc + cd), cd, d};
    }
    if (curve_.size() >= 6) {
      // Downwards in the drawing is downwards in the section, whose axes run upwards.
      BezierLoop loop;
      for (const Place& p : curve_) loop.points.push_back({scale_ * p.x(), scale_ * -p.y()});
      loops_.push_back(std::move(loop));
    }
    curve_.clear();
    drawing_ = false;
  }

  void step(char command) {
    const bool relative = command >= 'a';
    const char kind = char(relative ? command : command - 'A' + 'a');
    const char before = std::exchange(last_, kind);
    switch (kind) {
      case 'm':
        if (drawing_) close(false);
        here_ = start_ = place(relative), drawing_ = true;
        break;
      case 'l':
        line(place(relative));
        break;
      case 'h':
        line({real() + (relative ? here_.x() : 0.), here_.y()});
        break;
      case 'v':
        line({here_.x(), real() + (relative ? here_.y() : 0.)});
        break;
      case 'c': {
        const Place a = place(relative), b = place(relative), end = place(relative);
        to(a, b, end);
        break;
      }
      case 's': {
        const Place a = before == 'c' || before == 's' ? Place(2. * here_ - control_) : here_;
        const Place b = place(relative), end = place(relative);
        to(a, b, end);
        break;
      }
      case 'q':
      case 't': {
        const Place a = kind == 'q'                      ? place(relative)
                        : before == 'q' || before == 't' ? Place(2. * here_ - quadratic_)
                                                         : here_;
        const Place end = place(relative);
        to(here_ + 2. / 3. * (a - here_), end + 2. / 3. * (a - end), end);
        quadratic_ = a;
        break;
      }
      case 'z':
        close(true);
        here_ = start_, drawing_ = false;
        break;
      default:
        fail(fmt::format("the command '{}' is not read; convert arcs and shapes to paths",
                         shown({&command, 1})));
    }
  }

  std::string_view text_;
  const std::string& name_;
  double scale_;
  std::size_t at_ = 0;
  Place here_ = Place::Zero(), start_ = Place::Zero(), control_ = Place::Zero(), quadratic_ = Place::Zero();
  char last_ = 0;
  bool drawing_ = false;
  std::vector<Place> curve_;
  std::vector<BezierLoop> loops_;
};

std::string path_of(const BezierLoop& loop) {
  const auto pair = [](const Place& p) { return number(p.x()) + " " + number(-p.y()); };
  std::string d = "M" + pair(loop.points[0]);
  for (std::size_t i = 0; i < loop.pieces(); ++i) {
    const auto& p = loop.piece(i).points;
    d += loop.piece(i).straight() ? "L" + pair(p[3]) : "C" + pair(p[1]) + " " + pair(p[2]) + " " + pair(p[3]);
  }
  return d + "Z";
}

std::string escaped(std::string_view text) {
  std::string result;
  for (const char c : text) {
    if (c == '&')
      result += "&amp;";
    else if (c == '<')
      result += "&lt;";
    else if (c == '"')
      result += "&quot;";
    else
      result += c;
  }
  return result;
}

}  // namespace

ReadContours read_contours(std::string_view bytes, const std::string& name, double unit) {
  const std::string_view text = plain_text(bytes, name).text;
  const std::string_view begin = trimmed(text, xml_blanks);
  if (begin.starts_with('{')) return JsonReader(text, name).read();
  if (begin.starts_with("slice")) return read_slc(text, name, unit);
  if (begin.starts_with('<')) return read_svg(text, name);
  throw InputError(name, 0, "is no stack of contours; give a .contours, .jser, .slc or .svg file");
}

std::string write_contours(const ContourStack& stack) {
  const auto quoted = [](const json& words) {  // names may be of any bytes
    return words.dump(-1, ' ', false, json::error_handler_t::replace);
  };
  std::string text = fmt::format(
      "{{\"brainforest_contours\": 1, \"unit\": \"um\", \"axis\": \"{}\", \"objects\": {},\n\"sections\": [",
      axis_names[std::size_t(stack.axis)], quoted(stack.objects));
  for (std::size_t i = 0; i < stack.sections.size(); ++i) {
    const Section& section = stack.sections[i];
    text += fmt::format("{}\n{{\"at\": {}, \"contours\": [", i ? "," : "", number(section.at));
    for (std::size_t k = 0; k < section.contours.size(); ++k) {
      const Contour& contour = section.contours[k];
      bool polygon = contour.curve.pieces() >= 3;
      for (std::size_t p = 0; p < contour.curve.pieces(); ++p)
        polygon = polygon && contour.curve.piece(p).straight();
      text += fmt::format("{}\n {{\"object\": {}, \"{}\": [", k ? "," : "",
                          quoted(stack.objects.at(contour.object)), polygon ? "polygon" : "curve");
      for (std::size_t p = 0; p < contour.curve.points.size(); p += polygon ? 3 : 1)
        text += fmt::format("{}[{},{}]", p ? "," : "", number(contour.curve.points[p].x()),
                            number(contour.curve.points[p].y()));
      text += "]}";
    }
    text += "]}";
  }
  return text + "]}\n";
}

std::string write_svg(const ContourStack& stack, const Section& section, const Section* behind) {
  Place low = Place::Constant(HUGE_VAL), high = -low;
  for (const Section& one : stack.sections)  // all drawings of a stack show the same part of the plane
    for (const Contour& contour : one.contours)
      for (const Place& p : contour.curve.points) low = low.cwiseMin(p), high = high.cwiseMax(p);
  if (!(low.x() <= high.x())) low = Place::Zero(), high = Place::Constant(1000.);
  const Place border = Place::Constant(.02 * (high - low).maxCoeff() + 1.);
  low -= border, high += border;
  // Words have a strip of their own, below.
  const double wide = high.x() - low.x(), letter = std::min((high - low).maxCoeff() / 45., wide / 28.);
  low.y() -= 2. * letter;
  const Place extent = high - low;
  std::string text = fmt::format(
      "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{}mm\" "
      "height=\"{}mm\" "
      "viewBox=\"{} {} {} {}\" data-unit=\"um\" data-axis=\"{}\" data-at=\"{}\">\n",
      number(extent.x() / 1e3), number(extent.y() / 1e3), number(low.x()), number(-high.y()),
      number(extent.x()), number(extent.y()), axis_names[std::size_t(stack.axis)], number(section.at));
  constexpr std::array<const char*, 4> colours{"#b3402a", "#1f5f99", "#2f7d4f", "#7a4f9a"};
  const double width = extent.maxCoeff() / 800.;
  const auto group = [&](const Section& one, bool pale) {
    for (std::uint32_t object = 0; object < stack.objects.size(); ++object) {
      text += fmt::format("<g {}=\"{}\" fill=\"none\" stroke=\"{}\" stroke-width=\"{:.4g}\"{}>\n",
                          pale ? "data-behind" : "data-object", escaped(stack.objects[object]),
                          colours[object % colours.size()], width, pale ? " opacity=\".35\"" : "");
      for (const Contour& contour : one.contours)
        if (contour.object == object) text += fmt::format("<path d=\"{}\"/>\n", path_of(contour.curve));
      text += "</g>\n";
    }
  };
  if (behind) group(*behind, true);
  group(section, false);
  const double bar = round_below(.25 * wide), left = low.x() + letter, base = -low.y() - .8 * letter;
  text += fmt::format(
      "<g data-words=\"scale\" font-family=\"sans-serif\" font-size=\"{0:.6g}\" fill=\"#444\">\n"
      "<path d=\"M{1:.8g} {2:.8g}v{3:.6g}h{4}v-{3:.6g}\" fill=\"none\" stroke=\"#444\" "
      "stroke-width=\"{5:.4g}\"/>\n"
      "<text x=\"{6:.8g}\" y=\"{7:.8g}\">{8}</text>\n"
      "<text x=\"{9:.8g}\" y=\"{7:.8g}\" text-anchor=\"end\">{10} = {11} mm</text>\n</g>\n",
      letter, left, base - .4 * letter, .4 * letter, number(bar), .1 * letter, left + bar + .6 * letter, base,
      bar < 1000. ? number(bar) + " µm" : number(bar / 1000.) + " mm", high.x() - letter,
      axis_names[std::size_t(stack.axis)], number(section.at / 1000.));
  return text + "</svg>\n";
}

namespace {

// As Inkscape hides a layer.
bool hidden(const pugi::xml_node& node) {
  std::string style = node.attribute("style").value();
  std::erase_if(style, [](char c) { return static_cast<unsigned char>(c) <= ' '; });
  return std::string_view(node.attribute("display").value()) == "none" ||
         (';' + style + ';').find(";display:none;") != std::string::npos;
}

}  // namespace

ReadContours read_svg(std::string_view text, const std::string& name) {
  pugi::xml_document document;
  const auto parsed = document.load_buffer(text.data(), text.size());
  const pugi::xml_node root = document.document_element();
  if (!parsed)
    throw InputError(name, 0,
                     fmt::format("is no SVG drawing ({}); save it as plain SVG", parsed.description()));
  if (const std::string_view kind = root.name(); kind == "GIFTI")
    throw InputError(name, 0,
                     "is a surface, not contours of sections; cut it by brainforest cortex contours");
  else if (kind != "svg")
    throw InputError(name, 0,
                     fmt::format("is no SVG drawing, its root is {}; save it as plain SVG", shown(kind, 20)));
  ReadContours result;
  ContourStack& stack = result.stack;
  const std::string_view axis_name = root.attribute("data-axis").as_string("y");
  const auto axis = std::ranges::find(axis_names, axis_name);
  if (axis == axis_names.end())
    throw InputError(name, 0, fmt::format("its data-axis is {}; write x, y or z", shown(axis_name, 20)));
  stack.axis = Axis(axis - axis_names.begin());
  Section& section = stack.sections.emplace_back();
  const auto real = [](std::string_view word) {  // a unit may follow
    double value = NAN;
    std::from_chars(word.data(), word.data() + word.size(), value);
    return value;
  };
  section.at = root.attribute("data-at") ? real(root.attribute("data-at").value()) : 0.;
  double scale = 1.;
  if (std::string_view(root.attribute("data-unit").value()) != "um") {
    // As large as the drawing says it is; without a word on it a unit is a pixel, of which CSS has 96 an inch.
    const std::string_view width = root.attribute("width").value();
    constexpr std::pair<std::string_view, double> units[] = {
        {"mm", 1000.}, {"cm", 10000.}, {"in", 25400.}, {"pt", 25400. / 72.}, {"pc", 25400. / 6.}, {"%", NAN}};
    const auto named = std::ranges::find_if(units, [&](const auto& u) { return width.ends_with(u.first); });
    const double unit = named == std::end(units) ? 25400. / 96. : named->second;
    const std::string_view box = root.attribute("viewBox").value();
    std::vector<double> four;
    for (std::size_t at = 0; at < box.size() && four.size() < 4;) {
      const std::size_t end = std::min(box.find_first_of(" ,", at), box.size());
      if (end > at) four.push_back(real(box.substr(at, end - at)));
      at = end + 1;
    }
    scale = unit;
    if (four.size() == 4) scale = unit * real(width) / four[2];
    if (!(scale > 0.) || !std::isfinite(scale))
      throw InputError(name, 0, "does not say how large it is; give the drawing a width in mm and a viewBox");
  }
  if (!std::isfinite(section.at))
    throw InputError(name, 0, "is at no number (data-at); say where the section is, in µm");
  std::size_t loose = 0, grouped = 0;  // paths
  const auto walk = [&](const pugi::xml_node& top) {
    // Without recursion, since a file may nest as deeply as it likes.
    for (pugi::xml_node node = top.first_child(); node;) {
      const std::string_view kind = node.name();
      const bool unseen = hidden(node),
                 skipped = unseen || node.attribute("data-behind") || node.attribute("data-words") ||
                           kind == "defs" || kind == "clipPath",
                 container = kind == "g" || kind == "a" || kind == "switch";
      if (node.attribute("transform") && !skipped && (container || kind == "path"))
        throw InputError(
            name, 0,
            fmt::format("has a <{}> that is moved by a transform; apply it in the drawing program",
                        shown(kind)));
      if (unseen && (container || kind == "path"))
        result.oddities.push_back(fmt::format(
            "a hidden <{}>{} was left out; show it, and save again, to have it", shown(kind),
            node.attribute("id") ? fmt::format(" '{}'", shown(node.attribute("id").value())) : ""));
      if (kind == "path" && !skipped) {
        std::string object;
        for (pugi::xml_node up = node; up && up != root; up = up.parent())
          if (const auto said = up.attribute("data-object")          ? up.attribute("data-object")
                                : std::string_view(up.name()) == "g" ? up.attribute("id")
                                                                     : pugi::xml_attribute()) {
            object = said.value();
            break;
          }
        ++(object.empty() ? loose : grouped);
        if (object.empty()) object = "outer";
        for (BezierLoop& loop : PathReader(node.attribute("d").value(), name, scale).read())
          section.contours.push_back({object_of(stack, object), std::move(loop)});
      } else if (kind == "g" && !skipped) {
        if (node.attribute("data-object")) object_of(stack, node.attribute("data-object").value());
      } else if (kind == "svg" || kind == "use" || kind == "polygon" || kind == "polyline" ||
                 kind == "circle" || kind == "ellipse" || kind == "rect") {
        result.oddities.push_back(fmt::format("a <{}> was left out; convert it to a path", shown(kind)));
      }
      pugi::xml_node next = container && !skipped ? node.first_child() : pugi::xml_node();
      while (!next && node && node != top) {
        next = node.next_sibling();
        if (!next) node = node.parent();
        if (node == top) break;
      }
      node = next;
    }
  };
  walk(root);
  if (loose && grouped)
    result.oddities.push_back(fmt::format("{} in no group {} taken for contours of 'outer'",
                                          loose == 1 ? "a path" : fmt::format("{} paths", loose),
                                          loose == 1 ? "is" : "are"));
  turn_insides_left(section, name);  // drawing programs know no direction
  return result;
}

ContourStack gathered(const std::vector<ContourStack>& drawings, const std::string& name) {
  ContourStack stack;
  if (drawings.empty()) return stack;
  stack.axis = drawings.front().axis;
  for (const ContourStack& drawing : drawings) {
    if (drawing.axis != stack.axis)
      throw InputError(name, 0, "holds drawings of different axes; give those of one stack");
    for (Section section : drawing.sections) {
      for (Contour& contour : section.contours)
        contour.object = object_of(stack, drawing.objects.at(contour.object));
      stack.sections.push_back(std::move(section));
    }
  }
  sort_sections(stack, name, ", in µm, as <svg data-at=\"4000\" …> in its drawing");
  return stack;
}

}  // namespace forest::io
