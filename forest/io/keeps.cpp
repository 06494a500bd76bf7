// SPDX-License-Identifier: Apache-2.0
#include "forest/io/keeps.h"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>

#include "forest/core/error.h"
#include "forest/io/swc_rows.h"
#include "forest/morphology/measure.h"

namespace forest::io {
namespace {

std::int32_t kept_tag(const Section& s, const Keeps& keeps) {
  if (keeps.kinds && keeps.tags && !keeps.foreign_tags && swc_type(s) != s.tag) return swc_type(s);
  const bool kept = keeps.kinds && keeps.tags && s.tag >= -keeps.largest_tag && s.tag <= keeps.largest_tag;
  return kept ? s.tag : std::int32_t(keeps.kinds ? s.kind : SectionKind::undefined);
}

// Decimal steps are divided by, since their reciprocal is exact.
float rounded(float value, const Keeps& keeps) {
  const double per = std::round(1. / double(keeps.step));
  return float(std::round(double(value) * per) / per) + 0.f;  // a zero without sign
}

Point kept_point(Point p, const Keeps& keeps) {
  if (keeps.step > 0.f)
    p = {rounded(p.x, keeps), rounded(p.y, keeps), rounded(p.z, keeps), .5f * rounded(2.f * p.radius, keeps)};
  if (p.radius == 0.f) p.radius = .5f * keeps.least_diameter;
  return p;
}

// Whether a section is the only daughter, and of its parent's kind as far as kinds are kept.
bool joins(const Morphology& m, SectionId daughter, const Keeps& keeps) {
  const Section& d = m.section(daughter);
  if (!d.parent.valid() || m.children(d.parent).size() != 1) return false;
  const Section& parent = m.section(d.parent);
  return !keeps.kinds || (parent.kind == d.kind && kept_tag(parent, keeps) == kept_tag(d, keeps));
}

constexpr double shortest = .99e-6;  // µm; the float next to 1e-6 is below it

bool same_place(const Point& a, const Point& b) { return a.x == b.x && a.y == b.y && a.z == b.z; }

Soma kept_soma(const Soma& soma, const Keeps& keeps) {
  const bool simpler = (soma.kind == SomaKind::cylinders && !keeps.cylinders) ||
                       (soma.kind == SomaKind::contours && !keeps.contours);
  if (!simpler) return soma;
  return {.kind = SomaKind::sphere, .points = {soma.sphere()}, .parents = {}, .contour_starts = {}};
}

// Whether an annotation comes back as it is where others become comment lines.
bool keeps_key(const std::pair<std::string, std::string>& annotation, const Keeps& keeps) {
  const auto& [key, value] = annotation;
  if (keeps.keys || std::ranges::find(keeps.own_keys, key) != keeps.own_keys.end()) return true;
  return swc_comment(key + " x").first == key && !key.starts_with("FOREST_") &&
         value.find_first_of("\r\n") == value.npos;
}

// As it is, or a comment for each line of it.
void annotate(MorphologyBuilder& builder, const std::pair<std::string, std::string>& annotation,
              const Keeps& keeps) {
  const auto& [key, value] = annotation;
  if (keeps_key(annotation, keeps)) return builder.annotate(key, value);
  const std::string text = key == "comment" ? value : key + ' ' + value;
  for (std::size_t begin = 0; begin <= text.size();) {
    const std::size_t end = std::min(text.find_first_of("\r\n", begin), text.size());
    builder.annotate("comment", text.substr(begin, end - begin));
    begin = end + 1;
  }
}

// An outline drawn without thickness counts only where it is written as one.
std::size_t points_without_radius(const Morphology& m, const Keeps& keeps) {
  const auto flat = [](const Point& p) { return p.radius == 0.f; };
  const Soma soma = kept_soma(m.soma(), keeps);
  return std::size_t(std::ranges::count_if(m.points(), flat) + std::ranges::count_if(soma.points, flat));
}

// A row for each thing that can be lost.
struct Loss {
  bool Keeps::*kept;
  std::string_view code;
  std::size_t (*count)(const Morphology& m, const Keeps& keeps);  // how many of it the neuron has
  std::string_view sentence;                                      // {} is the number
};

std::size_t count_sections(const Morphology& m, bool (*has_it)(const Morphology&, SectionId)) {
  std::size_t count = 0;
  for (std::size_t i = 0; i < m.sections().size(); ++i) count += has_it(m, SectionId(i));
  return count;
}

constexpr Loss loss_table[] = {
    {&Keeps::kinds, "kinds-lost",
     [](const Morphology& m, const Keeps&) {
       return count_sections(
           m, [](const Morphology& n, SectionId s) { return n.section(s).kind != SectionKind::undefined; });
     },
     "the kinds of {} sections are left out"},
    {&Keeps::tags, "tags-lost",
     [](const Morphology& m, const Keeps&) {
       return count_sections(m, [](const Morphology& n, SectionId s) {
         return n.section(s).kind == SectionKind::custom && n.section(s).tag != int(SectionKind::custom);
       });
     },
     "the numbers of {} sections of a custom kind are left out"},
    {&Keeps::cylinders, "soma-simplified",
     [](const Morphology& m, const Keeps&) {
       return std::size_t(m.soma().kind == SomaKind::cylinders ? m.soma().points.size() : 0);
     },
     "the soma of {} points becomes a sphere of its mean size"},
    {&Keeps::contours, "soma-simplified",
     [](const Morphology& m, const Keeps&) {
       return std::size_t(m.soma().kind == SomaKind::contours ? m.soma().contour_starts.size() : 0);
     },
     "the outline of the soma ({} loops) becomes a sphere of its mean radius"},
    {&Keeps::loose_roots, "roots-joined",
     [](const Morphology& m, const Keeps&) {
       if (m.soma().kind == SomaKind::none) return m.roots().size() < 2 ? 0 : m.roots().size() - 1;
       return count_sections(m, [](const Morphology& n, SectionId s) {
         return !n.section(s).parent.valid() && n.section(s).soma_point < 0;
       });
     },
     "{} neurites that leave from no soma are joined to it"},
    {&Keeps::soma_points, "attachments-lost",
     [](const Morphology& m, const Keeps&) {
       return count_sections(m, [](const Morphology& n, SectionId s) {
         return !n.section(s).parent.valid() && n.section(s).soma_point >= 0;
       });
     },
     "that {} neurites leave from the soma is left out"},
    {&Keeps::joints, "joint-radii-lost",
     [](const Morphology& m, const Keeps&) {
       return count_sections(m, [](const Morphology& n, SectionId s) {
         const SectionId parent = n.section(s).parent;
         return parent.valid() && n.points(s).front().radius != n.points(parent).back().radius;
       });
     },
     "the radius at the branch point is the parent's for {} sections with one of their own"},
    {&Keeps::single_daughters, "sections-joined",
     [](const Morphology& m, const Keeps& keeps) {
       std::size_t count = 0;
       for (std::size_t i = 0; i < m.sections().size(); ++i) count += joins(m, SectionId(i), keeps);
       return count;
     },
     "{} sections that are their parent's only daughter, of its kind, are joined to it"},
    {&Keeps::stumps, "stumps-lost",
     [](const Morphology& m, const Keeps&) {
       return count_sections(m, [](const Morphology& n, SectionId s) { return n.points(s).size() == 1; });
     },
     "{} neurites of a single point are left out"},
    {&Keeps::still_points, "still-points-lost",
     [](const Morphology& m, const Keeps&) {
       std::size_t count = 0;
       for (std::size_t i = 0; i < m.sections().size(); ++i) {
         const auto points = m.points(SectionId(i));
         for (std::size_t k = 1; k < points.size(); ++k) count += same_place(points[k - 1], points[k]);
       }
       return count;
     },
     "{} points at the place of the one before are left out, and with them a step of the radius there"},
    {&Keeps::lengthless, "lengthless",
     [](const Morphology& m, const Keeps&) {
       return count_sections(
           m, [](const Morphology& n, SectionId s) { return section_length(n, s) < shortest; });
     },
     "{} sections without length are given one of about 1e-6 µm, since a simulator divides by it"},
    {&Keeps::zero_radii, "zero-radii",
     [](const Morphology& m, const Keeps& keeps) { return points_without_radius(m, keeps); },
     "{} points have no diameter; they are written so, but a simulator needs one to compute"},
    {&Keeps::spines, "spines-lost", [](const Morphology& m, const Keeps&) { return m.spines().size(); },
     "{} spines are left out"},
    {&Keeps::spine_sizes, "spine-sizes-lost",
     [](const Morphology& m, const Keeps& keeps) {
       return !keeps.spines ? 0 : std::size_t(std::ranges::count_if(m.spines(), [](const Spine& s) {
         return s != Spine{.section = s.section, .position = s.position};
       }));
     },
     "the heads and shapes of {} spines are left out, where they sit is kept"},
    {&Keeps::annotations, "annotations-lost",
     [](const Morphology& m, const Keeps&) { return m.annotations().size(); }, "{} annotations are left out"},
    {&Keeps::keys, "keys-lost",
     [](const Morphology& m, const Keeps& keeps) {
       return std::size_t(
           std::ranges::count_if(m.annotations(), [&](const auto& a) { return !keeps_key(a, keeps); }));
     },
     "{} annotations become comments, for the format has no place for their keys or for several lines"},
};

bool has_length(std::span<const Point> points) {
  double length = 0.;
  for (std::size_t k = 1; k < points.size(); ++k) length += segment_length(points[k - 1], points[k]);
  return length >= shortest;
}

std::vector<SectionId> depth_first(const Morphology& m) {
  std::vector<SectionId> order, waiting(m.roots().rbegin(), m.roots().rend());
  while (!waiting.empty()) {
    order.push_back(waiting.back());
    waiting.pop_back();
    const auto daughters = m.children(order.back());
    waiting.insert(waiting.end(), daughters.rbegin(), daughters.rend());
  }
  return order;
}

}  // namespace

Point next_place(Point point) {
  float* axis = &point.x;  // the one with the finest step
  for (float* other : {&point.y, &point.z})
    if (std::abs(*other) < std::abs(*axis)) axis = other;
  const double from = *axis;
  for (double step = 1e-6;; step *= 2.)  // towards zero, where steps are finer
    if (const float to = float(from > 0. ? from - step : from + step);
        std::abs(double(to) - from) >= shortest) {
      *axis = to;
      return point;
    }
}

std::vector<Warning> losses(const Morphology& m, const Keeps& keeps) {
  std::vector<Warning> warnings;
  for (const Loss& loss : loss_table)
    if (!(keeps.*loss.kept))
      if (const std::size_t count = loss.count(m, keeps))
        warnings.push_back({0, loss.code, fmt::format(fmt::runtime(loss.sentence), count)});
  if (keeps.least_diameter > 0.f) {
    if (const auto count = points_without_radius(m, keeps))
      warnings.push_back({0, "diameters-lifted",
                          fmt::format("{} diameters of 0 become {} µm", count, keeps.least_diameter)});
  }
  const auto foreign = [&](const Section& s) { return !keeps.foreign_tags && swc_type(s) != s.tag; };
  const auto too_large = [&](const Section& s) {
    return s.kind == SectionKind::custom && kept_tag(s, keeps) != s.tag && !foreign(s);
  };
  const auto lost = [&](std::ptrdiff_t count, const std::string& which) {
    if (count && keeps.kinds && keeps.tags)
      warnings.push_back(
          {0, "tags-lost", fmt::format("the numbers of {} sections {}, are left out", count, which)});
  };
  lost(std::ranges::count_if(m.sections(), too_large),
       fmt::format("of a custom kind, above {}", keeps.largest_tag));
  lost(std::ranges::count_if(m.sections(), foreign),
       "that mean another kind in SWC, as of glia and spines in HDF5");
  const auto moved = [&](const Point& p) { return keeps.step > 0.f && kept_point(p, keeps) != p; };
  if (const auto count =
          std::ranges::count_if(m.points(), moved) + std::ranges::count_if(m.soma().points, moved))
    warnings.push_back(
        {0, "rounded",
         fmt::format("places and diameters of {} points are rounded to {} µm", count, keeps.step)});
  return warnings;
}

void check_fits(const Morphology& m, const Keeps& keeps) {
  const auto check = [&](std::span<const Point> points, bool diameters) {
    for (const Point& p : points) {
      const float place = std::max({std::abs(p.x), std::abs(p.y), std::abs(p.z)});
      if (place > keeps.largest_place)
        throw LimitError(
            fmt::format("a coordinate of {} µm does not fit into the format, which holds up to {} µm; "
                        "move the neuron to the origin or choose another format",
                        place, keeps.largest_place));
      if (diameters && 2. * double(p.radius) > double(keeps.largest_diameter) &&
          keeps.largest_diameter < std::numeric_limits<float>::max())
        throw LimitError(
            fmt::format("a diameter of {} µm does not fit into the format, which holds up to {} µm; "
                        "choose another format",
                        2. * double(p.radius), keeps.largest_diameter));
    }
  };
  check(m.points(), true);
  const Soma soma = kept_soma(m.soma(), keeps);
  check(soma.points, soma.kind != SomaKind::sphere);
}

Morphology as_kept(const Morphology& m, const Keeps& keeps) {
  MorphologyBuilder builder;
  Soma soma = kept_soma(m.soma(), keeps);
  for (Point& p : soma.points) p = kept_point(p, keeps);
  const bool has_soma = soma.kind != SomaKind::none;
  builder.set_soma(std::move(soma));

  constexpr std::uint32_t gone = 0xffffffffu;
  struct Place {
    std::uint32_t section = gone;  // in the neuron that is left
    float offset = 0.f;            // where it begins in that section, µm
  };
  std::vector<Place> places(m.sections().size());
  std::vector<Point> points;
  std::vector<Vec3> ends;  // of the sections that are left
  const std::vector<SectionId> order = keeps.order ? std::vector<SectionId>() : depth_first(m);
  for (std::size_t i = 0; i < m.sections().size(); ++i) {
    const SectionId id = keeps.order ? SectionId(i) : order[i];
    if (!keeps.single_daughters && joins(m, id, keeps)) continue;  // taken along below
    const Section& s = m.section(id);
    if (!keeps.stumps && m.points(id).size() == 1) continue;
    points.clear();
    float length = 0.f;
    for (SectionId at = id;;) {
      places[at.value()] = {std::uint32_t(ends.size()), length};
      for (std::size_t k = at == id ? 0 : 1; k < m.points(at).size(); ++k) {
        points.push_back(kept_point(m.points(at)[k], keeps));
        if (points.size() > 1)
          length += (points.back().position() - points[points.size() - 2].position()).norm();
      }
      if (keeps.single_daughters || m.children(at).size() != 1 || !joins(m, m.children(at)[0], keeps)) break;
      at = m.children(at)[0];
    }
    SectionId parent;
    if (s.parent.valid() && places[s.parent.value()].section != gone) {
      parent = SectionId(places[s.parent.value()].section);
      if (!keeps.joints) points[0].radius = kept_point(m.points(s.parent).back(), keeps).radius;
      const Vec3 joint = ends[parent.value()];
      points[0] = {joint.x(), joint.y(), joint.z(), points[0].radius};
    }
    if (!keeps.still_points)
      points.erase(std::unique(points.begin(), points.end(), same_place), points.end());
    if (!keeps.lengthless && !has_length(points)) {
      if (points.size() == 1) points.push_back(points[0]);
      points.back() = next_place(points.back());
    }
    ends.push_back(points.back().position());
    const SectionKind kind = keeps.kinds ? s.kind : SectionKind::undefined;
    const std::int32_t tag = kept_tag(s, keeps);
    std::int32_t soma_point = parent.valid() ? -1 : s.soma_point;
    if (!keeps.loose_roots && !parent.valid() && has_soma) soma_point = std::max(soma_point, 0);
    if (!keeps.soma_points) soma_point = -1;
    builder.add_section(parent, kind, points, tag, soma_point);
  }
  if (keeps.spines)
    for (Spine spine : m.spines()) {
      const Place place = places[spine.section.value()];
      if (place.section == gone) continue;
      spine.section = SectionId(place.section);
      spine.position += place.offset;
      if (!keeps.spine_sizes) spine = {.section = spine.section, .position = spine.position};
      builder.add_spine(spine);
    }
  if (keeps.annotations)
    for (const auto& annotation : m.annotations()) annotate(builder, annotation, keeps);
  return builder.build();
}

}  // namespace forest::io
