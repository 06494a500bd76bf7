// SPDX-License-Identifier: Apache-2.0
#include "forest/io/neuron.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <map>
#include <string_view>
#include <utility>
#include <vector>

#include <fmt/format.h>

#include "forest/core/hash.h"
#include "forest/io/comments.h"
#include "forest/io/numbers.h"
#include "forest/io/soma_place.h"
#include "forest/io/swc_rows.h"
#include "forest/morphology/measure.h"

namespace forest::io {
namespace {

/// A section of NEURON.
struct Cable {
  std::size_t array = 0, index = 0;  // it is array[index]
  std::int32_t parent = -1;          // a cable before it
  double at = 1.;                    // where on the parent, 0…1 of its length
  // Where shape plots take that place to be, on the straight line between the parent's ends; told to NEURON where the cable
  // begins elsewhere, since a plot moves it there else.
  bool wired = false;
  Vec3 place = Vec3::Zero();
  std::vector<Point> points;  // two or more, of some length
};

struct Array {
  std::string name;
  std::string_view list;  // the list its sections are in, besides `all`
  std::size_t size = 0;
};

constexpr std::array<std::string_view, 4> lists{"somatic", "axonal", "basal", "apical"};

/// The names of NEURON's own importers; kinds it has none for are numbered as in SWC.
std::pair<std::string, std::string_view> array_of(const Section& section) {
  switch (section.kind) {
    case SectionKind::axon:
      return {"axon", lists[1]};
    case SectionKind::basal:
      return {"dend", lists[2]};
    case SectionKind::apical:
      return {"apic", lists[3]};
    default:
      const std::int32_t type = swc_type(section);
      return {type < 0 ? fmt::format("dend_m{}", -std::int64_t(type)) : fmt::format("dend_{}", type), {}};
  }
}

class Plan {
 public:
  explicit Plan(const Morphology& m) : m_(m), soma_place_(m) {
    soma();
    for (std::size_t s = 0; s < m.sections().size(); ++s) neurite(SectionId(s));
  }

  std::vector<Cable> cables;
  std::vector<Array> arrays;

  std::string name(std::size_t cable) const {
    const Cable& c = cables[cable];
    return fmt::format("{}[{}]", arrays[c.array].name, c.index);
  }

 private:
  struct Place {
    std::size_t cable = 0;
    double at = .5;
  };

  Cable& add(const std::pair<std::string, std::string_view>& array) {
    const auto [row, fresh] = numbers_.try_emplace(array.first, arrays.size());
    if (fresh) arrays.push_back({array.first, array.second});
    Cable& cable = cables.emplace_back();
    cable.array = row->second;
    cable.index = arrays[row->second].size++;
    return cable;
  }

  void hang(Cable& cable, const Place& place) {
    cable.parent = std::int32_t(place.cable);
    cable.at = place.at;
    const std::vector<Point>& parent = cables[place.cable].points;
    const Vec3 begin = parent.front().position(), end = parent.back().position();
    cable.place = begin + float(place.at) * (end - begin);
    cable.wired = cable.points.front().position() != cable.place;
  }

  void neurite(SectionId id) {
    const Section& section = m_.section(id);
    const auto points = m_.points(id);
    const std::int32_t place = section.parent.valid() ? -1 : soma_place_(id);
    Cable& cable = add(array_of(section));
    cable.points.assign(points.begin(), points.end());
    if (section.parent.valid()) {
      cable.parent = std::int32_t(first_neurite_ + section.parent.value());
    } else if (place >= 0) {
      hang(cable, soma_places_[std::size_t(place)]);
    }
  }

  /// A sphere is one cylinder; cylinders are paths of soma points.
  void soma() {
    const Soma& soma = m_.soma();
    if (soma.kind == SomaKind::sphere || (soma.kind == SomaKind::cylinders && soma.at_one_place())) {
      const auto [low, middle, high] = cylinder_of(soma.sphere());
      add({"soma", lists[0]}).points = {low, high};
      soma_places_.assign(soma.points.size(), {0, .5});
    } else if (soma.kind == SomaKind::cylinders) {
      soma_paths(soma);
    }
    first_neurite_ = cables.size();
  }

  /// Each soma point is on one path, at the start of a path, or both: a path goes on through the first daughter, the others
  /// begin paths. The first path runs through the first point, from its second daughter's end to its first one's.
  void soma_paths(const Soma& soma) {
    const std::size_t count = soma.points.size();
    std::vector<std::vector<std::size_t>> daughters(count);
    for (std::size_t i = 1; i < count; ++i) daughters[std::size_t(soma.parents[i])].push_back(i);
    soma_places_.resize(count);
    const auto path_from = [&](std::size_t point) {
      std::vector<std::size_t> path{point};
      while (!daughters[path.back()].empty()) path.push_back(daughters[path.back()][0]);
      return path;
    };
    const auto lay = [&](const std::vector<std::size_t>& path, std::size_t known) {
      const std::size_t number = cables.size();
      Cable& cable = add({"soma", lists[0]});
      for (const std::size_t i : path) cable.points.push_back(soma.points[i]);
      double length = 0.;
      for (std::size_t k = 1; k < path.size(); ++k)
        length += segment_length(cable.points[k - 1], cable.points[k]);
      if (length < 1e-6) cable.points.back() = next_place(cable.points.back());
      double so_far = 0.;
      for (std::size_t k = 0; k < path.size(); ++k) {
        if (k > 0) so_far += segment_length(soma.points[path[k - 1]], soma.points[path[k]]);
        if (path[k] != known)
          soma_places_[path[k]] = {number, length > 0. ? std::min(1., so_far / length) : 1.};
      }
      if (known < count) hang(cable, soma_places_[known]);
    };
    std::vector<std::size_t> first = path_from(0);
    if (daughters[0].size() > 1) {
      const std::vector<std::size_t> other = path_from(daughters[0][1]);
      first.insert(first.begin(), other.rbegin(), other.rend());
    }
    lay(first, count);
    for (std::size_t i = 0; i < count; ++i)
      for (std::size_t k = i == 0 ? 2 : 1; k < daughters[i].size(); ++k) {
        std::vector<std::size_t> path = path_from(daughters[i][k]);
        path.insert(path.begin(), i);
        lay(path, i);
      }
  }

  const Morphology& m_;
  SomaPlaces soma_place_;
  std::map<std::string, std::size_t> numbers_;  // of the arrays
  std::vector<Place> soma_places_;
  std::size_t first_neurite_ = 0;
};

void number(std::string& text, float value) {
  std::array<char, 32> digits;
  text.append(digits.data(), std::to_chars(digits.data(), digits.data() + digits.size(), value).ptr);
}
void numbers(std::string& text, std::initializer_list<float> values) {
  for (std::string_view separator = ""; const float value : values) {
    text += separator, number(text, value);
    separator = ", ";
  }
}
void place(std::string& text, const Vec3& v) { numbers(text, {v.x(), v.y(), v.z()}); }
void point(std::string& text, const Point& p) {
  numbers(text, {p.x, p.y, p.z, std::min(2.f * p.radius, std::numeric_limits<float>::max())});
}

/// Statements in procedures that stay below what hoc's compiler holds.
class Procedures {
 public:
  /// A block of `owner { … }` is opened again where a procedure ends within it.
  void statement(std::string_view owner, std::string_view text) {
    if (lines_ >= most_lines) end();
    if (lines_ == 0) text_ += fmt::format("\nproc build_{}() {{\n", count_);
    if (owner_ != owner) {
      close();
      if (!owner.empty()) text_ += fmt::format("  {} {{\n", owner);
      owner_ = owner;
    }
    text_ += owner.empty() ? "  " : "    ";
    text_ += text;
    text_ += '\n';
    ++lines_;
  }

  /// The procedures, and one `build` that calls them all.
  std::string take() {
    if (lines_ > 0) end();
    std::size_t first = 0;
    while (count_ - first > most_lines) {  // procedures that call procedures
      const std::size_t last = count_;
      for (std::size_t i = first; i < last; ++i) statement({}, fmt::format("build_{}()", i));
      end();
      first = last;
    }
    text_ += "\nproc build() {\n";
    for (std::size_t i = first; i < count_; ++i) text_ += fmt::format("  build_{}()\n", i);
    return text_ + "}\n";
  }

 private:
  static constexpr std::size_t most_lines = 90;  // statements; some open and close a block

  void close() {
    if (!owner_.empty()) text_ += "  }\n";
    owner_.clear();
  }
  void end() {
    close();
    text_ += "}\n";
    lines_ = 0;
    ++count_;
  }

  std::string text_, owner_;
  std::size_t lines_ = 0, count_ = 0;
};

std::string joined(const std::vector<std::string>& words) {
  return fmt::format("{}", fmt::join(words, ", "));
}

constexpr std::string_view hoc_head =
    R"(// A cell for NEURON, written by Brain Forest; lengths and diameters in um. In hoc:
//   load_file("this file")
//   objref cell
//   cell = new {0}()
// Lists of sections: all, somatic, axonal, basal, apical. geom_nseg(d_lambda) and fill_diameters(d) are told below.
begintemplate {0}
)";

constexpr std::string_view hoc_tail = R"(
// As many segments as signals of 100 Hz need: none longer than d_lambda (0.1 unless given) of the length constant, by Ra and
// cm as they are now. Sections without diameter are passed over.
proc geom_nseg() { local i, d, lambdas, d_lambda
  d_lambda = 0.1
  if (numarg() > 0) d_lambda = $1
  forsec all {
    lambdas = 0
    for i = 1, n3d() - 1 {
      d = (diam3d(i - 1) + diam3d(i)) / 2
      if (d > 0) lambdas += (arc3d(i) - arc3d(i - 1)) / sqrt(d)
    }
    lambdas *= 1e-5 * sqrt(4 * PI * 100 * Ra * cm)
    if (lambdas > 500 * d_lambda) lambdas = 500 * d_lambda
    nseg = int((lambdas / d_lambda + 0.9) / 2) * 2 + 1
  }
}

// Gives points whose diameter was never measured (0 in the file) one of d um.
proc fill_diameters() { local i
  forsec all {
    for i = 0, n3d() - 1 {
      if (diam3d(i) == 0) pt3dchange(i, $1)
    }
  }
}

)";

constexpr std::string_view python_head =
    R"("""A cell for NEURON, written by Brain Forest; lengths and diameters in um.

    from this_file import Cell
    cell = Cell()

Lists of sections: all, somatic, axonal, basal, apical; and one for each name, such as soma and dend.
"""
)";

constexpr std::string_view python_sections = R"(from math import pi, sqrt

from neuron import h

# name, list, parent (a row), where on the parent, the point there where the section begins elsewhere, points x y z diameter
SECTIONS = (
)";

constexpr std::string_view python_tail = R"(    def __init__(self):
        self.all = []
        for name, kind, parent, where, joint, points in SECTIONS:
            sections = getattr(self, name)
            section = h.Section(name="%s[%d]" % (name, len(sections)), cell=self)
            sections.append(section)
            self.all.append(section)
            if kind is not None:
                getattr(self, kind).append(section)
            if joint is not None:
                h.pt3dstyle(1, *joint, sec=section)
            for point in points:
                section.pt3dadd(*point)
            if parent is not None:
                section.connect(self.all[parent](where), 0)
        self.geom_nseg()

    def geom_nseg(self, d_lambda=0.1):
        """As many segments as signals of 100 Hz need: none longer than d_lambda of the length constant, by Ra and cm as
        they are now. Sections without diameter are passed over."""
        for section in self.all:
            lambdas = 0.0
            for i in range(1, section.n3d()):
                d = (section.diam3d(i - 1) + section.diam3d(i)) / 2
                if d > 0:
                    lambdas += (section.arc3d(i) - section.arc3d(i - 1)) / sqrt(d)
            lambdas *= 1e-5 * sqrt(4 * pi * 100 * section.Ra * section.cm)
            section.nseg = int((min(lambdas / d_lambda, 500) + 0.9) / 2) * 2 + 1

    def fill_diameters(self, d):
        """Gives points whose diameter was never measured (0 in the file) one of d um."""
        for section in self.all:
            for i in range(section.n3d()):
                if section.diam3d(i) == 0:
                    section.pt3dchange(i, d)

    def __repr__(self):
        return "Cell[%d]" % self._number
)";

}  // namespace

std::string write_neuron_hoc(const Morphology& morphology) {
  const Morphology kept = as_kept(morphology, neuron_keeps);
  const Plan cell(kept);

  std::vector<std::string> names, arrays, objects{"all"};
  objects.insert(objects.end(), lists.begin(), lists.end());
  for (const Array& array : cell.arrays) {
    names.push_back(array.name);
    arrays.push_back(fmt::format("{}[{}]", array.name, array.size));
  }
  std::string text = comment_lines(kept.annotations(), "//");
  text += fmt::format("public {}, geom_nseg, fill_diameters, init\n", joined(objects));
  text += fmt::format("objref {}\n", joined(objects));
  // One line each, since hoc's lines have an end.
  for (const std::string& name : names) text += fmt::format("public {}\n", name);
  for (const std::string& array : arrays) text += fmt::format("create {}\n", array);

  Procedures procedures;
  std::string line;
  for (std::size_t i = 0; i < cell.cables.size(); ++i) {
    const Cable& cable = cell.cables[i];
    const std::string name = cell.name(i);
    const auto say = [&](std::string_view begin, auto write, std::string_view end) {
      line = begin;
      write(line);
      line += end;
      procedures.statement(name, line);
    };
    if (cable.wired)
      say(
          "pt3dstyle(1, ", [&](std::string& t) { place(t, cable.place); }, ")");
    for (const Point& p : cable.points)
      say(
          "pt3dadd(", [&](std::string& t) { point(t, p); }, ")");
  }
  for (std::size_t i = 0; i < cell.cables.size(); ++i)
    if (const Cable& cable = cell.cables[i]; cable.parent >= 0)
      procedures.statement({}, fmt::format("connect {}(0), {}({})", cell.name(i),
                                           cell.name(std::size_t(cable.parent)), cable.at));
  text += procedures.take();

  text += hoc_tail;
  text += "proc init() { local i\n";
  for (const std::string& object : objects) text += fmt::format("  {} = new SectionList()\n", object);
  for (const Array& array : cell.arrays)
    text += fmt::format("  for i = 0, {} {}[i] {{ all.append(){}{}{} }}\n", array.size - 1, array.name,
                        array.list.empty() ? "" : " ", array.list, array.list.empty() ? "" : ".append()");
  text += "  build()\n  geom_nseg()\n}\n";

  const std::string name = fmt::format("Cell_{:016x}", hash64(std::as_bytes(std::span(text))));
  return fmt::format(fmt::runtime(hoc_head), name) + text + fmt::format("endtemplate {}\n", name);
}

std::string write_neuron_python(const Morphology& morphology) {
  const Morphology kept = as_kept(morphology, neuron_keeps);
  const Plan cell(kept);
  std::string text(python_head);
  text += comment_lines(kept.annotations(), "#");
  text += python_sections;
  for (const Cable& cable : cell.cables) {
    const Array& array = cell.arrays[cable.array];
    text += fmt::format("    (\"{}\", {}, {}, {}, ", array.name,
                        array.list.empty() ? "None" : fmt::format("\"{}\"", array.list),
                        cable.parent < 0 ? "None" : std::to_string(cable.parent), cable.at);
    if (cable.wired)
      text += '(', place(text, cable.place), text += ')';
    else
      text += "None";
    text += ", (\n";
    for (const Point& p : cable.points) text += "        (", point(text, p), text += "),\n";
    text += "    )),\n";
  }
  text += ")\n\n\nclass Cell:\n    _count = 0\n\n";
  std::string lines = "        self._number = Cell._count\n        Cell._count += 1\n";
  for (const std::string_view list : lists) lines += fmt::format("        self.{} = []\n", list);
  for (const Array& array : cell.arrays) lines += fmt::format("        self.{} = []\n", array.name);
  std::string tail(python_tail);
  const std::string_view opening = "        self.all = []\n";
  tail.insert(tail.find(opening), lines);
  return text + tail;
}

}  // namespace forest::io
