// SPDX-License-Identifier: Apache-2.0
#include "forest/io/genesis.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <deque>
#include <limits>
#include <optional>
#include <unordered_map>
#include <utility>

#include <fmt/format.h>

#include "forest/core/byte_order_mark.h"
#include "forest/core/error.h"
#include "forest/core/number.h"
#include "forest/io/genesis_names.h"
#include "forest/io/oddity.h"
#include "forest/io/own_file.h"
#include "forest/io/plain_text.h"
#include "forest/io/words.h"
#include "forest/morphology/measure.h"

namespace forest::io {
namespace {

enum class Odd : std::uint8_t {
  byte_order_mark,
  padding,
  parameters,
  prototypes,
  spine_options,
  unknown_option,
  channels,
  unknown_diameter,
  missing_parent,
  duplicate_name,
  several_roots,
  several_somata,
  soma_inside,
  sphere_outside,
  no_length,
  gap,
  unknown_kind,
  stale_diameters,
  open_comment,
  several_cells,
  names_not_kept,
  count
};

// A file written anew holds the shape; what GENESIS computes with becomes comments.
constexpr std::string_view keep_the_file = "keep the file beside what is made of it";

constexpr std::array<Oddity, static_cast<std::size_t>(Odd::count)> table{{
    {"byte-order-mark", false, "the mark is skipped"},
    {"padding", false, "what stands behind the text is skipped"},
    {"parameters", false, "kept as annotations; they do not change the shape", keep_the_file},
    {"prototypes", false, "kept as annotations; prototypes themselves are left out", keep_the_file},
    {"spine-options", false, "kept as annotations; the spines they scatter are not made", keep_the_file},
    {"unknown-option", true, "skipped", keep_the_file, true},
    {"channels", false, "kept as annotations", keep_the_file},
    {"unknown-diameter", true, "read as the diameter of the parent", "measure it where thickness matters"},
    {"missing-parent", true, "read as a root", "give it the parent it was traced from"},
    {"duplicate-name", true, "a parent means the last one above", "give each compartment a name of its own"},
    {"several-roots", true, "kept as a tree of its own, attached to no soma",
     "give it a parent if it belongs to the cell"},
    {"several-somata", true, "read as a neurite of its parent's kind",
     "split the file if it holds several cells"},
    {"soma-inside", true, "the tree is turned so that it begins at the soma"},
    {"sphere-outside", true, "read as a point of its branch"},
    {"no-length", true, "left out: it ends where it begins"},
    {"gap", true, "bridged by a straight piece"},
    {"unknown-kind", false, "read as of its parent's kind, or of undefined kind where that has none",
     "nothing, or give it a name that tells its kind, such as dend or axon"},
    {"stale-diameters", true, "read by its diameter, as it was changed by hand"},
    {"open-comment", false, "read as a comment to the end of the file",
     "see whether compartments are missing"},
    {"several-cells", false, "the first one is read; convert and import take them all",
     "nothing, or split the file"},
    {"names-not-kept", false, "left out: a section has a number and no name", keep_the_file, true},
}};

using Oddities = OddityList<Odd>;
using Place = std::array<double, 3>;

constexpr std::string_view layout = "a line is: name parent x y z diameter [channel density]…";

enum class Option : std::uint8_t {
  relative,
  absolute,
  polar,
  cartesian,
  two_ends,
  one_end,
  spherical,
  cylindrical,
  start_cell,
  make_prototype,
  parameter,
  prototype,
  spines,
  symmetry  // where the axial resistance lies, not where the compartment does
};

constexpr std::array<std::pair<std::string_view, Option>, 28> options{{
    {"*relative", Option::relative},
    {"*absolute", Option::absolute},
    {"*polar", Option::polar},
    {"*cartesian", Option::cartesian},
    {"*double_endpoint", Option::two_ends},
    {"*double_endpoint_off", Option::one_end},
    {"*spherical", Option::spherical},
    {"*cylindrical", Option::cylindrical},
    {"*symmetric", Option::symmetry},
    {"*asymmetric", Option::symmetry},
    {"*lambda_warn", Option::parameter},
    {"*lambda_unwarn", Option::parameter},
    {"*start_cell", Option::start_cell},
    {"*append_to_cell", Option::start_cell},
    {"*makeproto", Option::make_prototype},
    {"*set_compt_param", Option::parameter},
    {"*set_global", Option::parameter},
    {"*memb_factor", Option::parameter},
    {"*compt", Option::prototype},
    {"*add_spines", Option::spines},
    {"*rand_spines", Option::spines},
    {"*mrand_spines", Option::spines},
    {"*fixed_spines", Option::spines},
    {"*mfixed_spines", Option::spines},
    {"*add_spines_proto", Option::spines},
    {"*rand_branches", Option::spines},
    {"*random_spines", Option::spines},
    {"*spine", Option::spines},
}};

std::optional<Option> option_of(std::string_view word) {
  const auto row = std::ranges::find(options, word, &decltype(options)::value_type::first);
  return row == options.end() ? std::nullopt : std::optional(row->second);
}

struct Compartment {
  std::int32_t parent = -1;
  std::size_t line = 0;
  Place from{}, to{};
  float radius_from = 0.f, radius_to = 0.f;
  std::int32_t soma_point = -1;  // that it begins at, where a file of ours says so
  bool sphere = false, soma = false;
  GenesisName name;
};

struct Group {
  std::string name;
  bool prototype = false;
  std::vector<Compartment> compartments;
  std::unordered_map<std::string_view, std::int32_t> by_name;  // views of the file
};

/// What a line says of its cell, by the group it stands in; with `on` of those that begin below as well.
struct Said {
  std::size_t group = 0;
  bool on = false;
  std::pair<std::string, std::string> annotation;
};

struct Scan {
  bool ours = false, without_points = false;
  std::vector<Group> groups;
  std::vector<Said> said;
};

class Scanner {
 public:
  Scanner(const std::string& name, Oddities& oddities) : name_(name), oddities_(oddities) {}

  Scan scan(std::string_view bytes) {
    scan_.groups.emplace_back();
    each_line(bytes, [&](std::string_view text, std::size_t line) {
      line_ = line;
      if (const OwnFile own = own_file(text, genesis_marker); line == 1 && own.ours) {
        scan_.ours = true, scan_.without_points = own.without_points;
      } else if (scan_.ours && text.starts_with(genesis_note)) {
        const std::string_view note = text.substr(genesis_note.size());
        const std::size_t end = std::min(note.find(' '), note.size());
        say(percent_decoded(note.substr(0, end)),
            percent_decoded(note.substr(std::min(end + 1, note.size()))));
      } else if (scan_.ours && text.starts_with(genesis_ends)) {
        ends_ = text.substr(genesis_ends.size());
      } else {
        data(without_comments(text));
      }
      return true;
    });
    if (in_comment_)
      oddities_.add(Odd::open_comment, comment_line_, "a comment that begins with /* has no end");
    return std::move(scan_);
  }

 private:
  void say(std::string key, std::string value, bool on = false) {
    scan_.said.push_back({group_, on, {std::move(key), std::move(value)}});
  }

  std::string without_comments(std::string_view text) {
    std::string rest;
    const auto comment = [&](std::string_view words) {
      if (const std::string_view t = trimmed(words); !t.empty() && !scan_.ours)
        say("comment", std::string(t));
    };
    while (!text.empty()) {
      if (in_comment_) {
        const std::size_t end = text.find("*/");
        comment(text.substr(0, end));
        if (end == text.npos) return rest;
        text.remove_prefix(end + 2);
        in_comment_ = false;
        continue;
      }
      const std::size_t slash = std::min(text.find("//"), text.find("/*"));
      rest += text.substr(0, slash);
      if (slash == text.npos) break;
      if (text[slash + 1] == '/') {
        comment(text.substr(slash + 2));
        break;
      }
      in_comment_ = true;
      comment_line_ = line_;
      text.remove_prefix(slash + 2);
    }
    return rest;
  }

  void data(const std::string& text) {
    const std::vector<std::string_view> words = words_of(text);
    if (words.empty()) return;
    if (words[0][0] == '*')
      option(words, trimmed(text));
    else
      compartment(words);
  }

  void option(const std::vector<std::string_view>& words, std::string_view text) {
    const auto keep = [&](Odd odd) {
      say("genesis", std::string(text), odd == Odd::parameters || odd == Odd::prototypes);
      oddities_.add(odd, line_, [&] { return fmt::format("there is an option {}", shown(words[0])); });
    };
    const std::optional<Option> option = option_of(words[0]);
    if (!option) {
      oddities_.add(Odd::unknown_option, line_,
                    [&] { return fmt::format("{} is no known option", shown(words[0])); });
      return;
    }
    switch (*option) {
      case Option::relative:
      case Option::absolute:
        relative_ = *option == Option::relative;
        break;
      case Option::polar:
      case Option::cartesian:
        polar_ = *option == Option::polar;
        break;
      case Option::two_ends:
      case Option::one_end:
        two_ends_ = *option == Option::two_ends;
        break;
      case Option::spherical:
      case Option::cylindrical:
        spherical_ = *option == Option::spherical;
        break;
      case Option::start_cell:
        group_ = find_group(words.size() > 1 ? words[1] : std::string_view{});
        break;
      case Option::make_prototype:
        scan_.groups[words.size() > 1 ? find_group(words[1]) : group_].prototype = true;
        keep(Odd::prototypes);
        break;
      case Option::parameter:
        keep(Odd::parameters);
        break;
      case Option::prototype:
        keep(Odd::prototypes);
        break;
      case Option::spines:
        keep(Odd::spine_options);
        break;
      case Option::symmetry:
        if (!scan_.ours) keep(Odd::parameters);
        break;
    }
  }

  std::size_t find_group(std::string_view name) {
    const auto [row, is_new] = group_numbers_.try_emplace(std::string(name), scan_.groups.size());
    if (is_new) scan_.groups.emplace_back().name = name;
    return row->second;
  }

  double coordinate(const std::vector<std::string_view>& words, std::size_t column) const {
    const std::optional<double> value = number_of<double>(words[column]);
    if (!value || !std::isfinite(*value))
      throw InputError(
          name_, line_,
          fmt::format("column {} is \"{}\", not a number{}; {}", column + 1, shown(words[column]),
                      words[column].find('{') == std::string_view::npos ? "" : " but a variable of a script",
                      layout));
    return *value;
  }

  Place place(const std::vector<std::string_view>& words, std::size_t column, const Place& origin) const {
    const double a = coordinate(words, column), b = coordinate(words, column + 1),
                 c = coordinate(words, column + 2);
    Place p{a, b, c};
    if (polar_) {  // r, angle from z, angle from x in the plane of x and y, in degrees
      const double theta = b * std::numbers::pi / 180., phi = c * std::numbers::pi / 180.;
      p = {a * std::sin(theta) * std::cos(phi), a * std::sin(theta) * std::sin(phi), a * std::cos(theta)};
    }
    for (std::size_t i = 0; i < 3; ++i) {
      if (relative_) p[i] += origin[i];
      if (!(std::abs(p[i]) <= double(std::numeric_limits<float>::max())))
        throw InputError(name_, line_, "the compartment lies too far away; give its place in µm");
    }
    return p;
  }

  void compartment(const std::vector<std::string_view>& words) {
    const std::size_t needed = two_ends_ ? 9 : 6;
    if (words.size() < needed)
      throw InputError(name_, line_,
                       fmt::format("\"{}\" is followed by {} of {} columns; {}", shown(words[0]),
                                   words.size() - 1, needed - 1, layout));
    Group& group = scan_.groups[group_];
    if (group.compartments.size() >= std::size_t(std::numeric_limits<std::int32_t>::max()) / 4)
      throw InputError(name_, line_, "there are too many compartments; split the file");
    Compartment c;
    c.line = line_;
    c.name = scan_.ours ? own_genesis_name(words[0]) : genesis_name(words[0]);
    if (!scan_.ours)
      oddities_.add(Odd::names_not_kept, line_, [&] {
        return fmt::format("compartments have names of their own, the first \"{}\"", shown(words[0]));
      });
    c.parent = parent(group, words[1]);
    const Compartment* const above = c.parent < 0 ? nullptr : &group.compartments[std::size_t(c.parent)];
    const Place origin = above ? above->to : Place{};
    c.from = two_ends_ ? place(words, 2, origin) : origin;
    c.to = place(words, two_ends_ ? 5 : 2, origin);
    c.sphere = spherical_ || (!scan_.ours && c.from == c.to);
    c.soma = c.name.soma;
    double diameter = number_of<double>(words[needed - 1]).value_or(-1.);
    if (!(diameter >= 0. && (std::isfinite(diameter) || ends_))) {
      oddities_.add(Odd::unknown_diameter, line_,
                    [&] { return fmt::format("the diameter is \"{}\"", shown(words[needed - 1])); });
      diameter = above ? 2. * double(above->radius_to) : 0.;
    }
    c.radius_from = c.radius_to = float(std::min(diameter / 2., double(std::numeric_limits<float>::max())));
    if (const auto ends = std::exchange(ends_, std::nullopt)) own_ends(c, *ends, diameter);
    if (words.size() > needed) {
      std::string channels(words[0]);
      for (std::size_t i = needed; i < words.size(); ++i) channels += ' ', channels += words[i];
      say("channels", std::move(channels));
      oddities_.add(Odd::channels, line_, "a compartment has channels");
    }
    const auto number = std::int32_t(group.compartments.size());
    names_.emplace_back(words[0]);
    if (const auto [row, fresh] = group.by_name.try_emplace(names_.back(), number); !fresh) {
      oddities_.add(Odd::duplicate_name, line_,
                    [&] { return fmt::format("there is another compartment \"{}\"", shown(words[0])); });
      row->second = number;
    }
    group.compartments.push_back(c);
  }

  std::int32_t parent(const Group& group, std::string_view word) {
    if (word == "none" || word == "nil") return -1;
    if (word == "." && !group.compartments.empty()) return std::int32_t(group.compartments.size()) - 1;
    if (const auto row = group.by_name.find(word); row != group.by_name.end()) return row->second;
    oddities_.add(Odd::missing_parent, line_,
                  [&] { return fmt::format("there is no compartment \"{}\" above", shown(word)); });
    return -1;
  }

  /// The radii at the ends that a comment of ours tells, unless the diameter was changed since.
  void own_ends(Compartment& c, std::string_view text, double diameter) {
    const auto words = words_of(text);
    if (words.size() < 2) return;
    const auto radius = [](std::string_view word) {
      const auto value = number_of<float>(word);
      return value && std::isfinite(*value) ? *value : -1.f;
    };
    const float a = radius(words[0]), b = radius(words[1]);
    if (!(a >= 0.f && b >= 0.f)) return;
    const auto point = [](const Place& p, float r) {
      return Point{float(p[0]), float(p[1]), float(p[2]), r};
    };
    const double expected = genesis_diameter(point(c.from, a), point(c.to, b));
    if (!(std::abs(expected - diameter) <= 1e-5 * expected) && expected != diameter) {
      oddities_.add(Odd::stale_diameters, line_,
                    "the comment before the compartment does not fit its diameter");
    } else {
      c.radius_from = a, c.radius_to = b;
    }
    if (words.size() > 2)
      if (const auto at = number_of<double>(words[2]); at && *at >= 0. && *at < 1e9)
        c.soma_point = std::int32_t(*at);
  }

  const std::string& name_;
  Oddities& oddities_;
  Scan scan_;
  std::unordered_map<std::string, std::size_t> group_numbers_{{"", 0}};  // by name
  std::deque<std::string> names_;
  std::size_t line_ = 0, group_ = 0, comment_line_ = 0;
  bool relative_ = false, polar_ = false, two_ends_ = false, spherical_ = false, in_comment_ = false;
  std::optional<std::string_view> ends_;
};

/// Compartments to a neuron.
class Assembler {
 public:
  Assembler(std::vector<Compartment> compartments, bool ours, Oddities& oddities)
      : all_(std::move(compartments)), ours_(ours), oddities_(oddities) {}

  Morphology assemble(const Annotations& annotations) {
    build_soma();
    orient();
    build_sections();
    for (const auto& [key, value] : annotations) builder_.annotate(key, value);
    return builder_.build();
  }

 private:
  static constexpr std::int32_t none = -1;
  std::size_t count() const { return all_.size(); }

  static Point end_of(const Place& p, float radius) {
    return {float(p[0]), float(p[1]), float(p[2]), radius};
  }
  Point from(std::size_t c) const {
    return reversed_[c] ? end_of(all_[c].to, all_[c].radius_to) : end_of(all_[c].from, all_[c].radius_from);
  }
  Point to(std::size_t c) const {
    return reversed_[c] ? end_of(all_[c].from, all_[c].radius_from) : end_of(all_[c].to, all_[c].radius_to);
  }

  /// The soma is the first compartment of that name and those of the name that hang on it; else a sphere that is a root.
  void build_soma() {
    reversed_.assign(count(), false);
    node_soma_.assign(2 * count(), none);
    in_soma_.assign(count(), false);
    auto top = std::ranges::find_if(all_, &Compartment::soma);
    if (top == all_.end() && !ours_)
      top = std::ranges::find_if(all_, [](const Compartment& c) { return c.sphere && c.parent < 0; });
    if (top == all_.end()) return;
    const auto first = std::size_t(top - all_.begin());
    Soma soma;
    soma.points.push_back(top->sphere ? end_of(top->to, top->radius_to)
                                      : end_of(top->from, top->radius_from));
    soma.parents.push_back(none);
    node_soma_[start_node(first)] = 0;
    for (std::size_t c = first; c < count(); ++c) {
      const Compartment& part = all_[c];
      const bool hangs = part.parent >= 0 && in_soma_[std::size_t(part.parent)] && part.soma;
      if (c != first && !hangs) {
        if (part.soma)
          oddities_.add(Odd::several_somata, part.line,
                        "one more compartment is called soma, but hangs not on the first");
        continue;
      }
      in_soma_[c] = true;
      const std::int32_t before = std::clamp(part.soma_point >= 0 ? part.soma_point
                                             : c == first         ? 0
                                                                  : node_soma_[std::size_t(part.parent)],
                                             0, std::int32_t(soma.points.size()) - 1);
      const bool point = part.sphere || (!ours_ && part.from == part.to);
      if (point) {
        node_soma_[c] = before;
        continue;
      }
      node_soma_[c] = std::int32_t(soma.points.size());
      soma.points.push_back(end_of(part.to, part.radius_to));
      soma.parents.push_back(before);
    }
    soma.kind = soma.points.size() == 1 ? SomaKind::sphere : SomaKind::cylinders;
    if (soma.kind == SomaKind::sphere) soma.parents.clear();
    soma_points_ = std::int32_t(soma.points.size());
    builder_.set_soma(std::move(soma));
  }

  // A node is an end of a compartment: node c its far end, count() + c the near one of a compartment without parent.
  std::size_t start_node(std::size_t c) const {
    return all_[c].parent >= 0 ? std::size_t(all_[c].parent) : count() + c;
  }

  /// Finds for every compartment the one before it on the way from the soma (or from its root), and turns it where it was
  /// told the other way round.
  void orient() {
    const std::size_t n = count();
    std::vector<std::uint32_t> first(2 * n + 1, 0), incident;
    for (std::size_t c = 0; c < n; ++c) ++first[c + 1], ++first[start_node(c) + 1];
    for (std::size_t i = 0; i < 2 * n; ++i) first[i + 1] += first[i];
    incident.resize(2 * n);
    auto next = first;
    for (std::size_t c = 0; c < n; ++c) {
      incident[next[start_node(c)]++] = std::uint32_t(c);
      incident[next[c]++] = std::uint32_t(c);
    }
    up_.assign(n, none), place_.assign(n, none), daughters_.assign(n, 0);
    std::vector<bool> seen(n, false);
    bool turned = false;
    const auto spread = [&](std::size_t from_node) {
      std::vector<std::pair<std::size_t, std::int32_t>> nodes{{from_node, none}};
      for (std::size_t k = 0; k < nodes.size(); ++k) {
        const auto [node, before] = nodes[k];
        for (std::uint32_t i = first[node]; i < first[node + 1]; ++i) {
          const std::size_t c = incident[i];
          if (seen[c] || in_soma_[c]) continue;
          seen[c] = true;
          reversed_[c] = start_node(c) != node;
          if (reversed_[c] && !turned)
            oddities_.add(Odd::soma_inside, all_[c].line,
                          "the soma hangs on this compartment or one that it leads to");
          turned = turned || reversed_[c];
          up_[c] = before;
          if (before >= 0)
            ++daughters_[std::size_t(before)];
          else
            place_[c] = all_[c].soma_point >= 0 && soma_points_ > 0
                            ? std::min(all_[c].soma_point, soma_points_ - 1)
                            : node_soma_[node];
          order_.push_back(c);
          nodes.emplace_back(reversed_[c] ? start_node(c) : c, std::int32_t(c));
        }
      }
    };
    for (std::size_t node = 0; node < 2 * n; ++node)
      if (node_soma_[node] >= 0) spread(node);
    bool first_root = soma_points_ == 0;
    for (std::size_t c = 0; c < n; ++c) {
      if (seen[c] || in_soma_[c] || all_[c].parent >= 0) continue;
      if (!std::exchange(first_root, false) && !ours_)
        oddities_.add(Odd::several_roots, all_[c].line, "one more compartment has no parent");
      spread(n + c);
    }
    if (!turned) std::ranges::sort(order_);
  }

  /// In the order of order_, parents first.
  void build_sections() {
    std::vector<std::int32_t> section(count(), none);
    struct Run {
      std::int32_t parent;  // a compartment
      std::vector<std::size_t> compartments;
    };
    std::vector<Run> runs;
    for (const std::size_t c : order_) {
      Compartment& compartment = all_[c];
      const std::int32_t up = up_[c];
      GenesisName& name = compartment.name;
      if (!name.known || compartment.soma) {
        if (!name.known)
          oddities_.add(Odd::unknown_kind, compartment.line,
                        "the name tells not what the compartment belongs to");
        name.kind = up >= 0 ? all_[std::size_t(up)].name.kind : SectionKind::undefined;
        name.tag = std::int32_t(name.kind);
      }
      if (up >= 0 && daughters_[std::size_t(up)] == 1) {
        const GenesisName& above = all_[std::size_t(up)].name;
        if (above.kind == name.kind && above.tag == name.tag && above.section == name.section) {
          section[c] = section[std::size_t(up)];
          runs[std::size_t(section[c])].compartments.push_back(c);
          continue;
        }
      }
      section[c] = std::int32_t(runs.size());
      runs.push_back({up, {c}});
    }
    std::vector<Point> points, ends;
    for (const Run& run : runs) {
      const std::size_t begin = run.compartments[0];
      points.assign(1, from(begin));
      SectionId parent;
      if (run.parent >= 0) {
        const auto above = std::size_t(section[std::size_t(run.parent)]);
        parent = SectionId(above);
        bridge(begin, ends[above]);
        points[0] = {ends[above].x, ends[above].y, ends[above].z, points[0].radius};
      }
      for (const std::size_t c : run.compartments) {
        if (c != begin) bridge(c, points.back());
        const Point p = to(c);
        if (all_[c].sphere)
          oddities_.add(Odd::sphere_outside, all_[c].line, "a compartment outside of the soma is a sphere");
        if (p.position() == points.back().position()) {
          if (!all_[c].sphere) oddities_.add(Odd::no_length, all_[c].line, "the compartment has no length");
          continue;
        }
        points.push_back(p);
      }
      ends.push_back(points.back());
      const GenesisName& name = all_[begin].name;
      builder_.add_section(parent, name.kind, points, name.tag, run.parent >= 0 ? none : place_[begin]);
    }
  }

  /// Tells of a compartment that begins elsewhere than where the one before ends.
  void bridge(std::size_t c, const Point& end) {
    const double distance = segment_length(from(c), end);
    if (distance > 1e-3 + 1e-6 * double(end.position().cwiseAbs().maxCoeff()))
      oddities_.add(Odd::gap, all_[c].line, [&] {
        return fmt::format("the compartment begins {:.3g} µm from where its parent ends", distance);
      });
  }

  std::vector<Compartment> all_;
  bool ours_;
  Oddities& oddities_;
  std::vector<bool> reversed_, in_soma_;
  std::vector<std::int32_t> node_soma_, up_, place_, daughters_;
  std::vector<std::size_t> order_;
  std::int32_t soma_points_ = 0;
  MorphologyBuilder builder_;
};

}  // namespace

std::span<const Oddity> genesis_oddities() { return table; }

bool recognises_genesis(std::string_view bytes) {
  bool found = false, in_comment = false;
  bytes = without_byte_order_mark(bytes);
  each_line(bytes.substr(0, 65536), [&](std::string_view text, std::size_t line) {
    if (line == 1 && own_file(text, genesis_marker).ours) return !(found = true);
    text = trimmed(text);
    if (in_comment || text.starts_with("/*")) {
      in_comment = text.find("*/") == text.npos;
      return true;
    }
    if (text.empty() || text.starts_with("//")) return true;
    const auto words = words_of(text);
    found = words[0][0] == '*' ? option_of(words[0]).has_value()
                               : words.size() >= 6 && !number_of<double>(words[0]) &&
                                     number_of<double>(words[2]) && number_of<double>(words[3]) &&
                                     number_of<double>(words[4]) && number_of<double>(words[5]);
    return false;
  });
  return found;
}

namespace {

std::vector<Cell> cells_of(std::string_view bytes, const std::string& name) {
  const PlainText plain = plain_text(bytes, name);
  if (plain.text.find('\0') != plain.text.npos)
    throw InputError(name, 0, "holds zero bytes; give a cell parameter file of GENESIS, which is plain text");
  Oddities oddities{table};
  if (plain.byte_order_mark) oddities.add(Odd::byte_order_mark, 1, "the file begins with a byte order mark");
  if (plain.padding) oddities.add(Odd::padding, 0, "zero bytes or Ctrl-Z stand at the end");
  Scan scan = Scanner(name, oddities).scan(plain.text);
  std::vector<Group*> groups;
  const auto take = [&](bool prototypes) {
    for (Group& group : scan.groups)
      if (!group.compartments.empty() && group.prototype == prototypes) groups.push_back(&group);
  };
  take(false);
  if (groups.empty()) take(true);
  if (groups.empty() && !scan.without_points)
    throw InputError(name, 0, fmt::format("holds no compartment; {}", layout));
  std::vector<Cell> cells;
  if (groups.size() > 1)
    oddities.add(Odd::several_cells, 0, [&] { return fmt::format("there are {} cells", groups.size()); });
  if (groups.empty()) groups.push_back(&scan.groups[0]);
  // What stands outside of the cells (a header, a prototype that is left out) is said of all.
  std::vector<bool> is_cell(scan.groups.size());
  for (const Group* group : groups) is_cell[std::size_t(group - scan.groups.data())] = true;
  const auto is_of = [&](const Said& said, std::size_t number) {
    return !is_cell[said.group] || said.group == number || (said.on && said.group < number);
  };
  for (Group* const group : groups) {
    Cell& cell = cells.emplace_back();
    if (groups.size() > 1) cell.name = group->name;
    Annotations annotations;
    for (const Said& said : scan.said)
      if (is_of(said, std::size_t(group - scan.groups.data()))) annotations.push_back(said.annotation);
    cell.read.morphology =
        Assembler(std::move(group->compartments), scan.ours, oddities).assemble(annotations);
  }
  cells[0].read.warnings = oddities.take();
  return cells;
}

}  // namespace

/// The extension .p is that of many other files too.
std::vector<Cell> read_genesis_cells(std::string_view bytes, const std::string& name) {
  try {
    return cells_of(bytes, name);
  } catch (const InputError& error) {
    if (recognises_genesis(bytes)) throw;
    throw NotANeuron(error.file(), error.line(), error.sentence());
  }
}

ReadResult read_genesis(std::string_view bytes, const std::string& name) {
  return std::move(read_genesis_cells(bytes, name)[0].read);
}

}  // namespace forest::io
