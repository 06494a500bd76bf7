// SPDX-License-Identifier: Apache-2.0
#include "forest/io/swc.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <ranges>
#include <utility>

#include <fmt/format.h>

#include "forest/core/bounds.h"
#include "forest/core/error.h"
#include "forest/io/numbers.h"
#include "forest/io/oddity.h"
#include "forest/io/swc_rows.h"
#include "forest/morphology/measure.h"

namespace forest::io {
namespace {

constexpr std::array<Oddity, static_cast<std::size_t>(SwcOddity::count)> table{{
    {"byte-order-mark", false, "the mark is skipped"},
    {"padding", false, "what stands behind the text is skipped"},
    {"line-ends", false, "read as line ends of any system"},
    {"text-header", false, "kept as a comment"},
    {"blank-line", false, "skipped"},
    {"late-comment", false, "kept with the comments of the header"},
    {"trailing-comment", false, "such comments are skipped", {}, true},
    {"trailing-text", false, "kept as a comment", "see whether rows are missing"},
    {"typography", false, "read as blanks, minus signs and nothing"},
    {"tabs", false, "read as blanks"},
    {"commas", false, "read as blanks"},
    {"decimal-commas", false, "read as decimal points"},
    {"extra-columns", false, "all but the first seven are skipped", {}, true},
    {"decimal-integer", false, "read as the whole number it is"},
    {"exponent", false, "read as the number it is"},
    {"unknown-radius", true,
     "read as the radius of the parent point, at the beginning of a neurite of the next that has one",
     "measure it where thickness matters"},
    {"negative-radius", true,
     "read as unknown, so as the radius of the parent point, at the beginning of a neurite of the next that "
     "has one",
     "measure it where thickness matters"},
    {"zero-radius", true, "kept as 0", "give the measured one"},
    {"unknown-place", true, "read as that of the parent point",
     "look it up in the tracing, or remove the point"},
    {"precision", true, "read as one place", "move the neuron to the origin, then read it again", true},
    {"first-id", false, "any id may be the first"},
    {"id-order", false, "ids need be neither consecutive nor sorted"},
    {"negative-id", true, "read as an id; a parent of -1 still means none"},
    {"repeated-row", true, "skipped"},
    {"duplicate-id", true, "a parent means the last such row above it",
     "split the file if several were put one after the other"},
    {"child-first", true, "the order of rows does not matter"},
    {"root-marker", true, "read as a root"},
    {"self-parent", true, "read as a root"},
    {"missing-parent", true, "read as a root", "give it the parent it was traced from"},
    {"several-roots", true, "kept as a tree of its own, attached to no soma point",
     "give its first point a parent if it belongs to the cell"},
    {"type-undefined", false, "read as a neurite of undefined kind", "give it its type"},
    {"type-custom", false, "read as a neurite of custom kind, its number kept",
     "nothing, where all who read it know the number"},
    {"type-negative", true, "read as a neurite of custom kind, its number kept", "give it its type"},
    {"type-change", true, "a new section begins here", "nothing, if the types are right"},
    {"cnic-types", false, "read as the type of the point before"},
    {"soma-under-neurite", true, "the tree is turned so that it begins at the soma"},
    {"soma-inside-neurite", true, "read as a point of that neurite"},
    {"several-somata", true,
     "joined to the first point of the first soma; split the file if it holds several cells",
     "split the file if it holds several cells"},
    {"soma-three-points-turned", false, "read as a sphere"},
    {"soma-three-points-inexact", false, "read as a sphere"},
    {"soma-three-points-off", false, "read as cylinders"},
    {"soma-three-points-attachment", true, "attached to the sphere"},
    {"soma-contour", false, "read as an outline"},
    {"soma-branches", false, "read as joined cylinders"},
    {"all-soma", false, "the first one is read as the soma, the others as neurites of undefined kind",
     "give the neurites their types"},
    {"units", false, "read as µm; if they are nm, scale by 0.001, if mm by 1000",
     "divide places and radii by 1000 if they are in nm, multiply by as much if in mm"},
}};

using Oddities = OddityList<SwcOddity>;
constexpr std::int32_t none = -1, soma_type = swc_soma_type;

/// From an id to its row: by subtraction, by a direct table, or by search, whichever the ids allow.
class RowOfId {
 public:
  explicit RowOfId(const SwcRows& rows) : rows_(rows) {
    if (rows.consecutive || rows.size() == 0) return;
    const auto [low, high] = std::ranges::minmax(rows.ids);
    first_ = low;
    const std::uint64_t width = static_cast<std::uint64_t>(high) - static_cast<std::uint64_t>(low);
    if (width < 4 * rows.size() + 1024) {
      direct_.assign(width + 1, none);
      for (std::size_t i = 0; i < rows.size() && !duplicates_; ++i) {
        std::int32_t& entry = direct_[static_cast<std::size_t>(rows.ids[i] - low)];
        duplicates_ = entry != none;
        entry = static_cast<std::int32_t>(i);
      }
      if (!duplicates_) return;
      direct_.clear();
    }
    sorted_.resize(rows.size());
    for (std::size_t i = 0; i < sorted_.size(); ++i) sorted_[i] = {rows.ids[i], static_cast<std::int32_t>(i)};
    std::ranges::sort(sorted_);
    duplicates_ = std::ranges::adjacent_find(sorted_, {}, &Entry::first) != sorted_.end();
  }

  /// Of several rows with this id the last one before `asking`, else the first one after it; -1 when there is
  /// none.
  std::int32_t find(std::int64_t id, std::size_t asking) const {
    if (!sorted_.empty()) {
      const auto after = std::ranges::lower_bound(sorted_, Entry{id, static_cast<std::int32_t>(asking)});
      if (after != sorted_.begin() && std::prev(after)->first == id) return std::prev(after)->second;
      return after != sorted_.end() && after->first == id ? after->second : none;
    }
    if (!direct_.empty()) {
      const std::uint64_t at = static_cast<std::uint64_t>(id) - static_cast<std::uint64_t>(first_);
      return at < direct_.size() ? direct_[static_cast<std::size_t>(at)] : none;
    }
    const std::uint64_t at = static_cast<std::uint64_t>(id) - static_cast<std::uint64_t>(rows_.ids[0]);
    return at < rows_.size() ? static_cast<std::int32_t>(at) : none;
  }
  bool duplicates() const { return duplicates_; }

 private:
  using Entry = std::pair<std::int64_t, std::int32_t>;
  const SwcRows& rows_;
  std::int64_t first_ = 0;
  std::vector<std::int32_t> direct_;
  std::vector<Entry> sorted_;
  bool duplicates_ = false;
};

/// Rows to a morphology, in the order of the functions below.
class Assembler {
 public:
  Assembler(SwcRows rows, const std::string& name, Oddities& oddities)
      : rows_(std::move(rows)), name_(name), oddities_(oddities) {}

  Morphology assemble() {
    if (rows_.size() == 0 && !rows_.without_points)
      throw InputError(name_, 0, "holds no point; a row of SWC is: id type x y z radius parent");
    if (rows_.size() > static_cast<std::size_t>(std::numeric_limits<std::int32_t>::max()))
      throw InputError(name_, 0, "has more than 2147483647 points; split it into several files");
    look_at_ids();
    if (!rows_.consecutive && RowOfId(rows_).duplicates()) drop_repeated_rows();
    find_parents();
    find_order();
    look_for_cnic();
    settle_soma();
    if (roots_ > 1) tell_roots();
    if (rows_.unknown_numbers) fill_unknown_numbers();
    look_at_types();
    build_soma();
    build_sections();
    for (const Spine& spine : rows_.spines) builder_.add_spine(spine);
    for (auto& [key, value] : rows_.annotations) builder_.annotate(std::move(key), std::move(value));
    return builder_.build();
  }

 private:
  bool is_soma(std::int32_t row) const { return rows_.types[std::size_t(row)] == soma_type; }
  std::size_t line(std::int32_t row) const { return rows_.line(std::size_t(row)); }
  std::int32_t count() const { return static_cast<std::int32_t>(rows_.size()); }

  /// Rows parents first: order[0…n); the order of the file where that is so already.
  template <class Visit>
  void parents_first(Visit visit) const {
    if (order_.empty())
      for (std::int32_t row = 0; row < count(); ++row) visit(row);
    else
      for (const std::int32_t row : order_) visit(row);
  }

  void look_at_ids() {
    const auto& ids = rows_.ids;
    if (ids.empty()) return;
    if (ids[0] != 1)
      oddities_.add(SwcOddity::first_id, line(0),
                    [&] { return fmt::format("the first id is {}, not 1", ids[0]); });
    if (!rows_.consecutive) {
      const auto jump = std::ranges::adjacent_find(ids, [](auto a, auto b) { return b != a + 1; });
      const auto row = std::int32_t(jump - ids.begin()) + 1;
      oddities_.add(SwcOddity::id_order, line(row),
                    [&] { return fmt::format("id {} follows {}", jump[1], jump[0]); });
    }
    if (ids[0] < 0 || !rows_.consecutive)
      for (std::int32_t row = 0; row < count(); ++row)
        if (ids[std::size_t(row)] < 0)
          oddities_.add(SwcOddity::negative_id, line(row),
                        [&] { return fmt::format("the id is {}", ids[std::size_t(row)]); });
  }

  /// Drops rows that say again what a row above said, and tells of other rows with one id.
  void drop_repeated_rows() {
    std::vector<std::pair<std::int64_t, std::int32_t>> sorted(rows_.size());
    for (std::size_t i = 0; i < sorted.size(); ++i) sorted[i] = {rows_.ids[i], std::int32_t(i)};
    if (!std::ranges::is_sorted(sorted)) std::ranges::sort(sorted);
    std::vector<std::int32_t> repeated;
    for (std::size_t k = 1; k < sorted.size(); ++k) {
      const auto [id, b] = sorted[k];
      if (id != sorted[k - 1].first) continue;
      const std::size_t i = std::size_t(sorted[k - 1].second), j = std::size_t(b);
      const bool same = rows_.points[i] == rows_.points[j] && rows_.types[i] == rows_.types[j] &&
                        rows_.parents[i] == rows_.parents[j];
      if (same) repeated.push_back(b);
      oddities_.add(same ? SwcOddity::repeated_row : SwcOddity::duplicate_id, line(b), [&] {
        return fmt::format("the id {} stands on line {} too", rows_.ids[j], line(std::int32_t(i)));
      });
    }
    if (repeated.empty()) return;
    std::ranges::sort(repeated);
    std::vector<SwcRows::Jump> jumps;
    std::size_t n = 0;
    auto next = repeated.begin();
    for (std::int32_t row = 0; row < count(); ++row) {
      if (next != repeated.end() && *next == row) {
        ++next;
        continue;
      }
      const std::size_t i = std::size_t(row);
      if (const std::size_t before = line(row) - n - 1; jumps.empty() || jumps.back().lines_before != before)
        jumps.push_back({n, before});
      rows_.ids[n] = rows_.ids[i], rows_.parents[n] = rows_.parents[i], rows_.types[n] = rows_.types[i],
      rows_.points[n] = rows_.points[i];
      ++n;
    }
    rows_.ids.resize(n), rows_.parents.resize(n), rows_.types.resize(n), rows_.points.resize(n);
    rows_.jumps = std::move(jumps);
  }

  void find_parents() {
    const RowOfId row_of(rows_);
    const std::size_t n = rows_.size();
    parents_.resize(n);
    for (std::size_t i = 0; i < n; ++i) {
      const std::int64_t parent = rows_.parents[i];
      const std::int32_t row = static_cast<std::int32_t>(i);
      std::int32_t found = parent == -1 ? none : row_of.find(parent, i);
      if (found == none && parent != -1) {
        if (parent <= 0)
          oddities_.add(SwcOddity::root_marker, line(row),
                        [&] { return fmt::format("the parent is {}, a root has -1", parent); });
        else
          oddities_.add(SwcOddity::missing_parent, line(row),
                        [&] { return fmt::format("the parent {} is not in the file", parent); });
      } else if (parent == rows_.ids[i] && parent != -1) {
        if (!row_of.duplicates() || found >= row) {
          oddities_.add(SwcOddity::self_parent, line(row), "the point is its own parent");
          found = none;
        }
      } else if (found > row) {
        forward_ = true;
        oddities_.add(SwcOddity::child_first, line(row),
                      [&] { return fmt::format("the parent {} comes later", parent); });
      }
      parents_[i] = found;
      roots_ += found == none;
    }
  }

  void find_order() {
    if (!forward_) return;
    enum : std::uint8_t { unseen, waiting, placed };
    std::vector<std::uint8_t> state(rows_.size(), unseen);
    order_.clear();
    order_.reserve(rows_.size());
    std::vector<std::int32_t> path;
    for (std::int32_t row = 0; row < count(); ++row) {
      for (std::int32_t at = row; at != none && state[std::size_t(at)] != placed;
           at = parents_[std::size_t(at)]) {
        if (state[std::size_t(at)] == waiting) throw cycle(at);
        state[std::size_t(at)] = waiting;
        path.push_back(at);
      }
      for (; !path.empty(); path.pop_back()) {
        state[std::size_t(path.back())] = placed;
        order_.push_back(path.back());
      }
    }
  }

  InputError cycle(std::int32_t row) const {
    std::string ids;
    std::int32_t at = row;
    int steps = 0;
    do {
      at = parents_[std::size_t(at)];
      if (++steps <= 5) ids += fmt::format(" -> {}", rows_.ids[std::size_t(at)]);
    } while (at != row);
    if (steps > 5) ids += " ...";
    return InputError(name_, line(row),
                      fmt::format("the point is its own ancestor ({}{}); correct one of these parents",
                                  rows_.ids[std::size_t(row)], ids));
  }

  /// Files of the CNIC and of navis call every branch point 5 and every tip 6, whatever they belong to; but a
  /// root may have any type. Such points get the type of the point before, or after where there is none
  /// before.
  void look_for_cnic() {
    const auto& types = rows_.types;
    const auto marked = [](std::int32_t type) { return type == 5 || type == 6; };
    if (rows_.to_the_letter || std::ranges::none_of(types, marked)) return;
    std::vector<std::uint8_t> below(rows_.size(), 0);
    for (const std::int32_t parent : parents_)
      if (parent != none && below[std::size_t(parent)] < 2) ++below[std::size_t(parent)];
    bool other = false;
    for (std::size_t i = 0; i < types.size(); ++i) {
      if (types[i] == soma_type) continue;
      const std::int32_t expected = below[i] == 0 ? 6 : below[i] == 1 ? none : 5;
      const bool root = parents_[i] == none;
      if (expected == none ? marked(types[i]) : types[i] != expected && !root) return;
      other = other || expected == none;
    }
    if (!other) return;
    oddities_.add(SwcOddity::cnic_types, 0, "every branch point is of type 5 and every tip of type 6");
    std::vector<std::int32_t> unresolved;
    parents_first([&](std::int32_t row) {
      std::int32_t& type = rows_.types[std::size_t(row)];
      const std::int32_t parent = parents_[std::size_t(row)];
      if (!marked(type)) {
        for (std::int32_t at = parent; type != soma_type && at != none && marked(types[std::size_t(at)]);
             at = parents_[std::size_t(at)])
          rows_.types[std::size_t(at)] = type;
      } else if (parent != none && !is_soma(parent) && !marked(types[std::size_t(parent)])) {
        type = types[std::size_t(parent)];
      } else {
        unresolved.push_back(row);
      }
    });
    for (const std::int32_t row : unresolved)
      if (marked(types[std::size_t(row)])) rows_.types[std::size_t(row)] = 0;
  }

  bool hangs_on_neurite(std::int32_t row) const {
    const std::int32_t parent = parents_[std::size_t(row)];
    return is_soma(row) && parent != none && !is_soma(parent);
  }

  /// Where soma points hang on neurites: turns the tree to begin at the soma when that has no other place,
  /// else takes them for points of the neurite.
  void settle_soma() {
    std::int32_t top = none;
    bool proper = false;
    for (std::int32_t row = 0; row < count(); ++row) {
      if (!is_soma(row)) continue;
      soma_rows_.push_back(row);
      proper = proper || parents_[std::size_t(row)] == none;
      if (hangs_on_neurite(row) && (top == none || radius(row) > radius(top))) top = row;
    }
    if (top != none) {
      if (!proper) turn(top);
      parents_first([&](std::int32_t row) {
        if (!hangs_on_neurite(row)) return;
        rows_.types[std::size_t(row)] = rows_.types[std::size_t(parents_[std::size_t(row)])];
        oddities_.add(SwcOddity::soma_inside_neurite, line(row), "a soma point follows a neurite point");
      });
    }
    if (soma_rows_.size() == rows_.size() && soma_rows_.size() >= 100 && soma_branches() &&
        !rows_.to_the_letter) {
      oddities_.add(SwcOddity::all_soma, line(0),
                    [&] { return fmt::format("all {} points are of type 1 (soma)", rows_.size()); });
      for (std::int32_t row = 0; row < count(); ++row)
        if (parents_[std::size_t(row)] != none) rows_.types[std::size_t(row)] = 0;
    }
    if (top == none && order_.empty() && (soma_rows_.empty() || is_soma(soma_rows_.back()))) return;
    soma_rows_.clear();
    parents_first([&](std::int32_t row) {
      if (is_soma(row)) soma_rows_.push_back(row);
    });
  }

  /// Makes `top` the root of its tree.
  void turn(std::int32_t top) {
    oddities_.add(SwcOddity::soma_under_neurite, line(top), "the soma hangs on a neurite");
    std::int32_t before = none;
    for (std::int32_t at = top; at != none;) {
      const std::int32_t next = parents_[std::size_t(at)];
      parents_[std::size_t(at)] = before;
      before = at;
      at = next;
    }
    forward_ = true;
    find_order();
  }

  void tell_roots() {
    bool first = soma_rows_.empty();
    for (std::int32_t row = 0; row < count(); ++row)
      if (parents_[std::size_t(row)] == none && !is_soma(row) && !std::exchange(first, false) &&
          rows_.parents[std::size_t(row)] == -1)
        oddities_.add(SwcOddity::several_roots, line(row), "one more neurite without parent");
  }

  float radius(std::int32_t row) const { return rows_.points[std::size_t(row)].radius; }

  bool soma_branches() const {
    std::vector<std::int32_t> above;
    for (const std::int32_t row : soma_rows_)
      if (const std::int32_t parent = parents_[std::size_t(row)]; parent != none) above.push_back(parent);
    std::ranges::sort(above);
    return std::ranges::adjacent_find(above) != above.end();
  }

  void build_soma() {
    place_.assign(rows_.size(), none);
    Soma soma;
    for (const std::int32_t row : soma_rows_) {
      const std::int32_t parent = parents_[std::size_t(row)];
      if (parent == none && !soma.points.empty())
        oddities_.add(SwcOddity::several_somata, line(row), "one more soma point without parent");
      place_[std::size_t(row)] = std::int32_t(soma.points.size());
      soma.parents.push_back(parent != none ? place_[std::size_t(parent)] : soma.points.empty() ? none : 0);
      soma.points.push_back(rows_.points[std::size_t(row)]);
    }
    const std::size_t points = soma.points.size();
    soma.kind = points == 0 ? SomaKind::none : points == 1 ? SomaKind::sphere : SomaKind::cylinders;
    if (rows_.to_the_letter) {
      if (!rows_.outline.empty()) soma = outline();
    } else if (points == 3 && soma.parents[1] == 0 && soma.parents[2] == 0) {
      three_points(soma);
    } else if (points > 3) {
      if (const auto starts = closed_loops(soma); !starts.empty()) {
        oddities_.add(SwcOddity::soma_contour, line(soma_rows_[0]),
                      "the soma points are thin and run round in closed loops");
        soma.kind = SomaKind::contours;
        soma.contour_starts = starts;
      } else if (soma_branches()) {
        oddities_.add(SwcOddity::soma_branches, line(soma_rows_[0]), "the chain of soma points branches");
      }
    }
    if (soma.kind != SomaKind::cylinders) soma.parents.clear();
    soma_ = soma.kind;
    tell_zero_radii();
    builder_.set_soma(std::move(soma));
  }

  /// The points of an outline need no thickness.
  void tell_zero_radii() {
    std::vector<std::size_t> drawn;
    if (soma_ == SomaKind::contours)
      for (const std::int32_t row : soma_rows_) drawn.push_back(line(row));
    std::ranges::sort(drawn);
    for (const std::size_t line : rows_.zero_radii)
      if (!std::ranges::binary_search(drawn, line))
        oddities_.add(SwcOddity::zero_radius, line, "the radius is 0");
  }

  Soma outline() const {
    if (rows_.outline.size() < 3)
      throw InputError(name_, 0, fmt::format("has fewer than 3 {} lines; remove them", swc_outline_key));
    return {.kind = SomaKind::contours,
            .points = rows_.outline,
            .parents = {},
            .contour_starts = rows_.outline_starts};
  }

  /// NeuroMorpho.Org writes a sphere as its centre and two points one radius below and above (in y); older
  /// files and turned cells have them on another axis. Coordinates have two decimals there.
  void three_points(Soma& soma) {
    const Point centre = soma.points[0], low = soma.points[1], high = soma.points[2];
    const Vec3 down = low.position() - centre.position(), up = high.position() - centre.position();
    const float r = centre.radius;
    const float rounding = 0.0055f + 1.2e-7f * centre.position().cwiseAbs().maxCoeff();
    const float off = std::max({std::abs(down.norm() - r), std::abs(up.norm() - r), (down + up).norm(),
                                std::abs(low.radius - r), std::abs(high.radius - r)});
    const std::size_t where = line(soma_rows_[1]);
    if (off > std::max(0.1f * r, rounding)) {
      oddities_.add(SwcOddity::soma_three_points_off, where, [&] {
        return fmt::format("the three soma points are up to {:.3g} µm off those of a sphere", off);
      });
      return;
    }
    if (off > rounding)
      oddities_.add(SwcOddity::soma_three_points_inexact, where, [&] {
        return fmt::format("the three soma points are {:.3g} µm off those of a sphere", off);
      });
    if ((down - Vec3(0.f, -r, 0.f)).norm() > std::max(0.1f * r, rounding))
      oddities_.add(SwcOddity::soma_three_points_turned, where,
                    "the outer soma points lie not below and above the centre");
    soma = {.kind = SomaKind::sphere, .points = {centre}, .parents = {}, .contour_starts = {}};
    for (std::size_t i = 1; i < 3; ++i) place_[std::size_t(soma_rows_[i])] = -2;  // a neurite here is told of
  }

  /// The first points of closed loops that together are all soma points, in chains from each root; none when
  /// they are no outline. A loop closes where a point returns to its first; the last one also where it comes
  /// near.
  std::vector<std::uint32_t> closed_loops(const Soma& soma) const {
    const std::size_t n = soma.points.size();
    std::vector<std::uint32_t> starts;
    std::size_t start = 0;
    double length = 0.;
    float thickest = 0.f;
    Vec3 sum = Vec3::Zero();
    for (std::size_t i = 0; i < n; ++i) {
      const bool root = parents_[std::size_t(soma_rows_[i])] == none;
      if (!root && soma.parents[i] != std::int32_t(i) - 1) return {};
      const Point& point = soma.points[i];
      if (i > start) length += segment_length(soma.points[i - 1], point);
      thickest = std::max(thickest, point.radius);
      sum += point.position();
      const std::size_t size = i - start + 1;
      const bool last = i + 1 == n || parents_[std::size_t(soma_rows_[i + 1])] == none;
      const double gap = segment_length(soma.points[start], point);
      const bool closed = size >= 4 && (gap == 0. || (last && gap <= 1.5 * length / double(size - 1)));
      if (last && !closed) return {};
      if (!closed) continue;
      const Vec3 centre = sum / float(size);
      double spread = 0.;
      for (std::size_t k = start; k <= i; ++k)
        spread += (soma.points[k].position() - centre).norm() / double(size);
      if (thickest > 0.25 * spread) return {};
      starts.push_back(std::uint32_t(start));
      start = i + 1, length = 0., thickest = 0.f, sum = Vec3::Zero();
    }
    return starts;
  }

  // At the beginning of a neurite a thickness is that of the next point that has one: the soma's is no neurite's.
  void fill_unknown_beginnings() {
    std::vector<float> below(rows_.size(), NAN);  // of this point, or one that follows
    const auto visit = [&](std::int32_t row) {
      float& own = below[std::size_t(row)];
      if (!std::isnan(radius(row))) own = radius(row);
      const std::int32_t parent = parents_[std::size_t(row)];
      const bool begins = !is_soma(row) && (parent == none || is_soma(parent));
      if (begins && std::isnan(radius(row)))
        rows_.points[std::size_t(row)].radius = std::isnan(own) ? 0.f : own;
      if (parent != none && !std::isnan(own)) below[std::size_t(parent)] = own;
    };
    std::vector<std::int32_t> order;
    parents_first([&](std::int32_t row) { order.push_back(row); });
    for (const std::int32_t row : order | std::views::reverse) visit(row);
  }

  void fill_unknown_numbers() {
    fill_unknown_beginnings();
    parents_first([&](std::int32_t row) {
      Point& point = rows_.points[std::size_t(row)];
      const std::int32_t parent = parents_[std::size_t(row)];
      const Point above = parent == none ? Point{} : rows_.points[std::size_t(parent)];
      const bool placed = std::isfinite(point.x) && std::isfinite(point.y) && std::isfinite(point.z);
      if (!placed && parent == none)
        throw InputError(name_, line(row),
                         "the first point of a tree has no place; give its coordinates in µm");
      if (std::isnan(point.x)) point.x = above.x;
      if (std::isnan(point.y)) point.y = above.y;
      if (std::isnan(point.z)) point.z = above.z;
      if (std::isnan(point.radius)) point.radius = above.radius;
    });
  }

  void look_at_types() {
    const std::size_t n = rows_.size();
    daughters_.assign(n, 0);
    for (std::size_t i = 0; i < n; ++i) {
      const std::int32_t type = rows_.types[i], parent = parents_[i];
      if (type == soma_type) continue;
      if (parent != none && daughters_[std::size_t(parent)] < 2) ++daughters_[std::size_t(parent)];
      if (type >= 2 && type <= 4) continue;
      if (type >= 1 && type <= 19) continue;
      const std::size_t where = line(std::int32_t(i));
      if (type == 0)
        oddities_.add(SwcOddity::type_undefined, where, "the type is 0");
      else
        oddities_.add(type < 0 ? SwcOddity::type_negative : SwcOddity::type_custom, where,
                      [&] { return fmt::format("the type is {}", type); });
    }
    look_at_units();
  }

  void look_at_units() {
    const std::size_t n = rows_.size(), step = n / 256 + 1;
    float mean = 0.f;
    Bounds bounds;
    for (std::size_t i = 0; i < n; i += step) {
      mean += rows_.points[i].radius / float(n / step + 1);
      bounds.add(rows_.points[i].position());
    }
    const bool giant = !soma_rows_.empty() && radius(soma_rows_[0]) > 150.f;
    if ((n > 100 && mean > 30.f) || giant)
      oddities_.add(SwcOddity::units, 0, "the radii are far larger than those of neurons in µm");
    if (n > 20 && bounds.extent().norm() < 2.f)
      oddities_.add(SwcOddity::units, 0, "all of it is far smaller than neurons are in µm");
  }

  struct Run {  // the rows of a section, its joint aside
    std::int32_t first_row, rows, parent, soma_point;
  };

  void build_sections() {
    std::vector<std::uint8_t> node(rows_.nodes.empty() ? 0 : rows_.size(), 0);
    for (const std::int64_t id : rows_.nodes) {
      const std::int64_t row = id - (rows_.size() ? rows_.ids[0] : 0);
      if (row >= 0 && row < count()) node[std::size_t(row)] = 1;
    }
    std::vector<Run> runs;
    bool scattered = false;
    parents_first([&](std::int32_t row) {
      const std::size_t i = std::size_t(row);
      if (rows_.types[i] == soma_type) return;
      const std::int32_t parent = parents_[i];
      const bool root = parent == none || is_soma(parent);
      if (!root && daughters_[std::size_t(parent)] == 1 && (node.empty() || !node[i])) {
        if (rows_.types[std::size_t(parent)] == rows_.types[i]) {
          place_[i] = place_[std::size_t(parent)];
          ++runs[std::size_t(place_[i])].rows;
          scattered = scattered || parent != row - 1;
          return;
        }
        oddities_.add(SwcOddity::type_change, line(row), [&] {
          return fmt::format("the type changes from {} to {} without a branch point",
                             rows_.types[std::size_t(parent)], rows_.types[i]);
        });
      }
      place_[i] = std::int32_t(runs.size());
      runs.push_back({row, 1, root ? none : place_[std::size_t(parent)],
                      parent == none ? none
                      : root         ? soma_point(row, parent)
                                     : none});
    });

    std::vector<Point> gathered;
    std::vector<std::size_t> begins;
    if (scattered) gather(runs, gathered, begins);
    builder_.reserve(runs.size(), rows_.size() + runs.size());
    for (std::size_t s = 0; s < runs.size(); ++s) {
      const Run& run = runs[s];
      const std::span<const Point> points =
          scattered ? std::span(gathered).subspan(begins[s], std::size_t(run.rows))
                    : std::span(rows_.points).subspan(std::size_t(run.first_row), std::size_t(run.rows));
      const std::int32_t type = rows_.types[std::size_t(run.first_row)];
      builder_.add_section(run.parent == none ? SectionId() : SectionId(std::size_t(run.parent)),
                           swc_kind(type), points, type, run.soma_point);
    }
  }

  /// For files in which the rows of a section do not follow one another.
  void gather(const std::vector<Run>& runs, std::vector<Point>& points, std::vector<std::size_t>& begins) {
    begins.reserve(runs.size());
    std::size_t total = 0;
    for (const Run& run : runs) begins.push_back(std::exchange(total, total + std::size_t(run.rows)));
    points.resize(total);
    std::vector<std::size_t> next = begins;
    parents_first([&](std::int32_t row) {
      if (!is_soma(row))
        points[next[std::size_t(place_[std::size_t(row)])]++] = rows_.points[std::size_t(row)];
    });
  }

  std::int32_t soma_point(std::int32_t row, std::int32_t parent) {
    const std::int32_t place = place_[std::size_t(parent)];
    if (place == -2)
      oddities_.add(SwcOddity::soma_three_points_attachment, line(row),
                    "a neurite hangs on an outer one of the three soma points");
    return soma_ == SomaKind::sphere || rows_.outline.size() ? 0 : std::max(place, 0);
  }

  SwcRows rows_;
  const std::string& name_;
  Oddities& oddities_;
  MorphologyBuilder builder_;
  std::vector<std::int32_t> parents_;    // rows; -1 of a root
  std::vector<std::int32_t> order_;      // rows, parents first; empty when the file has them so
  std::vector<std::int32_t> soma_rows_;  // parents first
  std::vector<std::int32_t> place_;      // of a soma row: its soma point; of a neurite row: its section
  std::vector<std::uint8_t> daughters_;  // neurite rows below a row: 0, 1, or 2 for more
  SomaKind soma_ = SomaKind::none;
  std::int32_t roots_ = 0;
  bool forward_ = false;
};

}  // namespace

std::span<const Oddity> swc_oddities() { return table; }

bool recognises_swc(std::string_view bytes) {
  const auto columns = [](std::string_view line) {  // of numbers; 0 when anything else stands there
    std::size_t count = 0;
    bool inside = false;
    for (const char c : line) {
      if (c == '#') break;
      if (is_blank(c) || c == ',' || c == '\r') {
        inside = false;
      } else if (is_digit(c) || c == '.' || c == '-' || c == '+' || c == 'e' || c == 'E') {
        count += !inside;
        inside = true;
      } else {
        return std::size_t(0);
      }
    }
    return count;
  };
  bytes = bytes.substr(0, 1 << 16);
  for (int lines = 0; lines < 500 && !bytes.empty(); ++lines) {
    const std::size_t end = std::min(bytes.find_first_of("\r\n"), bytes.size());
    if (columns(bytes.substr(0, end)) >= 7) return true;
    bytes.remove_prefix(std::min(end + 1, bytes.size()));
  }
  return false;
}

ReadResult read_swc(std::string_view bytes, const std::string& name) {
  OddityList<SwcOddity> oddities(table);
  try {
    SwcRows rows = scan_swc(bytes, name, oddities);
    Morphology morphology = Assembler(std::move(rows), name, oddities).assemble();
    return {std::move(morphology), oddities.take()};
  } catch (const InputError&) {
    throw;
  } catch (const Error& error) {
    throw InputError(name, 0, error.what());
  }
}

}  // namespace forest::io
