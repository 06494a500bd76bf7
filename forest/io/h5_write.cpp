// SPDX-License-Identifier: Apache-2.0
// Writing of neurons in HDF5: h5.h.
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <set>
#include <utility>

#include <fmt/format.h>

#include "forest/core/error.h"
#include "forest/io/h5.h"
#include "forest/io/h5_names.h"
#include "forest/io/hdf5.h"
#include "forest/io/swc_rows.h"

namespace forest::io {
namespace {

using namespace h5;

float diameter(float radius) { return std::min(2.f * radius, std::numeric_limits<float>::max()); }

void add_points(std::vector<float>& numbers, std::span<const Point> points) {
  for (const Point& p : points) {
    for (const float number : {p.x, p.y, p.z, diameter(p.radius)}) numbers.push_back(number);
  }
}

/// Points on a circle around the soma's middle: the outline that other programs read.
std::vector<Point> circle(const Point& sphere) {
  constexpr int corners = 16;
  std::vector<Point> points;
  for (int i = 0; i < corners; ++i) {
    const double angle = 2. * std::numbers::pi * i / corners;
    points.push_back({float(sphere.x + sphere.radius * std::cos(angle)),
                      float(sphere.y + sphere.radius * std::sin(angle)), sphere.z, 0.f});
  }
  return points;
}

class Writer {
 public:
  Writer(hdf5::NewFile& file, std::string prefix, const Morphology& m)
      : file_(file), prefix_(std::move(prefix)), m_(m) {}

  void write() {
    if (!prefix_.empty()) file_.group(prefix_);
    if (m_.sections().empty() && m_.soma().kind == SomaKind::none) file_.group(own(""));
    choose_family();
    write_sections();
    write_metadata();
    write_annotations();
    if (!m_.spines().empty()) write_spines();
  }

 private:
  std::string path(std::string_view name) const { return prefix_ + '/' + std::string(name); }
  std::string own(std::string_view name) const {
    return prefix_ + '/' + std::string(own_group) + (name.empty() ? "" : "/") + std::string(name);
  }
  std::string root() const { return prefix_.empty() ? "/" : prefix_; }

  void choose_family() {
    const auto all = [&](SectionKind kind) {
      return std::ranges::all_of(m_.sections(), [&](const Section& s) { return s.kind == kind; });
    };
    const auto found = std::ranges::find(m_.annotations(), family_key, &Annotations::value_type::first);
    const std::string_view said = found == m_.annotations().end() ? "" : std::string_view(found->second);
    if (all(SectionKind::glia) && (!m_.sections().empty() || said == family_names[glia]))
      family_ = glia;
    else if (all(SectionKind::custom) && said == family_names[spine])
      family_ = spine;
  }

  std::int32_t type_of(const Section& s) const {
    if (family_ != neuron) return s.tag;
    return swc_kind(s.tag) == s.kind ? s.tag : std::int32_t(s.kind);
  }

  void write_sections() {
    const Soma& soma = m_.soma();
    const bool has_soma = soma.kind != SomaKind::none;
    std::vector<float> numbers;
    std::vector<std::int32_t> rows, types, places, nodes;
    if (has_soma) {
      add_points(numbers, soma.kind == SomaKind::contours ? soma.points : circle(soma.sphere()));
      rows = {0, std::int32_t(soma_type), -1};
    }
    first_point_ = std::int32_t(numbers.size() / 4);
    numbers.reserve(numbers.size() + 4 * m_.points().size());
    bool plain = true, usual = true;
    for (std::size_t i = 0; i < m_.sections().size(); ++i) {
      const Section& s = m_.sections()[i];
      const std::int32_t type = type_of(s);
      const bool known = type >= 0 && type <= 19 && type != soma_type;
      plain = plain && known;
      types.push_back(type);
      rows.push_back(first_point_ + std::int32_t(s.first_point));
      rows.push_back(known ? type : std::int32_t(SectionKind::custom));
      rows.push_back(s.parent.valid() ? std::int32_t(s.parent.value()) + has_soma : has_soma ? 0 : -1);
      if (s.parent.valid() && m_.children(s.parent).size() == 1) nodes.push_back(std::int32_t(i));
      if (s.parent.valid()) continue;
      places.push_back(s.soma_point);
      usual = usual && s.soma_point == (has_soma ? 0 : -1);
    }
    add_points(numbers, m_.points());
    file_.write(path("points"), numbers, 4);
    file_.write(path("structure"), rows, 3);
    if (!plain) file_.write(own("types"), types);
    if (!usual) file_.write(own("root_soma_points"), places);
    if (!nodes.empty()) file_.write(own("single_daughters"), nodes);
    if (soma.kind == SomaKind::sphere || soma.kind == SomaKind::cylinders) {
      std::vector<float> exact;
      add_points(exact, soma.points);
      file_.write(own("soma"), exact, 4);
    }
    if (soma.kind == SomaKind::cylinders) file_.write(own("soma_parents"), soma.parents);
    if (soma.contour_starts.size() > 1)
      file_.write(own("contour_starts"),
                  std::vector<std::int32_t>(soma.contour_starts.begin(), soma.contour_starts.end()));
  }

  void write_metadata() {
    file_.group(path("metadata"));
    file_.attribute(path("metadata"), "version", std::array<std::uint32_t, 2>{1, 3});
    file_.attribute(path("metadata"), "cell_family", std::array<std::uint32_t, 1>{std::uint32_t(family_)});
  }

  /// Annotations that the format has words for go there, the others into the own group.
  void write_annotations() {
    const Annotations& all = m_.annotations();
    std::vector<bool> placed(all.size(), false);
    std::vector<float> perimeters;
    bool comment = false;
    constexpr std::size_t longest_attribute = 60000;
    for (std::size_t i = 0; i < all.size(); ++i) {
      const auto& [key, value] = all[i];
      if (key == comment_key && !comment && !value.empty() && value.size() < longest_attribute &&
          value.find('\0') == value.npos) {
        file_.attribute(root(), "comment", value);
        // Read back it is the first of all; where it is not, it keeps its place among the others, too.
        comment = true, placed[i] = i == 0 && std::ranges::count(all, all[i]) == 1;
      } else if (key == family_key && family_ != neuron && value == family_names[std::size_t(family_)] &&
                 std::ranges::find(all, family_key, &Annotations::value_type::first) - all.begin() ==
                     std::ptrdiff_t(i)) {
        placed[i] = true;
      } else if (key == perimeters_key && perimeters.empty()) {
        placed[i] = parse_perimeters(value, perimeters);
      }
    }
    if (perimeters.empty() && family_ == glia)
      for (const Point& p : m_.points()) perimeters.push_back(perimeter_of(p));
    if (!perimeters.empty()) {
      perimeters.insert(perimeters.begin(), std::size_t(first_point_), 0.f);
      file_.write(path(perimeters_key), perimeters);
    }
    for (const OrganelleTable& kind : organelle_tables) write_table(kind, placed);
    write_mitochondria(placed);

    std::string text;
    std::vector<std::int32_t> sizes;
    for (std::size_t i = 0; i < all.size(); ++i)
      if (!placed[i])
        for (const std::string& part : {all[i].first, all[i].second}) {
          text += part;
          sizes.push_back(std::int32_t(part.size()));
        }
    if (sizes.empty()) return;
    file_.write(own("annotations"),
                std::span(reinterpret_cast<const std::uint8_t*>(text.data()), text.size()));
    file_.write(own("annotation_sizes"), sizes);
  }

  bool parse_perimeters(std::string_view text, std::vector<float>& values) const {
    Numbers numbers(text);
    const std::size_t count = m_.points().size();
    for (std::size_t i = 0; i < count; ++i) {
      float value = 0.f;
      if (!numbers.next(value)) break;
      values.push_back(value);
    }
    if (values.size() == count && numbers.at_end()) return true;
    values.clear();
    return false;
  }

  /// All rows or none: a reader finds them side by side.
  void write_table(const OrganelleTable& kind, std::vector<bool>& placed) {
    std::array<std::vector<std::int32_t>, 4> whole;
    std::array<std::vector<float>, 4> real;
    const Annotations& all = m_.annotations();
    for (const auto& [key, value] : all) {
      if (key != kind.group) continue;
      Numbers numbers(value);
      for (std::size_t c = 0; c < kind.count; ++c)
        if (kind.columns[c].whole ? !numbers.next(whole[c].emplace_back())
                                  : !numbers.next(real[c].emplace_back()))
          return;
      if (!numbers.at_end()) return;
    }
    if (whole[0].empty()) return;
    for (std::size_t c = 0; c < kind.count; ++c) {
      const std::string name = fmt::format("{}/{}/{}", path("organelles"), kind.group, kind.columns[c].name);
      if (kind.columns[c].whole)
        file_.write(name, whole[c]);
      else
        file_.write(name, real[c]);
    }
    for (std::size_t i = 0; i < all.size(); ++i)
      if (all[i].first == kind.group) placed[i] = true;
  }

  void write_mitochondria(std::vector<bool>& placed) {
    std::vector<float> points;
    std::vector<std::int32_t> rows;
    const Annotations& all = m_.annotations();
    for (const auto& [key, value] : all) {
      if (key != mitochondrion_key) continue;
      Numbers numbers(value);
      std::int32_t parent = 0;
      if (!numbers.next(parent)) return;
      rows.push_back(std::int32_t(points.size() / 3));
      rows.push_back(parent);
      while (!numbers.at_end())
        if (!numbers.next(points.emplace_back())) return;
      if (points.size() % 3) return;
    }
    if (rows.empty()) return;
    file_.write(path("organelles/mitochondria/points"), points, 3);
    file_.write(path("organelles/mitochondria/structure"), rows, 2);
    for (std::size_t i = 0; i < all.size(); ++i)
      if (all[i].first == mitochondrion_key) placed[i] = true;
  }

  void write_spines() {
    std::vector<float> numbers;
    std::vector<std::int32_t> owners;
    for (const Spine& s : m_.spines()) {
      owners.push_back(std::int32_t(s.section.value()));
      for (const float number :
           {s.position, s.head.x(), s.head.y(), s.head.z(), s.head_diameter, s.neck_diameter, float(s.shape)})
        numbers.push_back(number);
    }
    file_.write(own("spines"), numbers, 7);
    file_.write(own("spine_sections"), owners);
  }

  hdf5::NewFile& file_;
  std::string prefix_;
  const Morphology& m_;
  Family family_ = neuron;
  std::int32_t first_point_ = 0;  // of the first section
};

}  // namespace

std::string write_h5(const Morphology& morphology) {
  hdf5::NewFile file;
  Writer(file, "", morphology).write();
  return file.bytes();
}

std::string write_h5(std::span<const NamedMorphology> cells) {
  std::set<std::string> paths, groups;
  for (const auto& [name, morphology] : cells) {
    const std::string path = '/' + name;
    if ((path + '/').find("//") != path.npos || (path + '/').find("/./") != path.npos ||
        !paths.insert(path).second)
      throw Error(fmt::format(
          "a container needs different names for its cells; '{}' will not do or stands twice", name));
    for (std::size_t slash = path.find('/', 1); slash != path.npos; slash = path.find('/', slash + 1))
      groups.insert(path.substr(0, slash));
  }
  for (const std::string& group : groups)
    if (paths.contains(group))
      throw Error(fmt::format("a container cannot hold cells in the cell '{}'; rename it", group.substr(1)));
  hdf5::NewFile file;
  for (const auto& [name, morphology] : cells) Writer(file, '/' + name, morphology).write();
  return file.bytes();
}

}  // namespace forest::io
