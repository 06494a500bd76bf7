// SPDX-License-Identifier: Apache-2.0
// The neuron as a value. A *section* runs from one node (soma, branch point, terminal) to the next; a
// *segment* is the piece between two consecutive points of a section. Terms of N++ (stem, terminal,
// nonterminal, bifurcation, multifurcation) are in docs/glossary.md.
//
//        0────┬─1──      Sections are in parent-first order: parent(i) < i. The first point of a
//   soma      └─2──┬─3   child repeats the last point of its parent (its radius may differ), so each
//                  └─4   section is drawn and measured alone. A root may have a single point, any
//                        other section has at least two.
//
#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "forest/core/bounds.h"
#include "forest/core/id.h"
#include "forest/core/vec.h"

namespace forest {

using SectionId = Id<struct SectionTag>;

/// Numbers are those of SWC. Kinds a file knows and we do not are `custom`, their number kept in
/// Section::tag.
enum class SectionKind : std::uint8_t {
  undefined = 0,
  axon = 2,
  basal = 3,
  apical = 4,
  custom = 5,
  unspecified = 6,
  glia = 7
};

/// "axon", "basal", …; and back, with `custom` for unknown words.
std::string_view name_of(SectionKind kind);
SectionKind section_kind(std::string_view name);

struct Point {
  float x = 0.f, y = 0.f, z = 0.f;  // µm
  float radius = 0.f;               // µm, >= 0

  Vec3 position() const { return {x, y, z}; }
  bool operator==(const Point&) const = default;
};

struct Section {
  SectionId parent;                                // none for a root
  std::uint32_t first_point = 0, point_count = 0;  // into Morphology::points()
  SectionKind kind = SectionKind::undefined;
  std::int32_t tag = 0;  // the number the file gave, for example the SWC type
  std::int32_t soma_point =
      -1;  // a root: index in Soma::points of the point it leaves from; -1 when not known

  bool operator==(const Section&) const = default;
};

enum class SomaKind : std::uint8_t { none, sphere, cylinders, contours };

/// sphere: one point. cylinders: points joined to `parents` (-1 for the first) by tapered cylinders; where all are at one place
/// they are the sphere of the widest.
/// contours: closed outlines, one after the other, beginning at `contour_starts`.
struct Soma {
  SomaKind kind = SomaKind::none;
  std::vector<Point> points;
  std::vector<std::int32_t> parents;
  std::vector<std::uint32_t> contour_starts;

  std::span<const Point> contour(std::size_t i) const {
    const std::size_t end = i + 1 < contour_starts.size() ? contour_starts[i + 1] : points.size();
    return std::span(points).subspan(contour_starts[i], end - contour_starts[i]);
  }
  Point sphere()
      const;  // centre and radius of a sphere of the same place and mean size; radius 0 when there is none
  bool at_one_place() const;  // all points
  double area() const;        // µm²; of contours: the sphere of their mean radius
  bool operator==(const Soma&) const = default;
};

enum class SpineShape : std::uint8_t { unknown, stubby, thin, mushroom, filopodium, branched };

struct Spine {
  SectionId section;
  float position = 0.f;       // path distance from the start of its section, µm
  Vec3 head = Vec3::Zero();   // centre of the head relative to the axis of the section there, µm
  float head_diameter = 0.f;  // µm
  float neck_diameter = 0.f;  // µm
  SpineShape shape = SpineShape::unknown;

  bool operator==(const Spine&) const = default;
};

using Annotations =
    std::vector<std::pair<std::string, std::string>>;  // what a file says of its cell, in its order

/// Immutable; copies share their arrays.
class Morphology {
 public:
  Morphology();  // empty: no soma, no section

  const Soma& soma() const { return data_->soma; }
  std::span<const Point> points() const { return data_->points; }
  std::span<const Section> sections() const { return data_->sections; }
  std::span<const Spine> spines() const { return data_->spines; }
  const Annotations& annotations() const { return data_->annotations; }
  Morphology with_annotations(Annotations annotations) const;  // the same neuron; these instead of its own

  const Section& section(SectionId id) const { return data_->sections[id.value()]; }
  std::span<const Point> points(SectionId id) const {
    const Section& s = section(id);
    return std::span(data_->points).subspan(s.first_point, s.point_count);
  }
  std::span<const SectionId> roots() const { return data_->roots; }
  std::span<const SectionId> children(SectionId id) const;
  bool is_terminal(SectionId id) const { return children(id).empty(); }

  /// Centrifugal order: 0 for a stem (root section), one more at every branch point.
  int order(SectionId id) const { return data_->orders[id.value()]; }
  std::size_t segment_count() const;
  Bounds bounds() const;  // of all points with their radii, soma included

  /// Same soma, sections, points and spines (annotations aside).
  bool operator==(const Morphology& other) const;

 private:
  friend class MorphologyBuilder;
  struct Data {
    Soma soma;
    std::vector<Point> points;
    std::vector<Section> sections;
    std::vector<Spine> spines;
    Annotations annotations;
    std::vector<SectionId> roots, children;  // children grouped by parent
    std::vector<std::uint32_t> first_child;  // sections + 1 entries
    std::vector<std::int32_t> orders;
  };
  explicit Morphology(std::shared_ptr<const Data> data) : data_(std::move(data)) {}
  std::shared_ptr<const Data> data_;
};

/// Collects the parts of a neuron, parents first, and checks the sentences at the head of this file.
/// A violated one throws Error at once.
class MorphologyBuilder {
 public:
  MorphologyBuilder();

  void reserve(std::size_t sections, std::size_t points);
  void set_soma(Soma soma);
  /// Adds a section. For a child whose first point is not at its parent's last point, that point is put in
  /// front of it.
  SectionId add_section(SectionId parent, SectionKind kind, std::span<const Point> points);
  SectionId add_section(SectionId parent, SectionKind kind, std::span<const Point> points, std::int32_t tag,
                        std::int32_t soma_point = -1);
  /// All sections of a neuron whose arrays lie as they will: points section after section, each child beginning at
  /// its parent's last point. For readers of large files; the builder must have no section yet.
  void add_sections(std::vector<Point> points, std::vector<Section> sections);
  void add_spine(const Spine& spine);
  void annotate(std::string key, std::string value);

  Morphology build();  // leaves the builder empty

 private:
  std::shared_ptr<Morphology::Data> data_;
};

}  // namespace forest
