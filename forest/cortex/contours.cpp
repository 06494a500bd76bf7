// SPDX-License-Identifier: Apache-2.0
#include "forest/cortex/contours.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <optional>
#include <tuple>
#include <unordered_map>
#include <utility>

#include <fmt/format.h>

#include "forest/core/error.h"
#include "forest/core/parallel.h"
#include "forest/core/progress.h"

namespace forest::cortex {
namespace {

std::string said(const Eigen::Vector3d& point) {
  return fmt::format("({:.3f}, {:.3f}, {:.3f}) mm", point.x() / 1e3, point.y() / 1e3, point.z() / 1e3);
}

using Edge = std::uint64_t;
Edge edge_of(std::uint32_t a, std::uint32_t b) {
  return std::uint64_t(std::min(a, b)) << 32 | std::max(a, b);
}

// What one plane cuts, of the triangles that it may cut.
std::vector<Contour> cut_one(const Mesh& surface, Axis axis, double at,
                             std::span<const std::uint32_t> triangles) {
  const auto height = [&](std::uint32_t vertex) { return double(surface.positions[vertex][int(axis)]) - at; };
  // Seen so that the plane's axes are right-handed or, across y, left-handed.
  const bool mirrored = axis == Axis::y;
  struct Step {
    Edge from, to;
  };
  std::vector<Step> steps;
  for (const std::uint32_t t : triangles) {
    const Triangle& corner = surface.triangles[t];
    // Walking around the triangle one leaves what is above by one edge and comes back by another.
    Edge down = 0, up = 0;
    int crossings = 0;
    for (std::size_t k = 0; k < 3; ++k) {
      const std::uint32_t a = corner[k], b = corner[(k + 1) % 3];
      const bool a_above = height(a) >= 0., b_above = height(b) >= 0.;
      if (a_above == b_above) continue;
      (a_above ? down : up) = edge_of(a, b);
      ++crossings;
    }
    if (crossings != 2) continue;
    steps.push_back(mirrored ? Step{up, down} : Step{down, up});
  }
  std::unordered_map<Edge, std::size_t> next;  // the step that begins at an edge
  next.reserve(steps.size());
  const auto place_of = [&](Edge edge) {
    const auto a = std::uint32_t(edge >> 32), b = std::uint32_t(edge);
    const Eigen::Vector3d p = surface.positions[a].cast<double>(), q = surface.positions[b].cast<double>();
    const double share = height(a) / (height(a) - height(b));
    return Eigen::Vector3d(p + share * (q - p));
  };
  for (std::size_t i = 0; i < steps.size(); ++i)
    if (!next.emplace(steps[i].from, i).second)
      throw Error(
          fmt::format("the surface is no surface at {}: an edge has more than two triangles or they "
                      "face opposite ways; repair it",
                      said(place_of(steps[i].from))));
  std::vector<Contour> contours;
  std::vector<bool> walked(steps.size(), false);
  for (std::size_t first = 0; first < steps.size(); ++first) {
    if (walked[first]) continue;
    std::vector<Place> polygon;
    for (std::size_t i = first; !walked[i];) {
      walked[i] = true;
      const Place place = flat(place_of(steps[i].from), axis);
      if (polygon.empty() || place != polygon.back()) polygon.push_back(place);
      const auto found = next.find(steps[i].to);
      if (found == next.end())
        throw Error(fmt::format("the surface is open at {}: give a closed one", said(place_of(steps[i].to))));
      i = found->second;
    }
    while (polygon.size() > 1 && polygon.back() == polygon.front()) polygon.pop_back();
    if (polygon.size() >= 3) contours.push_back({.object = 0, .curve = straight_loop(polygon)});
  }
  return contours;
}

// Which contours of a section an object has, of those that have some.
std::map<std::uint32_t, std::vector<std::size_t>> of_objects(const Section& section) {
  std::map<std::uint32_t, std::vector<std::size_t>> found;
  for (std::size_t i = 0; i < section.contours.size(); ++i) found[section.contours[i].object].push_back(i);
  return found;
}

constexpr double fine = .2;  // µm: so near are polygons to curves where it is asked what crosses

// Where two edges of a section's polygons cross that share no end.
struct Crossing {
  Place place;
  std::size_t first, second;  // contours
};
// Shows each, from left to right about, until `see` returns false.
template <class See>
void each_crossing(std::span<const std::vector<Place>> polygons, See see) {
  struct Side {
    Place a, b;
    std::size_t polygon, index;
  };
  std::vector<Side> sides;
  for (std::size_t p = 0; p < polygons.size(); ++p)
    for (std::size_t i = 0; i < polygons[p].size(); ++i)
      sides.push_back({polygons[p][i], polygons[p][(i + 1) % polygons[p].size()], p, i});
  // A sweep from left to right: those that end before the next one begins are done with.
  const auto left = [](const Side& side) { return std::min(side.a.x(), side.b.x()); };
  std::ranges::sort(sides, {}, [&](const Side& s) { return std::tuple(left(s), s.polygon, s.index); });
  std::vector<std::size_t> open;
  const auto cross = [](const Place& u, const Place& v) { return u.x() * v.y() - u.y() * v.x(); };
  for (std::size_t k = 0; k < sides.size(); ++k) {
    const Side& one = sides[k];
    const double begin = left(one);
    std::erase_if(open, [&](std::size_t o) { return std::max(sides[o].a.x(), sides[o].b.x()) < begin; });
    for (const std::size_t o : open) {
      const Side& other = sides[o];
      if (std::min(one.a.y(), one.b.y()) > std::max(other.a.y(), other.b.y()) ||
          std::max(one.a.y(), one.b.y()) < std::min(other.a.y(), other.b.y()))
        continue;
      const Place u = one.b - one.a, v = other.b - other.a;
      const double a = cross(u, other.a - one.a), b = cross(u, other.b - one.a);
      const double c = cross(v, one.a - other.a), d = cross(v, one.b - other.a);
      if (a * b < 0. && c * d < 0. &&
          !see(Crossing{one.a + c / (c - d) * u, std::min(one.polygon, other.polygon),
                        std::max(one.polygon, other.polygon)}))
        return;
    }
    open.push_back(k);
  }
}
std::vector<Crossing> crossings_in(std::span<const std::vector<Place>> polygons) {
  std::vector<Crossing> found;
  each_crossing(polygons, [&](const Crossing& crossing) {
    found.push_back(crossing);
    return true;
  });
  return found;
}
std::optional<Crossing> crossing_in(std::span<const std::vector<Place>> polygons) {
  std::optional<Crossing> found;
  each_crossing(polygons, [&](const Crossing& crossing) {
    found = crossing;
    return false;
  });
  return found;
}

}  // namespace

namespace {

// The middle of a polygon that is there twice, whichever way round and wherever it begins.
std::optional<Place> twin_in(const std::vector<std::vector<Place>>& polygons) {
  constexpr double same = 1e-3;  // of their size
  struct Shape {
    double area;
    Place middle;
    double along;  // askew, since those of pixels lie in rows and columns
  };
  std::vector<Shape> shapes;
  for (const auto& polygon : polygons) {
    double twice = 0.;
    Place middle = Place::Zero();
    for (std::size_t i = 0; i < polygon.size(); ++i) {
      const Place a = polygon[i] - polygon[0], b = polygon[(i + 1) % polygon.size()] - polygon[0];
      const double part = a.x() * b.y() - a.y() * b.x();
      twice += part, middle += part / 3. * (a + b);
    }
    if (twice == 0.) continue;
    const Place at = polygon[0] + middle / twice;
    shapes.push_back({std::abs(twice) / 2., at, at.dot(Place(std::cos(1.), std::sin(1.)))});
  }
  std::ranges::stable_sort(shapes, {}, &Shape::along);
  for (auto one = shapes.begin(); one != shapes.end(); ++one)
    for (auto next = one + 1; next != shapes.end() && next->along - one->along < same * std::sqrt(one->area);
         ++next)
      if (std::abs(one->area - next->area) < same * one->area &&
          (one->middle - next->middle).norm() < same * std::sqrt(one->area))
        return one->middle;
  return std::nullopt;
}

}  // namespace

double extent(const ContourStack& stack) {
  if (stack.sections.empty()) return 0.;
  Eigen::AlignedBox2d all;
  for (const Section& section : stack.sections)
    for (const Contour& contour : section.contours)
      for (const Place& point : contour.curve.points) all.extend(point);
  const double along = stack.sections.back().at - stack.sections.front().at;
  return all.isEmpty() ? along : std::max(along, all.sizes().maxCoeff());
}

std::string too_small_for_a_brain(const ContourStack& stack) {
  const double reach = extent(stack);
  if (reach == 0. || reach >= smallest_brain) return {};
  return fmt::format(
      "the contours reach over {0:.3g} µm, as no brain does; look at their unit: in mm it would be {0:.3g} "
      "mm",
      reach);
}

std::string fault_of_numbers(const ContourStack& stack) {
  for (std::size_t i = 0; i < stack.sections.size(); ++i) {
    const Section& section = stack.sections[i];
    if (!std::isfinite(section.at)) return fmt::format("section {} is at no number; say where it is", i + 1);
    if (i && section.at <= stack.sections[i - 1].at)
      return fmt::format(
          "sections {} and {} are both at {:.6g} mm or in the wrong order; sort them by their place", i,
          i + 1, section.at / 1e3);
    for (const Contour& contour : section.contours) {
      const std::string& object = stack.objects.at(contour.object);
      if (contour.curve.pieces() < 1 || contour.curve.points.size() % 3 != 0)
        return fmt::format("a contour of '{}' in section {} ({:.6g} mm) has no points; leave it out", object,
                           i + 1, section.at / 1e3);
      for (const Place& point : contour.curve.points)
        if (!point.allFinite())
          return fmt::format(
              "a contour of '{}' in section {} ({:.6g} mm) has a coordinate that is no number; trace "
              "it again",
              object, i + 1, section.at / 1e3);
    }
  }
  if (const double reach = extent(stack); reach > largest_brain)
    return fmt::format("the contours spread over {:.3g} m, as no brain does; look at their unit",
                       reach / 1e6);
  return {};
}

std::string fault_of(const ContourStack& stack) {
  if (const std::string fault = fault_of_numbers(stack); !fault.empty()) return fault;
  std::vector<std::string> faults(stack.sections.size());
  parallel_for(stack.sections.size(), 1, [&](std::size_t i) {
    const Section& section = stack.sections[i];
    for (const auto& [object, who] : of_objects(section)) {
      if (!faults[i].empty()) break;
      std::vector<std::vector<Place>> polygons;
      for (const std::size_t c : who) polygons.push_back(flattened(section.contours[c].curve, fine));
      if (const auto twin = twin_in(polygons))
        faults[i] = fmt::format(
            "'{}' has one contour twice in section {} ({:.6g} mm), by ({:.6g}, {:.6g}) mm; leave "
            "one of them out",
            stack.objects[object], i + 1, section.at / 1e3, twin->x() / 1e3, twin->y() / 1e3);
      else if (const auto found = crossing_in(polygons))
        faults[i] = fmt::format(
            "{} of '{}' cross{} in section {} ({:.6g} mm) at ({:.6g}, {:.6g}) mm; draw them apart",
            found->first == found->second ? "one contour" : "two contours", stack.objects[object],
            found->first == found->second ? "es itself" : "", i + 1, section.at / 1e3, found->place.x() / 1e3,
            found->place.y() / 1e3);
    }
  });
  for (const std::string& fault : faults)
    if (!fault.empty()) return fault;
  return {};
}

std::vector<Crossings> crossings(const ContourStack& stack) {
  using Two = std::pair<std::uint32_t, std::uint32_t>;
  std::vector<std::map<Two, Crossings>> of_section(stack.sections.size());
  parallel_for(stack.sections.size(), 1, [&](std::size_t i) {
    const Section& section = stack.sections[i];
    std::vector<std::vector<Place>> polygons;
    for (const Contour& contour : section.contours) polygons.push_back(flattened(contour.curve, fine));
    each_crossing(polygons, [&](const Crossing& crossing) {
      const Two two =
          std::minmax(section.contours[crossing.first].object, section.contours[crossing.second].object);
      Crossings& here = of_section[i].try_emplace(two, two.first, two.second, 0u, 1u, i).first->second;
      if (here.places++ == 0 || crossing.place.x() < here.place.x()) here.place = crossing.place;
      return true;
    });
  });
  std::map<Two, Crossings> all;
  for (const auto& some : of_section)
    for (const auto& [two, here] : some)
      if (const auto [there, first] = all.emplace(two, here); !first)
        there->second.places += here.places, ++there->second.sections;
  std::vector<Crossings> result;
  for (const auto& [two, one] : all) result.push_back(one);
  return result;
}

ContourStack only(const ContourStack& stack, std::span<const std::string> objects) {
  ContourStack result{.axis = stack.axis, .objects = {}, .sections = {}};
  for (const std::string& object : objects)
    if (std::ranges::find(stack.objects, object) == stack.objects.end())
      throw Error(fmt::format("the contours have no object '{}'; name one of {}", object,
                              fmt::join(stack.objects, ", ")));
  constexpr auto none = ~std::uint32_t(0);
  std::vector<std::uint32_t> now;  // its number, of each object
  for (const std::string& object : stack.objects) {
    const bool wanted = std::ranges::find(objects, object) != objects.end();
    now.push_back(wanted ? std::uint32_t(result.objects.size()) : none);
    if (wanted) result.objects.push_back(object);
  }
  for (const Section& section : stack.sections) {
    Section& kept = result.sections.emplace_back(Section{section.at, {}});
    for (const Contour& contour : section.contours)
      if (now.at(contour.object) != none) kept.contours.push_back({now[contour.object], contour.curve});
  }
  return result;
}

Place flat(const Eigen::Vector3d& point, Axis axis) {
  const auto& axes = flat_axes(axis);
  return {point[axes[0]], point[axes[1]]};
}

Eigen::Vector3d solid(const Place& place, double at, Axis axis) {
  Eigen::Vector3d point;
  const auto& axes = flat_axes(axis);
  point[int(axis)] = at, point[axes[0]] = place.x(), point[axes[1]] = place.y();
  return point;
}

std::vector<double> planes_between(double low, double high, double spacing, double offset) {
  std::vector<double> planes;
  for (double k = std::ceil((low - offset) / spacing); k * spacing + offset <= high; k += 1.)
    planes.push_back(k * spacing + offset);
  return planes;
}

ContourStack cut(const Mesh& surface, const std::string& object, Axis axis, std::span<const double> planes) {
  for (std::size_t i = 0; i < surface.positions.size(); ++i)
    if (!surface.positions[i].allFinite())
      throw Error(fmt::format("vertex {} of the surface '{}' has a coordinate that is no number; repair it",
                              i, object));
  std::vector<std::vector<std::uint32_t>> touched(planes.size());
  for (std::uint32_t t = 0; t < surface.triangles.size(); ++t) {
    float low = HUGE_VALF, high = -HUGE_VALF;
    for (const std::uint32_t corner : surface.triangles[t]) {
      low = std::min(low, surface.positions[corner][int(axis)]);
      high = std::max(high, surface.positions[corner][int(axis)]);
    }
    // A plane cuts it when low < plane <= high.
    auto first = std::ranges::upper_bound(planes, double(low));
    for (; first != planes.end() && *first <= double(high); ++first)
      touched[std::size_t(first - planes.begin())].push_back(t);
  }
  ContourStack stack{.axis = axis, .objects = {object}, .sections = std::vector<Section>(planes.size())};
  parallel_for(planes.size(), 1, [&](std::size_t i) {
    stack.sections[i] = {.at = planes[i], .contours = cut_one(surface, axis, planes[i], touched[i])};
  });
  return stack;
}

ContourStack together(std::span<const ContourStack> stacks) {
  ContourStack all = stacks.front();
  for (const ContourStack& stack : stacks.subspan(1)) {
    if (stack.axis != all.axis || stack.sections.size() != all.sections.size())
      throw Error("the stacks are cut along different axes or have different sections; cut them alike");
    for (const std::string& object : stack.objects)
      if (std::ranges::find(all.objects, object) != all.objects.end())
        throw Error(fmt::format("two boundaries are to be called '{}'; give each a name of its own", object));
    const auto before = std::uint32_t(all.objects.size());
    all.objects.insert(all.objects.end(), stack.objects.begin(), stack.objects.end());
    for (std::size_t i = 0; i < all.sections.size(); ++i) {
      if (stack.sections[i].at != all.sections[i].at)
        throw Error(fmt::format("section {} is at {} mm in one stack and at {} mm in another; cut them alike",
                                i + 1, all.sections[i].at / 1e3, stack.sections[i].at / 1e3));
      for (Contour contour : stack.sections[i].contours) {
        contour.object += before;
        all.sections[i].contours.push_back(std::move(contour));
      }
    }
  }
  return all;
}

namespace {

// What lies by crossings counts four times, or four times as much as it did; once a round for each place.
// @return  how many times it counts now, the most by the crossings of each contour; 0 for one that crosses none
std::vector<double> emphasised(std::span<const Crossing> crossings, double within,
                               std::vector<Emphasis>& closer, std::size_t contours) {
  std::vector<double> most(contours, 0.);
  std::vector<bool> raised(closer.size());
  for (const Crossing& crossing : crossings) {
    const auto near = std::ranges::find_if(
        closer, [&](const Emphasis& one) { return (one.at - crossing.place).norm() < .5 * one.within; });
    const auto which = std::size_t(near - closer.begin());
    if (near == closer.end())
      closer.push_back({crossing.place, within, 4.});
    else if (which < raised.size() && !raised[which])
      raised[which] = true, near->times *= 4.;
    for (const std::size_t i : {crossing.first, crossing.second})
      most[i] = std::max(most[i], closer[which].times);
  }
  return most;
}

}  // namespace

ContourStack fitted(const ContourStack& stack, const FitOptions& options, FitSummary& summary,
                    Progress& progress) {
  ContourStack result = stack;
  std::vector<Contour*> all;
  for (Section& section : result.sections)
    for (Contour& contour : section.contours) all.push_back(&contour);
  std::vector<FitSummary> each(all.size());
  std::vector<BezierLoop> given;
  for (const Contour* contour : all) given.push_back(contour->curve);
  const auto keep = [&](std::size_t i) {
    all[i]->curve = given[i];
    const std::size_t corners = given[i].polygon() ? given[i].pieces() : 0;
    each[i] = {1, given[i].pieces(), corners, length(given[i]), 0., 0.};
  };
  const auto fit = [&](std::size_t i, std::span<const Emphasis> closer) {
    FitOptions so = options;
    so.closer = closer;
    const Fit found = fit_loop(flattened(given[i], options.tolerance / 4.), so);
    all[i]->curve = found.curve;
    const double along = length(given[i]);
    each[i] = {1, found.curve.pieces(), found.corners, along, found.rms * found.rms * along, found.greatest};
  };
  progress.begin("fitting curves", all.size());
  parallel_for(all.size(), 1, [&](std::size_t i) {
    given[i].polygon() ? fit(i, {}) : keep(i);
    progress.advance();
  });
  progress.end();
  // Where curves cross whose polygons do not, by a narrow sulcus or a thin tip, they must lie nearer around that place, from
  // round to round.
  std::vector<std::size_t> first_of{0};
  for (const Section& section : result.sections)
    first_of.push_back(first_of.back() + section.contours.size());
  const double within = 25. * options.tolerance;
  progress.begin("parting curves", result.sections.size());
  parallel_for(result.sections.size(), 1, [&](std::size_t k) {
    const Section& section = result.sections[k];
    for (auto& [object, who] : of_objects(section)) {
      for (std::size_t& i : who) i += first_of[k];
      std::vector<Emphasis> closer;
      std::vector<bool> kept(who.size());
      for (std::size_t i = 0; i < who.size(); ++i) kept[i] = !given[who[i]].polygon();
      for (;;) {
        std::vector<std::vector<Place>> polygons;
        for (const std::size_t i : who) polygons.push_back(flattened(all[i]->curve, fine));
        const auto needed = emphasised(crossings_in(polygons), within, closer, who.size());
        bool changed = false;
        for (std::size_t i = 0; i < who.size(); ++i) {
          if (kept[i] || needed[i] == 0.) continue;
          changed = true;
          kept[i] = needed[i] > 1e4;
          kept[i] ? keep(who[i]) : fit(who[i], closer);
        }
        if (!changed) break;
      }
    }
    progress.advance();
  });
  progress.end();
  summary = {};
  for (const FitSummary& one : each) {
    summary.contours += one.contours, summary.pieces += one.pieces, summary.corners += one.corners;
    summary.length += one.length, summary.rms += one.rms;
    summary.greatest = std::max(summary.greatest, one.greatest);
  }
  summary.rms = summary.length > 0. ? std::sqrt(summary.rms / summary.length) : 0.;
  return result;
}

}  // namespace forest::cortex
