// SPDX-License-Identifier: Apache-2.0
#include "forest/io/h5.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <optional>
#include <set>
#include <utility>

#include <fmt/format.h>

#include "forest/core/error.h"
#include "forest/io/h5_names.h"
#include "forest/io/hdf5.h"
#include "forest/io/hdf5_image.h"
#include "forest/io/numbers.h"
#include "forest/io/oddity.h"
#include "forest/io/swc_rows.h"

namespace forest::io {
namespace {

using namespace h5;
using hdf5::Array;
using hdf5::Image;

enum class H5Oddity : std::uint8_t {
  several_cells,
  version_2,
  unused_points,
  empty_section,
  soma_two_points,
  root_marker,
  self_parent,
  missing_parent,
  child_first,
  joint_missing,
  single_daughter,
  unknown_place,
  negative_radius,
  type_custom,
  glia_unsaid,
  perimeters_size,
  organelles_odd,
  not_kept,
  count
};

constexpr std::string_view keep_the_file = "keep the file beside what is made of it";

constexpr std::array<Oddity, static_cast<std::size_t>(H5Oddity::count)> table{{
    {"several-cells", false, "only the first is read here; import the file to have all"},
    {"version-2", false, "converted to what version 1 has"},
    {"unused-points", false, "they are skipped"},
    {"empty-section", false, "left out; daughters go to the parent"},
    {"soma-two-points", false, "read as a cylinder between them"},
    {"root-marker", false, "read as roots that leave from no soma"},
    {"self-parent", false, "read as roots"},
    {"missing-parent", false, "read as roots", "give them the parents they were traced from"},
    {"child-first", false,
     "the order of rows does not matter; sections that organelles name keep their old numbers"},
    {"joint-missing", false, "the parent's last point is put in front"},
    {"single-daughter", false, "kept as sections of their own", "nothing, if sections begin there"},
    {"unknown-place", false, "read as those of the point before", "look them up in the tracing"},
    {"negative-radius", false, "read as those of the point before", "measure them where thickness matters"},
    {"type-custom", false, "read as neurites of custom kind, the numbers kept",
     "nothing, where all who read it know the numbers"},
    {"glia-unsaid", false, "read as glia"},
    {"perimeters-size", false, "left out", keep_the_file, true},
    {"organelles-odd", false, "left out", keep_the_file, true},
    {"not-kept", false, "left out", keep_the_file, true},
}};

using Oddities = OddityList<H5Oddity>;

// Groups and their members
// ---------------------------------------------------------------------------

/// The members of a group by name.
class Members {
 public:
  Members(const Image& image, const Image::Object& group) : image_(image), links_(image.links(group)) {}

  std::optional<Image::Object> find(std::string_view name) const {
    const auto link = std::ranges::lower_bound(links_, name, {}, &Image::Link::name);
    if (link == links_.end() || link->name != name) return std::nullopt;
    if (link->address == Image::Link::soft)
      image_.refuse(fmt::format("{} is a soft link, which is not followed; put there what it names", name));
    return image_.open(link->address);
  }
  bool has(std::string_view name) const {
    return std::ranges::binary_search(links_, name, {}, &Image::Link::name);
  }
  const std::vector<Image::Link>& links() const { return links_; }

 private:
  const Image& image_;
  std::vector<Image::Link> links_;
};

/// A cell of version 1 may be called neuron1, too.
bool is_version_2(const Image& image, const Members& members) {
  const auto neuron = members.find("neuron1");
  if (!neuron) return false;
  if (!neuron->is_group()) return true;  // which is refused
  const auto structure = Members(image, *neuron).find("structure");
  return !structure || !structure->is_array();
}

/// One cell of an image: a group with `points` and `structure`, or `neuron1`.
class CellReader {
 public:
  CellReader(const Image& image, const Image::Object& group, const Members& members, Oddities& oddities)
      : image_(image), group_(group), members_(members), oddities_(oddities) {}

  Morphology read() {
    if (is_version_2(image_, members_)) {
      read_version_2(Members(image_, *members_.find("neuron1")));
    } else {
      read_version_1();
    }
    mend_points();
    drop_empty_rows();
    find_soma();
    sections();
    annotate();
    return builder_.build();
  }

 private:
  std::size_t rows() const { return offsets_.size(); }
  std::size_t end_of(std::size_t row) const { return row + 1 < rows() ? offsets_[row + 1] : points_.size(); }
  bool is_soma(std::size_t row) const { return types_[row] == soma_type && family_ != spine; }

  Array required(const Members& members, std::string_view name, std::size_t columns, bool whole) {
    const auto object = members.find(name);
    if (!object || !object->is_array())
      image_.refuse(
          fmt::format("holds no neuron: there is no array {}; a neuron has points and structure", name));
    Array array = image_.array(*object, name);
    if (array.shape.size() != 2 || array.shape[1] != columns)
      image_.refuse(
          fmt::format("array {} has not {} columns; points have x y z diameter, structure has first point, "
                      "type and parent",
                      name, columns));
    if (whole && array.real)
      image_.refuse(fmt::format("array {} holds real numbers; write whole ones", name));
    return array;
  }

  void take_points(const Array& array) {
    static_assert(sizeof(Point) == 4 * sizeof(float));
    points_.resize(array.count() / 4);
    if (points_.size() > std::numeric_limits<std::int32_t>::max())
      image_.refuse("has more than 2147483647 points; split it into several files");
    // A Point is its four numbers, one after the other.
    array.copy(std::span(reinterpret_cast<float*>(points_.data()), 4 * points_.size()));
    for (Point& p : points_) p.radius *= .5f;
  }

  void read_version_1() {
    if (members_.has("connectivity"))
      throw NotANeuron(image_.name(), 0,
                       "holds blood vessels (connectivity), not a neuron; vessels are not read");
    if (const auto metadata = members_.find("metadata")) {
      const auto version = image_.integers(*metadata, "version");
      if (!version.empty() && (version[0] != 1 || version.size() < 2 || version[1] < 0 || version[1] > 3))
        image_.refuse(
            fmt::format("is of version {} of the format; 1.0 to 1.3 and 2 are read, write one of those",
                        fmt::join(version, ".")));
      const auto family = image_.integers(*metadata, "cell_family");
      if (!family.empty()) family_ = family[0];
      if (family_ < neuron || family_ > spine)
        image_.refuse(fmt::format("cell_family is {}; it may be 0 (neuron), 1 (glia) or 2 (spine)", family_));
    }
    const Array points = required(members_, "points", 4, false);
    const Array structure = required(members_, "structure", 3, true);
    take_points(points);
    std::vector<std::int64_t> cells(structure.count());
    structure.copy(std::span(cells));
    const std::size_t count = cells.size() / 3;
    offsets_.resize(count), types_.resize(count), parents_.resize(count);
    for (std::size_t row = 0; row < count; ++row) {
      offsets_[row] = checked_offset(cells[3 * row], row);
      types_[row] = checked_type(cells[3 * row + 1], row);
      parents_[row] = cells[3 * row + 2];
    }
    if (count && !points_.empty() && offsets_[0] > 0)
      oddities_.add(H5Oddity::unused_points, 0,
                    [&] { return fmt::format("{} points belong to no section", offsets_[0]); });
    read_perimeters();
  }

  std::size_t checked_offset(std::int64_t offset, std::size_t row) {
    if (offset < last_offset_ || std::size_t(offset) > points_.size())
      image_.refuse(fmt::format("row {} of structure begins at point {} of {}; rows must follow one another",
                                row, offset, points_.size()));
    return std::size_t(last_offset_ = offset);
  }

  std::int32_t checked_type(std::int64_t type, std::size_t row) const {
    if (type < std::numeric_limits<std::int32_t>::min() || type > std::numeric_limits<std::int32_t>::max())
      image_.refuse(fmt::format("row {} of structure has type {}; types are small numbers", row, type));
    return std::int32_t(type);
  }

  /// /neuron1 of Brion: points by stage, offsets and parents apart from types; the soma may have several rows.
  void read_version_2(const Members& root) {
    oddities_.add(H5Oddity::version_2, 0, "the file is of version 2 of the format");
    const auto folder = root.find("structure");
    if (!folder) image_.refuse("holds no neuron: neuron1 has no structure");
    const Members structures(image_, *folder);
    for (const std::string_view stage : {"repaired", "unraveled", "raw"}) {
      const auto group = root.find(stage);
      if (!group) continue;
      const Members members(image_, *group);
      if (!members.has("points")) continue;
      take_points(required(members, "points", 4, false));
      const Array structure = required(structures, structures.has(stage) ? stage : "raw", 2, true);
      const Array types = required(structures, "sectiontype", 1, true);
      std::vector<std::int64_t> cells(structure.count()), kinds(types.count());
      structure.copy(std::span(cells));
      types.copy(std::span(kinds));
      const std::size_t count = kinds.size();
      if (2 * count != cells.size())
        image_.refuse(
            fmt::format("has {} sections but {} types; the file is damaged", cells.size() / 2, count));
      std::size_t somata = 0;
      while (somata < count && kinds[somata] == soma_type) ++somata;
      const std::size_t extra = somata > 1 ? somata - 1 : 0;  // rows that the one of the soma takes in
      for (std::size_t row = 0; row < count; ++row) {
        if (row > 0 && row <= extra) continue;
        const std::int64_t parent = cells[2 * row + 1];
        offsets_.push_back(checked_offset(cells[2 * row], row));
        types_.push_back(checked_type(kinds[row], row));
        parents_.push_back(parent <= std::int64_t(extra) ? std::min<std::int64_t>(parent, 0)
                                                         : parent - std::int64_t(extra));
      }
      return;
    }
    image_.refuse("holds no neuron: neuron1 has no points");
  }

  void read_perimeters() {
    const auto object = members_.find("perimeters");
    const bool neurites = rows() > (rows() && is_soma(0) ? 1u : 0u);
    if (!object) {
      if (family_ == glia && neurites)
        image_.refuse(
            "is a glia cell without perimeters, which such files must have; add them or set cell_family to "
            "0");
      return;
    }
    const Array array = image_.array(*object, perimeters_key);
    if (array.shape.size() != 1)
      image_.refuse("has perimeters in several columns; there is one for each point");
    if (array.count() != points_.size()) {
      oddities_.add(H5Oddity::perimeters_size, 0, [&] {
        return fmt::format("there are {} perimeters for {} points", array.count(), points_.size());
      });
      return;
    }
    perimeters_.resize(array.count());
    array.copy(std::span(perimeters_));
    const bool told = std::ranges::any_of(perimeters_, [](float p) { return p > 0.f; });
    if (family_ != neuron || !told || !neurites) return;
    for (std::size_t row = 0; row < rows(); ++row)
      if (!is_soma(row) && types_[row] != 2 && types_[row] != 3) return;
    family_ = glia;
    oddities_.add(H5Oddity::glia_unsaid, 0,
                  "cell_family says neuron, but there are perimeters and only types 2 and 3, as of glia");
  }

  void mend_points() {
    float sum = 0.f, least = 0.f;
    for (const Point& p : points_) {
      sum += 0.f * p.x + 0.f * p.y + 0.f * p.z + 0.f * p.radius;  // NaN as soon as one is not finite
      least = std::min(least, p.radius);
    }
    if (sum == 0.f && least >= 0.f) return;
    std::size_t unknown = 0, negative = 0;
    Point before;
    for (Point& p : points_) {
      bool odd = false;
      for (float Point::*number : {&Point::x, &Point::y, &Point::z, &Point::radius})
        if (!std::isfinite(p.*number)) p.*number = before.*number, odd = true;
      unknown += odd;
      if (p.radius < 0.f) p.radius = before.radius, ++negative;
      before = p;
    }
    if (unknown)
      oddities_.add(H5Oddity::unknown_place, 0,
                    [&] { return fmt::format("numbers of {} points are not finite", unknown); });
    if (negative)
      oddities_.add(H5Oddity::negative_radius, 0,
                    [&] { return fmt::format("the diameters of {} points are negative", negative); });
  }

  /// Rows without points, but for a soma's.
  void drop_empty_rows() {
    const auto empty = [&](std::size_t row) {
      return offsets_[row] == end_of(row) && !(row == 0 && is_soma(0));
    };
    std::vector<std::int64_t> places(rows());  // of rows that stay
    std::size_t stay = 0;
    for (std::size_t row = 0; row < rows(); ++row) places[row] = empty(row) ? -1 : std::int64_t(stay++);
    const std::size_t dropped = rows() - stay;
    if (dropped == 0) return;
    oddities_.add(H5Oddity::empty_section, 0,
                  [&] { return fmt::format("{} rows of structure have no point", dropped); });
    const auto inside = [&](std::int64_t row) { return row >= 0 && std::size_t(row) < rows(); };
    // What the first row without points on the way to a root leads to is kept for the others: the way is gone once.
    std::vector<std::int64_t> parents = parents_;
    std::vector<std::size_t> way;
    for (std::size_t row = 0; row < rows(); ++row) {
      std::int64_t at = parents[row];
      way.assign(1, row);
      for (; inside(at) && places[std::size_t(at)] < 0; at = parents[std::size_t(at)]) {
        if (way.size() > dropped + 1)
          image_.refuse(
              fmt::format("row {} of structure is its own ancestor; correct one of the parents", at));
        way.push_back(std::size_t(at));
      }
      for (const std::size_t w : way) parents[w] = at;
    }
    for (std::size_t row = 0; row < rows(); ++row) {
      if (places[row] < 0) continue;
      const std::size_t place = std::size_t(places[row]);
      const std::int64_t parent = parents[row];
      parents_[place] = inside(parent) ? places[std::size_t(parent)]
                        : parent < 0   ? parent
                                       : std::numeric_limits<std::int64_t>::max();  // still missing
      offsets_[place] = offsets_[row];
      types_[place] = types_[row];
    }
    offsets_.resize(stay), types_.resize(stay), parents_.resize(stay);
  }

  void find_soma() {
    for (std::size_t row = 1; row < rows(); ++row)
      if (is_soma(row))
        image_.refuse(fmt::format("row {} of structure is of type 1; only row 0 may be the soma", row));
    if (rows() == 0 && !members_.has(own_group))
      image_.refuse("holds no section; a neuron has one or a soma");
    has_soma_ = rows() && is_soma(0);
    if (!has_soma_) return;
    const std::span<const Point> points = std::span(points_).subspan(offsets_[0], end_of(0) - offsets_[0]);
    Soma soma{.kind = SomaKind::contours,
              .points = {points.begin(), points.end()},
              .parents = {},
              .contour_starts = {0}};
    if (points.size() == 1)
      image_.refuse("has a soma of one point; the format needs an outline of three and more");
    if (points.empty()) soma = {};
    if (points.size() == 2) {
      soma.kind = SomaKind::cylinders;
      soma.parents = {-1, 0};
      soma.contour_starts.clear();
      oddities_.add(H5Oddity::soma_two_points, 0, "the soma has two points, too few for an outline");
    }
    soma_ = std::move(soma);
  }

  /// The parent's row, or -1 for a root; soma_point is set for roots.
  std::int64_t parent_of(std::size_t row, std::int32_t& soma_point) {
    const std::int64_t parent = parents_[row];
    soma_point = -1;
    const auto told = [&](H5Oddity code, std::string_view what) {
      oddities_.add(code, 0, [&] { return fmt::format("row {} of structure {}", row, what); });
      return std::int64_t(-1);
    };
    if (has_soma_ && parent == 0) {
      soma_point = soma_.kind == SomaKind::none ? -1 : 0;
      return -1;
    }
    if (parent == -1 && !has_soma_) return -1;
    if (parent < 0) return told(H5Oddity::root_marker, "has no parent");
    if (std::size_t(parent) == row) return told(H5Oddity::self_parent, "is its own parent");
    if (std::size_t(parent) >= rows())
      return told(H5Oddity::missing_parent, "has a parent that is not there");
    return parent;
  }

  Section section_of(std::size_t row) {
    const std::int32_t type = types_[row];
    if (family_ == neuron && (type < 0 || type > 19))
      oddities_.add(H5Oddity::type_custom, 0,
                    [&] { return fmt::format("row {} of structure has type {}", row, type); });
    const SectionKind kind = family_ == glia    ? SectionKind::glia
                             : family_ == spine ? SectionKind::custom
                                                : swc_kind(type);
    return {.parent = {}, .kind = kind, .tag = type};
  }

  void sections() {
    const std::size_t first_row = has_soma_ ? 1 : 0, count = rows() - first_row;
    const std::size_t base = count ? offsets_[first_row] : points_.size();
    std::vector<Section> sections(count);
    std::vector<std::int64_t> parents(count);
    std::vector<std::uint8_t> daughters(count, 0);
    bool forward = false, joints = true;
    for (std::size_t i = 0; i < count; ++i) {
      const std::size_t row = i + first_row;
      Section& s = sections[i] = section_of(row);
      parents[i] = parent_of(row, s.soma_point);
      if (parents[i] >= 0) parents[i] -= std::int64_t(first_row);
      const std::size_t size = end_of(row) - offsets_[row];
      s.first_point = std::uint32_t(offsets_[row] - base);
      s.point_count = std::uint32_t(size);
      if (parents[i] < 0) continue;
      const std::size_t parent = std::size_t(parents[i]);
      daughters[parent] = std::uint8_t(std::min(2, daughters[parent] + 1));
      s.parent = SectionId(parent);
      if (parent > i) {
        forward = true;
        oddities_.add(H5Oddity::child_first, 0,
                      [&] { return fmt::format("row {} of structure comes before its parent", row); });
      }
      const Point &joint = points_[end_of(parent + first_row) - 1], &first = points_[offsets_[row]];
      if (size < 2 || first.x != joint.x || first.y != joint.y || first.z != joint.z) {
        joints = false;
        oddities_.add(H5Oddity::joint_missing, 0, [&] {
          return fmt::format("row {} of structure does not begin at its parent's last point", row);
        });
      }
    }
    read_own(sections);
    std::vector<std::int64_t> only;
    for (std::size_t i = 0; i < count; ++i)
      if (parents[i] >= 0 && daughters[std::size_t(parents[i])] == 1) only.push_back(std::int64_t(i));
    if (!only.empty() && only != own_nodes_)
      oddities_.add(H5Oddity::single_daughter, 0,
                    [&] { return fmt::format("{} sections are their parent's only daughter", only.size()); });
    builder_.set_soma(std::move(soma_));
    if (!perimeters_.empty())
      perimeters_.erase(perimeters_.begin(), perimeters_.begin() + std::ptrdiff_t(base));
    if (!forward && joints) {
      points_.erase(points_.begin(), points_.begin() + std::ptrdiff_t(base));
      builder_.add_sections(std::move(points_), std::move(sections));
      return;
    }
    const std::vector<std::size_t> order = parents_first(parents, first_row);
    std::vector<SectionId> ids(count);
    for (const std::size_t i : order) {
      const Section& s = sections[i];
      const SectionId parent = parents[i] < 0 ? SectionId() : ids[std::size_t(parents[i])];
      ids[i] = builder_.add_section(parent, s.kind,
                                    std::span(points_).subspan(base + s.first_point, s.point_count), s.tag,
                                    s.soma_point);
    }
    for (Spine& s : spines_)
      if (s.section.value() < count) s.section = ids[s.section.value()];
    if (!perimeters_.empty())
      oddities_.add(H5Oddity::perimeters_size, 0, "perimeters belong to sections that had to be mended");
    perimeters_.clear();
  }

  std::vector<std::size_t> parents_first(const std::vector<std::int64_t>& parents,
                                         std::size_t first_row) const {
    enum : std::uint8_t { unseen, waiting, placed };
    std::vector<std::uint8_t> state(parents.size(), unseen);
    std::vector<std::size_t> order, path;
    for (std::size_t i = 0; i < parents.size(); ++i) {
      for (std::int64_t at = std::int64_t(i); at >= 0 && state[std::size_t(at)] != placed;
           at = parents[std::size_t(at)]) {
        if (state[std::size_t(at)] == waiting)
          image_.refuse(fmt::format("row {} of structure is its own ancestor; correct one of the parents",
                                    std::size_t(at) + first_row));
        state[std::size_t(at)] = waiting;
        path.push_back(std::size_t(at));
      }
      for (; !path.empty(); path.pop_back()) {
        state[path.back()] = placed;
        order.push_back(path.back());
      }
    }
    return order;
  }

  /// What write_h5 put into its own group.
  void read_own(std::vector<Section>& sections) {
    const auto group = members_.find(own_group);
    if (!group || !group->is_group()) return;
    const Members own(image_, *group);
    const auto misfit = [&](std::string_view what) {
      image_.refuse(
          fmt::format("{}/{} does not fit the neuron; remove the group {}", own_group, what, own_group));
    };
    const auto integers = [&](std::string_view name) {
      std::vector<std::int64_t> values;
      if (const auto object = own.find(name)) {
        const Array array = image_.array(*object, name);
        values.resize(array.count());
        array.copy(std::span(values));
        for (const std::int64_t value : values)
          if (value < std::numeric_limits<std::int32_t>::min() ||
              value > std::numeric_limits<std::int32_t>::max())
            misfit(name);
      }
      return values;
    };
    const auto reals = [&](std::string_view name) {
      std::vector<float> values;
      if (const auto object = own.find(name)) {
        const Array array = image_.array(*object, name);
        values.resize(array.count());
        array.copy(std::span(values));
      }
      return values;
    };
    if (own.has("types")) {
      const auto types = integers("types");
      if (types.size() != sections.size()) misfit("types");
      for (std::size_t i = 0; i < sections.size(); ++i) {
        sections[i].tag = std::int32_t(types[i]);
        if (family_ == neuron) sections[i].kind = swc_kind(sections[i].tag);
      }
    }
    if (own.has("soma")) {
      const auto numbers = reals("soma");
      if (numbers.empty() || numbers.size() % 4) misfit("soma");
      soma_ = {.kind = numbers.size() == 4 ? SomaKind::sphere : SomaKind::cylinders,
               .points = {},
               .parents = {},
               .contour_starts = {}};
      for (std::size_t i = 0; i < numbers.size(); i += 4)
        soma_.points.push_back({numbers[i], numbers[i + 1], numbers[i + 2], .5f * numbers[i + 3]});
      if (soma_.kind == SomaKind::cylinders)
        for (const std::int64_t parent : integers("soma_parents"))
          soma_.parents.push_back(std::int32_t(parent));
    }
    if (own.has("contour_starts") && soma_.kind == SomaKind::contours) {
      soma_.contour_starts.clear();
      for (const std::int64_t start : integers("contour_starts"))
        soma_.contour_starts.push_back(std::uint32_t(start));
    }
    own_nodes_ = integers("single_daughters");
    if (own.has("root_soma_points")) {
      const auto places = integers("root_soma_points");
      std::size_t next = 0;
      for (Section& s : sections)
        if (!s.parent.valid() && next < places.size())
          s.soma_point = std::int32_t(std::max<std::int64_t>(places[next++], -1));
    }
    if (own.has("spines")) {
      constexpr std::size_t columns = 7;
      const auto numbers = reals("spines");
      const auto owners = integers("spine_sections");
      if (numbers.size() != columns * owners.size()) misfit("spines");
      for (std::size_t i = 0; i < owners.size(); ++i) {
        const float* n = numbers.data() + columns * i;
        if (owners[i] < 0 || std::size_t(owners[i]) >= sections.size() ||
            !(n[6] >= 0.f && n[6] <= float(SpineShape::branched)) ||
            !std::ranges::all_of(std::span(n, columns), [](float v) { return std::isfinite(v); }))
          misfit("spines");
        spines_.push_back({SectionId(std::size_t(owners[i])), n[0], Vec3(n[1], n[2], n[3]), n[4], n[5],
                           static_cast<SpineShape>(n[6])});
      }
    }
    if (own.has("annotations")) {
      const auto object = own.find("annotations");
      const Array text = image_.array(*object, "annotations");
      std::size_t at = 0;
      std::vector<std::string> parts;
      for (const std::int64_t length : integers("annotation_sizes")) {
        if (length < 0 || std::size_t(length) > text.bytes.size() - at) misfit("annotation_sizes");
        parts.emplace_back(text.bytes.substr(at, std::size_t(length)));
        at += std::size_t(length);
      }
      for (std::size_t i = 0; i + 1 < parts.size(); i += 2)
        own_annotations_.emplace_back(std::move(parts[i]), std::move(parts[i + 1]));
    }
  }

  void annotate() {
    for (const Spine& s : spines_) builder_.add_spine(s);
    const auto among_own = [&](const std::string& comment) {
      return std::ranges::any_of(own_annotations_, [&](const auto& annotation) {
        return annotation.first == comment_key && annotation.second == comment;
      });
    };
    if (auto comment = image_.text(group_, comment_key); comment && !comment->empty() && !among_own(*comment))
      builder_.annotate(std::string(comment_key), std::move(*comment));
    if (family_ != neuron)
      builder_.annotate(std::string(family_key), std::string(family_names[std::size_t(family_)]));
    if (!perimeters_.empty()) {
      std::string text;
      text.reserve(10 * perimeters_.size());
      for (const float perimeter : perimeters_) {
        if (!text.empty()) text += ' ';
        append_shortest(text, perimeter);
      }
      builder_.annotate(std::string(perimeters_key), std::move(text));
    }
    if (const auto organelles = members_.find("organelles"); organelles && organelles->is_group())
      read_organelles(Members(image_, *organelles));
    for (auto& [key, value] : own_annotations_) builder_.annotate(std::move(key), std::move(value));
    constexpr std::array<std::string_view, 7> known{"points",     "structure",    "metadata", "perimeters",
                                                    "organelles", "brain_forest", "neuron1"};
    std::string others;
    const auto left_out = [&](std::string_view what) {
      others += fmt::format("{}{}", others.empty() ? "" : ", ", what);
    };
    for (const Image::Link& link : members_.links())
      if (std::ranges::find(known, link.name) == known.end()) left_out(link.name);
    const auto attributes_of = [&](const Image::Object& object) {
      for (std::string& name : image_.attributes(object)) {
        if (name == comment_key || name == family_key || name == "version") continue;
        if (auto text = image_.text(object, name))
          builder_.annotate(std::move(name), std::move(*text));
        else
          left_out("attribute " + name);
      }
    };
    attributes_of(group_);
    if (const auto metadata = members_.find("metadata")) attributes_of(*metadata);
    if (!others.empty()) {
      constexpr std::size_t enough = 200;
      if (others.size() > enough) others = others.substr(0, enough) + "…";
      oddities_.add(H5Oddity::not_kept, 0, [&] { return "there is more in the file: " + others; });
    }
  }

  void read_organelles(const Members& organelles) {
    std::string others;
    for (const Image::Link& link : organelles.links()) {
      if (link.address == Image::Link::soft) continue;
      const auto row =
          std::ranges::find(organelle_tables, std::string_view(link.name), &OrganelleTable::group);
      const Image::Object group = image_.open(link.address);
      if (!group.is_group()) continue;
      if (row != organelle_tables.end())
        read_table(*row, Members(image_, group));
      else if (link.name == "mitochondria")
        read_mitochondria(Members(image_, group));
      else
        oddities_.add(H5Oddity::not_kept, 0,
                      [&] { return fmt::format("there are organelles of a kind not known, {}", link.name); });
    }
  }

  void read_table(const OrganelleTable& kind, const Members& members) {
    std::array<std::vector<std::int64_t>, 4> whole;
    std::array<std::vector<float>, 4> real;
    std::size_t rows = 0;
    for (std::size_t c = 0; c < kind.count; ++c) {
      const auto object = members.find(kind.columns[c].name);
      if (!object) return odd_organelles(kind.group);
      const Array array = image_.array(*object, kind.columns[c].name);
      if (c == 0) rows = array.count();
      if (array.count() != rows) return odd_organelles(kind.group);
      if (kind.columns[c].whole)
        whole[c].resize(rows), array.copy(std::span(whole[c]));
      else
        real[c].resize(rows), array.copy(std::span(real[c]));
    }
    std::string text;
    for (std::size_t row = 0; row < rows; ++row) {
      text.clear();
      for (std::size_t c = 0; c < kind.count; ++c) {
        if (c) text += ' ';
        if (kind.columns[c].whole)
          append_number(text, whole[c][row]);
        else
          append_shortest(text, real[c][row]);
      }
      builder_.annotate(std::string(kind.group), text);
    }
  }

  void odd_organelles(std::string_view which) {
    oddities_.add(H5Oddity::organelles_odd, 0,
                  [&] { return fmt::format("the arrays of organelles/{} do not fit one another", which); });
  }

  /// One annotation each: the parent, then section, path (0 to 1) and diameter of every point.
  void read_mitochondria(const Members& members) {
    const auto points_object = members.find("points"), structure_object = members.find("structure");
    if (!points_object || !structure_object) return odd_organelles("mitochondria");
    const Array points = image_.array(*points_object, "points"),
                structure = image_.array(*structure_object, "structure");
    if (points.shape.size() != 2 || points.shape[1] != 3 || structure.shape.size() != 2 ||
        structure.shape[1] != 2)
      return odd_organelles("mitochondria");
    std::vector<float> numbers(points.count());
    std::vector<std::int64_t> rows(structure.count());
    points.copy(std::span(numbers));
    structure.copy(std::span(rows));
    const std::int64_t total = std::int64_t(numbers.size() / 3), count = std::int64_t(rows.size() / 2);
    for (std::int64_t i = 0; i < count; ++i) {
      const std::int64_t begin = rows[std::size_t(2 * i)];
      const std::int64_t end = i + 1 < count ? rows[std::size_t(2 * i + 2)] : total;
      if (begin < 0 || begin > end || end > total || (i == 0 && begin != 0))
        return odd_organelles("mitochondria");
    }
    for (std::int64_t i = 0; i < count; ++i) {
      const std::size_t begin = std::size_t(rows[std::size_t(2 * i)]);
      const std::size_t end = std::size_t(i + 1 < count ? rows[std::size_t(2 * i + 2)] : total);
      std::string text;
      append_number(text, rows[std::size_t(2 * i + 1)]);
      for (std::size_t k = 3 * begin; k < 3 * end; ++k) text += ' ', append_shortest(text, numbers[k]);
      builder_.annotate(std::string(mitochondrion_key), std::move(text));
    }
  }

  const Image& image_;
  const Image::Object& group_;
  const Members& members_;
  Oddities& oddities_;
  MorphologyBuilder builder_;
  std::int64_t family_ = neuron, last_offset_ = 0;
  std::vector<Point> points_;
  std::vector<float> perimeters_;
  std::vector<std::size_t> offsets_;
  std::vector<std::int32_t> types_;
  std::vector<std::int64_t> parents_;
  bool has_soma_ = false;
  Soma soma_;
  std::vector<Spine> spines_;
  std::vector<std::int64_t> own_nodes_;  // sections that are only daughters and meant to be
  Annotations own_annotations_;
};

/// How many of the two arrays are there that make a cell of version 1. Cells of a container may be called so, too.
int arrays_of_cell(const Members& members) {
  const auto has = [&](std::string_view name) {
    const auto object = members.find(name);
    return object && object->is_array();
  };
  return has("points") + has("structure");
}

/// Calls visit(name, group, members) for the cells of the file until it returns false.
template <class Visit>
void cells(const Image& image, Visit visit) {
  struct Place {
    std::string name;
    std::uint64_t address;
  };
  std::vector<Place> stack{{"", image.root()}};
  std::set<std::uint64_t> seen;  // links may lead back
  while (!stack.empty()) {
    const Place place = std::move(stack.back());
    stack.pop_back();
    if (!seen.insert(place.address).second) continue;
    const Image::Object group = image.open(place.address);
    if (!group.is_group()) continue;
    const Members members(image, group);
    // What has nothing but arrays in the file's root is told by the reader of cells what is missing.
    const bool root = place.name.empty();
    const bool cell = arrays_of_cell(members) >= (root ? 1 : 2) || is_version_2(image, members);
    if (cell) {
      if (!visit(place.name, group, members)) return;
      continue;
    }
    const auto& links = members.links();
    for (std::size_t i = links.size(); i-- > 0;)
      if (links[i].address != Image::Link::soft)
        stack.push_back({root ? links[i].name : place.name + '/' + links[i].name, links[i].address});
  }
}

ReadResult read_cell(const Image& image, const Image::Object& group, const Members& members,
                     Oddities& oddities, const std::string& name) {
  try {
    Morphology morphology = CellReader(image, group, members, oddities).read();
    return {std::move(morphology), oddities.take()};
  } catch (const InputError&) {
    throw;
  } catch (const Error& error) {
    throw InputError(name, 0, error.what());
  }
}

[[noreturn]] void refuse_without_cells(const Image& image) {
  if (image.text(image.open(image.root()), "magic") == "brainforest cortex")
    throw NotANeuron(image.name(), 0,
                     "holds elements of a cortex; brainforest cortex faces makes surfaces of them, and plant "
                     "--elements puts neurons there");
  throw NotANeuron(image.name(), 0, "holds no neuron: no group of it has the arrays points and structure");
}

}  // namespace

std::span<const Oddity> h5_oddities() { return table; }

bool recognises_h5(std::string_view bytes) { return hdf5::is_hdf5(bytes); }

ReadResult read_h5(std::string_view bytes, const std::string& name) {
  const Image image(bytes, name);
  std::optional<ReadResult> first;
  bool several = false;
  Oddities oddities(table);
  cells(image, [&](const std::string& cell, const Image::Object& group, const Members& members) {
    if (first) {
      several = true;
      first->warnings.insert(first->warnings.begin(),
                             {0, table[std::size_t(H5Oddity::several_cells)].code,
                              fmt::format("there are several cells, {} is another; {}", cell,
                                          table[std::size_t(H5Oddity::several_cells)].reading)});
      return false;
    }
    first = read_cell(image, group, members, oddities, name);
    return true;
  });
  if (!first) refuse_without_cells(image);
  return std::move(*first);
}

std::vector<Cell> read_all_h5(std::string_view bytes, const std::string& name) {
  const Image image(bytes, name);
  std::vector<Cell> all;
  cells(image, [&](const std::string& cell, const Image::Object& group, const Members& members) {
    Oddities oddities(table);
    try {
      all.push_back({cell, read_cell(image, group, members, oddities, name)});
    } catch (const InputError& error) {
      if (cell.empty()) throw;
      throw InputError(name, 0, fmt::format("cell {}: {}", cell, error.sentence()));
    }
    return true;
  });
  if (all.empty()) refuse_without_cells(image);
  // What the file says of all cells together belongs to none of them.
  auto names = image.attributes(image.open(image.root()));
  std::erase(names, "version");
  if (!all[0].name.empty() && !names.empty())
    all[0].read.warnings.push_back(
        {0, "not-kept", fmt::format("the container has attributes ({}); left out", fmt::join(names, ", ")),
         keep_the_file, true});
  return all;
}

}  // namespace forest::io
