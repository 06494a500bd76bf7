// SPDX-License-Identifier: Apache-2.0
#include "forest/io/nmf.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <cstdint>
#include <limits>
#include <numbers>
#include <optional>
#include <pugixml.hpp>
#include <utility>
#include <vector>

#include <fmt/format.h>

#include "forest/core/error.h"
#include "forest/core/lower.h"
#include "forest/core/number.h"
#include "forest/io/asc_words.h"
#include "forest/io/numbers.h"
#include "forest/io/oddity.h"
#include "forest/io/placed_words.h"
#include "forest/io/plain_text.h"
#include "forest/io/traced_branch.h"
#include "forest/io/words.h"

namespace forest::io {
namespace {

enum class NmfOddity : std::uint8_t {
  version,
  unknown_type,
  no_diameter,
  negative_diameter,
  unknown_diameter,
  unknown_place,
  several_outlines,
  small_outline,
  empty_tree,
  tree_begins_with_split,
  branch_without_points,
  only_branch_point,
  empty_branch,
  single_daughter,
  spine_without_place,
  spine_before_points,
  skipped_element,
  several_documents,
  not_kept,
  count
};

constexpr std::array<Oddity, static_cast<std::size_t>(NmfOddity::count)> table{{
    {"version", false, "read like version 4.0"},
    {"unknown-type", true, "read as a neurite of undefined kind",
     "give it the type Axon, Dendrite or Apical Dendrite"},
    {"no-diameter", true, "read with the diameter of the point before", "measure it where thickness matters"},
    {"negative-diameter", true, "read as unknown, so as that of the point before",
     "measure it where thickness matters"},
    {"unknown-diameter", true, "read as that of the point before", "measure it where thickness matters"},
    {"unknown-place", true, "read as that of the point before",
     "look it up in the tracing, or remove the point"},
    {"several-outlines", false, "read as one soma, a stack of outlines",
     "nothing, if they are outlines of one soma; split the file if it holds several cells"},
    {"small-outline", false, "read as a sphere of its size", "trace the outline with three points or more"},
    {"empty-tree", true, "skipped"},
    {"tree-begins-with-split", true, "its branches are read as trees of their own",
     "give it the point they leave from"},
    {"branch-without-points", true, "what hangs on it hangs on the branch point before"},
    {"only-branch-point", true, "left out; what hangs on it hangs on the branch point itself"},
    {"empty-branch", true, "skipped"},
    {"single-daughter", true, "kept as a section of its own", "nothing, if a section begins there"},
    {"spine-without-place", true, "skipped", "put it behind the point it sits on", true},
    {"spine-before-points", true, "put on that point", "put it behind the point it sits on"},
    {"skipped-element", true, "skipped", "keep the file beside what is made of it", true},
    {"several-documents", false, "the first one is read", "split the file"},
    {"not-kept", false, "left out", "keep the file beside what is made of it", true},
}};

// Known, and told together in one sentence where nothing is made of them.
constexpr std::array<std::string_view, 9> known_elements{"filefacts", "thumbnail",  "property",
                                                         "images",    "sparcdata",  "scalebar",
                                                         "zsmear",    "resolution", "description"};
constexpr int circle_points = 16;

std::string_view name_of(const pugi::xml_node& element) { return element.name(); }

/// Takes the prefixes of name spaces from the names of all elements.
struct TakePrefixes : pugi::xml_tree_walker {
  bool for_each(pugi::xml_node& element) override {
    const std::string_view name = element.name();
    if (const auto colon = name.find(':'); colon != name.npos)
      element.set_name(std::string(name.substr(colon + 1)).c_str());
    return true;
  }
};

/// The names of known elements of which nothing is made, in the order they come in.
struct LeftOut : pugi::xml_tree_walker {
  std::vector<std::string> names;
  pugi::xml_node first;

  bool for_each(pugi::xml_node& element) override {
    const std::string_view what = element.name();
    if (element.type() != pugi::node_element || !left_out(what, element)) return true;
    if (names.empty()) first = element;
    std::string name(what);
    if (what == "property") name += fmt::format(" {}", std::string_view(element.attribute("name").value()));
    if (std::ranges::find(names, name) == names.end() && names.size() < most_names) names.push_back(name);
    return true;
  }

 private:
  static constexpr std::size_t most_names = 12;

  static bool left_out(std::string_view what, const pugi::xml_node& element) {
    const std::string_view in = element.parent().name(), name = element.attribute("name").value();
    if (what == "property")
      return !(in == "tree" && name == "Set") && !(in == "spine" && used_of_spine(name));
    if (in == "spine") return what != "point";
    if (in == "image") return what != "filename";
    if (in == "sparcdata") return what != "subject";
    return what == "filefacts" || what == "scalebar" || what == "zsmear" || what == "resolution" ||
           (what == "thumbnail" && in != "thumbnail");
  }
  static bool used_of_spine(std::string_view property) {
    return property == "Class" || property == "GeneratedMetrics";
  }
};

/// The decimal number; an infinity for the words NaN, INF and for numbers too large.
std::optional<float> number(std::string_view text) {
  const auto value = number_of<float>(trimmed(text, xml_blanks));
  return value && !std::isfinite(*value) ? std::numeric_limits<float>::infinity() : value;
}

/// In ASC a text stands between quotation marks and has no sign for one.
std::string quoted(std::string_view text) {
  std::string result = fmt::format("\"{}\"", text);
  std::replace(result.begin() + 1, result.end() - 1, '"', '\'');
  return result;
}

std::string asc_color(std::string_view hexadecimal) {
  unsigned value = 0;
  if (!hexadecimal.starts_with('#') || hexadecimal.size() != 7) return {};
  const auto [end, error] = std::from_chars(hexadecimal.data() + 1, hexadecimal.data() + 7, value, 16);
  if (error != std::errc() || end != hexadecimal.data() + 7) return {};
  return fmt::format("(Color RGB ({}, {}, {}))", value >> 16, (value >> 8) & 255, value & 255);
}

std::string asc_point(const Point& p) {
  std::string text = "(" + place_text(p) + ' ';
  append_number(text, 2.f * p.radius);
  return text + ')';
}

/// A word that begins a block of ASC.
std::string asc_word(std::string_view text, std::string_view otherwise) {
  const auto letter = [](char c) { return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z'); };
  const bool good = !text.empty() && letter(text[0]) &&
                    std::ranges::all_of(text, [&](char c) { return letter(c) || is_digit(c); });
  return std::string(good ? text : otherwise);
}

class Reader {
 public:
  Reader(std::string_view bytes, const std::string& name)
      : text_(in_utf8(bytes)), name_(name), oddities_(table) {
    if (bytes.starts_with("\xff\xfe") || bytes.starts_with("\xfe\xff"))
      throw InputError(name_, 1, "is written in UTF-16; save it as UTF-8");
  }

  ReadResult read() {
    pugi::xml_document document;
    const auto parsed =
        document.load_buffer(text_.data(), text_.size(), pugi::parse_default, pugi::encoding_utf8);
    if (!parsed)
      throw InputError(
          name_, line_at(std::size_t(std::max<std::ptrdiff_t>(parsed.offset, 0))),
          fmt::format("the XML is broken ({}); get the whole file or mend it there", parsed.description()));
    TakePrefixes walker;
    document.traverse(walker);
    pugi::xml_node root = document.document_element();
    if (name_of(root) != "mbf")
      throw InputError(name_, line_of(root), "has no <mbf> element; Neurolucida XML is all inside of one");
    if (const std::string_view version = root.attribute("version").value(); version != "4.0")
      oddities_.add(NmfOddity::version, line_of(root),
                    [&] { return fmt::format("the version is \"{}\", not 4.0", version.substr(0, 40)); });
    for (pugi::xml_node next = root.next_sibling(); next; next = next.next_sibling())
      if (next.type() == pugi::node_element)
        oddities_.add(NmfOddity::several_documents, line_of(next), "another document follows the first");
    about_the_file(root);
    LeftOut left_out;
    document.traverse(left_out);
    if (!left_out.names.empty())
      oddities_.add(NmfOddity::not_kept, line_of(left_out.first), [&] {
        return fmt::format("there is more than the shape ({})", fmt::join(left_out.names, ", "));
      });
    bool outlines = false;  // of layers, or markers
    for (const pugi::xml_node element : root.children()) {
      const std::string_view what = name_of(element);
      outlines = outlines || what == "contour" || what == "marker";
      if (what == "tree")
        tree(element);
      else if (what == "contour")
        contour(element);
      else if (what == "marker")
        marker(element, "Dot");
      else
        skip(element);
    }
    if (sections_.size() == 0 && soma_.points.empty()) {
      const char* const sentence = "holds neither a tree nor a soma; a tree is <tree> with <point>s";
      if (outlines) throw NotANeuron(name_, 0, sentence);
      throw InputError(name_, 0, sentence);
    }
    set_soma();
    sections_.add_spines();
    return {builder_.build(), oddities_.take()};
  }

 private:
  // Text ---------------------------------------------------------------------------------------------------

  /// MBF's programs write ISO 8859-1.
  static std::string in_utf8(std::string_view bytes) {
    const std::string declaration = lower(bytes.substr(0, std::min(bytes.find("?>"), std::size_t(200))));
    if (declaration.find("8859-1") == declaration.npos && declaration.find("1252") == declaration.npos)
      return std::string(bytes);
    std::string text;
    text.reserve(bytes.size() + bytes.size() / 16);
    for (const char c : bytes) {
      const auto byte = static_cast<unsigned char>(c);
      if (byte < 0x80)
        text += c;
      else
        text += char(0xc0 | byte >> 6), text += char(0x80 | (byte & 0x3f));
    }
    return text;
  }

  std::size_t line_at(std::size_t offset) {
    if (line_ends_.empty()) {
      for (std::size_t at = text_.find('\n'); at != text_.npos; at = text_.find('\n', at + 1))
        line_ends_.push_back(at);
      line_ends_.push_back(text_.size());
    }
    return std::size_t(std::ranges::lower_bound(line_ends_, std::min(offset, text_.size())) -
                       line_ends_.begin()) +
           1;
  }
  std::size_t line_of(const pugi::xml_node& element) {
    return line_at(std::size_t(std::max<std::ptrdiff_t>(element.offset_debug(), 0)));
  }

  void about_the_file(const pugi::xml_node& root) {
    const auto note = [&](std::string_view key, std::string_view value) {
      value = trimmed(value, xml_blanks);
      if (!value.empty()) builder_.annotate(std::string(key), std::string(value));
    };
    note("description", root.child("description").text().get());
    const pugi::xml_node subject = root.child("sparcdata").child("subject");
    for (const char* key : {"species", "subjectid", "sex", "age"}) note(key, subject.attribute(key).value());
    for (const pugi::xml_node image : root.child("images").children("image"))
      note("image", image.child("filename").text().get());
  }

  void skip(const pugi::xml_node& element) {
    const std::string_view what = name_of(element);
    if (element.type() == pugi::node_element &&
        std::ranges::find(known_elements, what) == known_elements.end())
      oddities_.add(NmfOddity::skipped_element, line_of(element),
                    [&] { return fmt::format("there is an element <{}>", what.substr(0, 40)); });
  }

  // Points -------------------------------------------------------------------------------------------------

  Point point(const pugi::xml_node& element) {
    const auto value = [&](const char* key) -> std::optional<float> {
      const pugi::xml_attribute attribute = element.attribute(key);
      if (!attribute && *key == 'd') return std::nullopt;
      const auto found = number(attribute.value());
      if (!found)
        throw InputError(
            name_, line_of(element),
            fmt::format("a point has {} = \"{}\", which is no number; a point is <point x= y= z= d=/>", key,
                        std::string_view(attribute.value()).substr(0, 40)));
      return found;
    };
    std::array<float, 3> place{*value("x"), *value("y"), *value("z")};
    const std::array<float, 3> before{last_.x, last_.y, last_.z};
    for (std::size_t i = 0; i < 3; ++i)
      if (!std::isfinite(place[i])) {
        if (!has_last_)
          throw InputError(name_, line_of(element),
                           "the first point has no place; give its coordinates in µm");
        oddities_.add(NmfOddity::unknown_place, line_of(element), "a coordinate is not finite");
        place[i] = before[i];
      }
    const std::optional<float> said = value("d");
    float diameter = said.value_or(0.f);
    if (!said || !std::isfinite(diameter) || diameter < 0.f) {
      const NmfOddity odd = !said            ? NmfOddity::no_diameter
                            : diameter < 0.f ? NmfOddity::negative_diameter
                                             : NmfOddity::unknown_diameter;
      oddities_.add(odd, line_of(element), [&] {
        return !said ? std::string("a point has no diameter") : fmt::format("the diameter is {}", diameter);
      });
      diameter = 2.f * last_.radius;
    }
    return {place[0], place[1], place[2], .5f * diameter};
  }

  std::vector<Point> points_of(const pugi::xml_node& element) {
    std::vector<Point> points;
    for (const pugi::xml_node child : element.children())
      if (name_of(child) == "point") {
        last_ = point(child);
        has_last_ = true;
        points.push_back(last_);
      }
    return points;
  }

  // Outlines and markers -----------------------------------------------------------------------------------

  void contour(const pugi::xml_node& element) {
    has_last_ = false, last_ = {};
    std::vector<Point> points = points_of(element);
    const std::string shape = lower(element.attribute("shape").value());
    if (points.size() == 2 && (shape == "circle" || shape == "box"))
      points = drawn(shape == "circle", points);
    for (const pugi::xml_node child : element.children())
      if (name_of(child) == "marker") marker(child, "Dot");
    if (points.empty()) return;
    if (names_soma(element.attribute("name").value())) {
      if (!soma_.points.empty())
        oddities_.add(NmfOddity::several_outlines, line_of(element), "the soma has several outlines");
      soma_.contour_starts.push_back(std::uint32_t(soma_.points.size()));
      soma_.points.insert(soma_.points.end(), points.begin(), points.end());
      return;
    }
    std::string text = '(' + quoted(element.attribute("name").value());
    if (const std::string color = asc_color(element.attribute("color").value()); !color.empty())
      text += ' ' + color;
    if (element.attribute("closed").as_bool()) text += " (Closed)";
    for (const Point& p : points) text += ' ' + asc_point(p);
    builder_.annotate("contour", text + ')');
  }

  /// Of a circle its centre and a point on it, of a box two opposite corners.
  static std::vector<Point> drawn(bool circle, const std::vector<Point>& two) {
    const Point &a = two[0], &b = two[1];
    if (!circle) return {a, {b.x, a.y, a.z, a.radius}, b, {a.x, b.y, a.z, a.radius}};
    const float radius = (b.position() - a.position()).norm();
    std::vector<Point> points;
    for (int i = 0; std::isfinite(radius) && i < circle_points; ++i) {
      const double angle = 2. * std::numbers::pi * i / circle_points;
      points.push_back(
          {a.x + radius * float(std::cos(angle)), a.y + radius * float(std::sin(angle)), a.z, a.radius});
    }
    const bool good = std::ranges::all_of(points, [](const Point& p) { return p.position().allFinite(); });
    return good && !points.empty() ? points : two;
  }

  void marker(const pugi::xml_node& element, std::string_view word) {
    std::string text = '(' + asc_word(element.attribute("type").value(), word);
    if (const std::string color = asc_color(element.attribute("color").value()); !color.empty())
      text += ' ' + color;
    const std::string_view name = element.attribute("name").value();
    if (!name.empty()) text += fmt::format(" (Name {})", quoted(name));
    const Point last = std::exchange(last_, Point{});
    const bool has_last = std::exchange(has_last_, false);
    const std::vector<Point> points = points_of(element);
    last_ = last, has_last_ = has_last;
    for (const Point& p : points) text += ' ' + asc_point(p);
    if (!points.empty()) builder_.annotate("marker", text + ')');
  }

  void set_soma() {
    if (soma_.points.empty()) return;
    if (soma_.points.size() < 3)
      oddities_.add(NmfOddity::small_outline, 0, [&] {
        return fmt::format("the outline of the soma has {} points", soma_.points.size());
      });
    builder_.set_soma(soma_of_outlines(std::move(soma_)));
  }

  // Trees --------------------------------------------------------------------------------------------------

  struct Branch : TracedBranch {
    pugi::xml_node element, next;
    std::vector<Point> points;
    std::vector<SpineSeat> spines;
    std::size_t branches = 0, daughters = 0;
  };

  void tree(const pugi::xml_node& element) {
    const std::string type = lower(element.attribute("type").value());
    const SectionKind kind = type == "axon"                                  ? SectionKind::axon
                             : type == "dendrite"                            ? SectionKind::basal
                             : type == "apical" || type == "apical dendrite" ? SectionKind::apical
                                                                             : SectionKind::undefined;
    if (kind == SectionKind::undefined)
      oddities_.add(NmfOddity::unknown_type, line_of(element),
                    [&] { return fmt::format("a tree is of type \"{}\"", type.substr(0, 40)); });
    has_last_ = false, last_ = {};
    std::vector<Branch> open;
    const auto begin = [&](const pugi::xml_node& branch, SectionId node) {
      Branch& b = open.emplace_back();
      b.element = branch, b.next = branch.first_child();
      b.node = node, b.kind = kind, b.tag = std::int32_t(kind);
      if (node.valid()) last_ = sections_.end(node);
    };
    begin(element, {});
    while (!open.empty()) {
      Branch& branch = open.back();
      if (!branch.next) {
        finish(branch, open.size() == 1);
        const bool something = branch.own || branch.branches > 0;
        open.pop_back();
        if (!open.empty()) open.back().daughters += something;
        continue;
      }
      const pugi::xml_node child = std::exchange(branch.next, branch.next.next_sibling());
      const std::string_view what = name_of(child);
      if (what == "point") {
        if (branch.over)
          throw InputError(
              name_, line_of(child),
              "a point follows the branches that leave from its branch; give it a branch of its own");
        last_ = point(child);
        has_last_ = true;
        branch.points.push_back(last_);
      } else if (what == "branch") {
        if (branch.points.empty() && !branch.over)
          oddities_.add(
              open.size() == 1 ? NmfOddity::tree_begins_with_split : NmfOddity::branch_without_points,
              line_of(branch.element),
              open.size() == 1 ? "a tree begins with a branch" : "a branch splits before its first point");
        close(branch, open.size() == 1);
        ++branch.branches;
        begin(child, branch.node);
      } else if (what == "spine") {
        spine(child, branch);
      } else if (what == "marker") {
        marker(child, "Dot");
      } else if (what == "varicosity") {
        marker(child, "Varicosity");
      } else {
        skip(child);
      }
    }
  }

  void finish(Branch& branch, bool root) {
    close(branch, root);
    if (branch.branches > 0 && branch.daughters == 1)
      oddities_.add(NmfOddity::single_daughter, line_of(branch.element), "a branch ends in a single branch");
    if (!branch.own && branch.branches == 0 && !branch.excused)
      oddities_.add(root ? NmfOddity::empty_tree : NmfOddity::empty_branch, line_of(branch.element),
                    root ? "a tree has no points" : "a branch has no points");
    const std::string leaf = asc_word(branch.element.attribute("leaf").value(), "");
    if (branch.own && branch.branches == 0 && !leaf.empty() && leaf != "Normal")
      builder_.annotate("leaf", fmt::format("{} {}", leaf, place_text(sections_.end(branch.node))));
  }

  /// The branch has no more points: they become a section.
  void close(Branch& branch, bool root) {
    if (root && !branch.points.empty()) about_the_tree(branch);
    const auto closed = sections_.close(branch, branch.points, branch.spines);
    if (closed.only_branch_point)
      oddities_.add(NmfOddity::only_branch_point, line_of(branch.element),
                    "a branch holds only the point it leaves from");
    for (std::size_t i = 0; i < closed.early_spines; ++i)
      oddities_.add(NmfOddity::spine_before_points, line_of(branch.element),
                    "a spine stands before the first point of its tree");
    for (std::size_t i = 0; i < closed.lost_spines; ++i)
      oddities_.add(NmfOddity::spine_without_place, line_of(branch.element),
                    "a spine stands where its tree has no point");
  }

  void about_the_tree(const Branch& branch) {
    std::string text = asc_color(branch.element.attribute("color").value());
    for (const pugi::xml_node property : branch.element.children("property"))
      if (std::string_view(property.attribute("name").value()) == "Set")
        text += fmt::format("{}(Set {})", text.empty() ? "" : " ", quoted(property.child("s").text().get()));
    if (!text.empty()) builder_.annotate("tree", place_text(branch.points[0]) + ' ' + text);
  }

  void spine(const pugi::xml_node& element, Branch& branch) {
    SpineSeat seat{.points = branch.points.size(), .spine = {}, .head = Vec3::Zero(), .said = false};
    std::string_view shape = element.attribute("classification").value();
    bool placed = false;
    for (const pugi::xml_node child : element.children()) {
      const std::string_view property = child.attribute("name").value();
      if (name_of(child) == "point") {
        const Point head = point(child);
        seat.head = head.position(), seat.spine.head_diameter = 2.f * head.radius;
        placed = true;
      } else if (property == "Class" && shape.empty()) {
        shape = child.child("s").text().get();
      } else if (property == "GeneratedMetrics") {  // its seventh number is the diameter of the neck
        std::size_t count = 0;
        for (const pugi::xml_node value : child.children("n"))
          if (++count == 7)
            if (const auto neck = number(value.text().get()); neck && std::isfinite(*neck) && *neck >= 0.f)
              seat.spine.neck_diameter = *neck;
      }
    }
    seat.spine.shape = spine_shape(shape);
    if (placed)
      branch.spines.push_back(seat);
    else
      oddities_.add(NmfOddity::spine_without_place, line_of(element), "a spine has no point");
  }

  const std::string text_;
  const std::string& name_;
  OddityList<NmfOddity> oddities_;
  std::vector<std::size_t> line_ends_;
  Point last_;  // the one before, for numbers that are not known
  bool has_last_ = false;

  MorphologyBuilder builder_;
  TracedSections sections_{builder_, true};
  Soma soma_;
};

}  // namespace

bool recognises_nmf(std::string_view bytes) { return first_element(bytes) == "mbf"; }

ReadResult read_nmf(std::string_view bytes, const std::string& name) { return Reader(bytes, name).read(); }

std::span<const Oddity> nmf_oddities() { return table; }

}  // namespace forest::io
