// SPDX-License-Identifier: Apache-2.0
#include "forest/cortex/surfaces.h"

#include <algorithm>
#include <array>
#include <cmath>

#include <fmt/format.h>

#include "forest/core/error.h"
#include "forest/core/parallel.h"
#include "forest/core/progress.h"
#include "forest/cortex/hidden_sulci.h"
#include "forest/geometry/decimate.h"
#include "forest/geometry/isosurface.h"

namespace forest::cortex {
namespace {

std::uint32_t object_of(const ContourStack& stack, const std::string& name) {
  return std::uint32_t(std::ranges::find(stack.objects, name) - stack.objects.begin());
}

double distance_of_sections(const ContourStack& stack) {
  if (stack.sections.size() < 2) throw Error("a surface needs two sections or more; give more of them");
  std::vector<double> steps;
  for (std::size_t i = 0; i + 1 < stack.sections.size(); ++i)
    steps.push_back(stack.sections[i + 1].at - stack.sections[i].at);
  std::ranges::nth_element(steps, steps.begin() + std::ptrdiff_t(steps.size() / 2));
  const double usual = steps[steps.size() / 2];
  for (std::size_t i = 0; usual > 0. && i + 1 < stack.sections.size(); ++i) {
    const double times = (stack.sections[i + 1].at - stack.sections[i].at) / usual, whole = std::round(times);
    if (whole >= 2. && std::abs(times - whole) < .02)
      throw Error(fmt::format(
          "between section {} ({:.6g} mm) and the next ({:.6g} mm) {:.0f} {} missing: others are {:.6g} "
          "mm apart; bring in what is missing",
          i + 1, stack.sections[i].at / 1e3, stack.sections[i + 1].at / 1e3, whole - 1.,
          whole > 2. ? "are" : "is", usual / 1e3));
  }
  const double spacing =
      (stack.sections.back().at - stack.sections.front().at) / double(stack.sections.size() - 1);
  for (std::size_t i = 0; i < stack.sections.size(); ++i)
    if (std::abs(stack.sections[i].at - stack.sections[0].at - double(i) * spacing) > .01 * spacing)
      throw Error(
          fmt::format("section {} is at {:.6g} mm where {:.6g} mm is expected: sections must be at equal "
                      "distances; bring in "
                      "the missing ones",
                      i + 1, stack.sections[i].at / 1e3, (stack.sections[0].at + double(i) * spacing) / 1e3));
  return spacing;
}

// Sections have an object from the first one that has it to the last, or a surface would end there and begin anew.
void must_go_on(const ContourStack& stack, std::uint32_t object) {
  const auto has = [&](const Section& section) {
    return std::ranges::any_of(section.contours, [&](const Contour& c) { return c.object == object; });
  };
  const auto first = std::ranges::find_if(stack.sections, has);
  if (first == stack.sections.end())
    throw Error(fmt::format("no section has a contour of '{}'; trace some", stack.objects[object]));
  const auto last = std::ranges::find_if(stack.sections.rbegin(), stack.sections.rend(), has).base();
  const auto without = std::find_if_not(first, last, has);
  if (without != last)
    throw Error(fmt::format(
        "section {} ({:.6g} mm) has no contour of '{}', and sections before and behind it have; trace "
        "it there",
        without - stack.sections.begin() + 1, without->at / 1e3, stack.objects[object]));
}

// Where the grid stands: its first two axes are those of the sections, its third one goes across them.
struct Raster {
  Place origin;
  double step, spacing, first;
  std::size_t width, height, sections;  // with one empty section before and one behind
  int between;
};

Raster raster_of(const ContourStack& stack, const SurfaceOptions& options) {
  Raster raster{};
  raster.spacing = distance_of_sections(stack);
  raster.step = options.voxel > 0. ? options.voxel : raster.spacing / 4.;
  raster.between = options.between;
  Place low = Place::Constant(HUGE_VAL), high = -low;
  for (const Section& section : stack.sections)
    for (const Contour& contour : section.contours)
      for (const Place& point : contour.curve.points) low = low.cwiseMin(point), high = high.cwiseMax(point);
  if (!(low.x() <= high.x())) throw Error("the sections have no contours; trace some");
  const double border = 2.5 * raster.step;
  raster.origin = low - Place::Constant(border);
  const auto points = [&](double extent) {
    const double count = std::ceil((extent + 2. * border) / raster.step) + 1.;
    if (!(count <= 1e5))
      throw Error("contours spread over more than 100,000 voxels; give a larger voxel, or look at the unit");
    return std::size_t(count);
  };
  raster.width = points(high.x() - low.x()), raster.height = points(high.y() - low.y());
  raster.sections = stack.sections.size() + 2;
  raster.first = stack.sections.front().at - raster.spacing;
  const double total =
      double(raster.width) * double(raster.height) * double(raster.sections) * raster.between;
  if (total > 4e8)
    throw Error(
        fmt::format("the grid would have {:.1f} million points and may have 400; give a voxel of {:.3f} mm",
                    total / 1e6, raster.step * std::sqrt(total / 4e8) / 1e3));
  return raster;
}

// Where a surface passes between two sections, a distance cannot change by more than so many of their distances: what lies
// far outside in the next section says only that the surface ended somewhere before it. Of .5, .7, 1, 1.5, 2 and none this one
// came nearest to the white surface of one brain (docs/cortex/surfaces.md), from its 42 middle sections.
constexpr double most_change = 2.;

// The cubic through four values at -1, 0, 1, 2, whose slopes at 0 and 1 are those of its neighbours.
float between(float a, float b, float c, float d, float t, float most) {
  if ((b < 0.f) != (c < 0.f)) {
    const auto limited = [&](float far, float near) {
      const float left = std::max(most - std::abs(near), std::min(std::abs(near), .025f * most));
      return std::copysign(std::min(left, std::abs(far)), far);
    };
    if (std::abs(c - b) > most) (std::abs(c) > std::abs(b) ? c = limited(c, b) : b = limited(b, c));
    a = std::clamp(a, b - most, b + most), d = std::clamp(d, c - most, c + most);
  }
  return b + .5f * t * (c - a + t * (2.f * a - 5.f * b + 4.f * c - d + t * (3.f * (b - c) + d - a)));
}

ScalarGrid interpolated(const ContourStack& stack, std::uint32_t object, const Raster& raster,
                        Progress& progress) {
  const std::size_t layer = raster.width * raster.height;
  const double band = 4. * raster.spacing;
  std::vector<std::vector<float>> known(raster.sections);
  progress.begin(fmt::format("distances from {}", stack.objects[object]), raster.sections);
  parallel_for(raster.sections, 1, [&](std::size_t k) {
    const bool empty = k == 0 || k + 1 == raster.sections;
    static const Section nothing;
    known[k] = signed_distances(empty ? nothing : stack.sections[k - 1], object, raster.origin, raster.step,
                                raster.width, raster.height, band);
    progress.advance();
  });
  progress.end();
  ScalarGrid grid{
      .size = {raster.width, raster.height, (raster.sections - 1) * std::size_t(raster.between) + 1},
      .origin = {raster.origin.x(), raster.origin.y(), raster.first},
      .step = {raster.step, raster.step, raster.spacing / raster.between},
      .values = {}};
  grid.values.resize(grid.count());
  parallel_for(grid.size[2], 1, [&](std::size_t z) {
    const std::size_t k = z / std::size_t(raster.between);
    const float t = float(z % std::size_t(raster.between)) / float(raster.between);
    const auto at = [&](std::size_t i) { return known[std::min(i, raster.sections - 1)].data(); };
    const float *a = at(k == 0 ? 0 : k - 1), *b = at(k), *c = at(k + 1), *d = at(k + 2);
    float* out = &grid.values[z * layer];
    for (std::size_t i = 0; i < layer; ++i)
      out[i] = t == 0.f ? b[i] : between(a[i], b[i], c[i], d[i], t, float(most_change * raster.spacing));
  });
  return grid;
}

// Points within, of every section of a stack.
std::vector<std::size_t> within(const ScalarGrid& grid, const Raster& raster) {
  std::vector<std::size_t> counts(raster.sections - 2);
  const std::size_t layer = grid.size[0] * grid.size[1];
  for (std::size_t s = 0; s < counts.size(); ++s) {
    const auto first = grid.values.begin() + std::ptrdiff_t((s + 1) * std::size_t(raster.between) * layer);
    counts[s] =
        std::size_t(std::count_if(first, first + std::ptrdiff_t(layer), [](float v) { return v < 0.f; }));
  }
  return counts;
}

// In no section, either. The first and the last one of the inner boundary may touch both surfaces where they run side by side and
// cross, as averaged ones do by the medial wall: there most of it must be outside, and not a third.
void must_be_nested(const ScalarGrid& inner, const ScalarGrid& outer, const ContourStack& stack,
                    const Raster& raster, const SurfaceOptions& options) {
  constexpr double much = 1e6;  // µm²
  constexpr double share = 1. / 3., share_at_ends = .8;
  const std::size_t layer = inner.size[0] * inner.size[1];
  struct Counted {
    std::size_t section, nested, outside;
  };
  std::vector<Counted> all;
  for (std::size_t s = 0; s < stack.sections.size(); ++s) {
    const std::size_t first = (s + 1) * std::size_t(raster.between) * layer;
    Counted here{s, 0, 0};
    for (std::size_t i = first; i < first + layer; ++i)
      if (inner.values[i] < 0.f) ++(outer.values[i] < 0.f ? here.nested : here.outside);
    if (here.nested + here.outside) all.push_back(here);
  }
  for (const Counted& here : all) {
    const bool at_end = &here == &all.front() || &here == &all.back();
    const double outside = double(here.outside) / double(here.nested + here.outside);
    if (outside > (at_end ? share_at_ends : share) && double(here.outside) * raster.step * raster.step > much)
      throw Error(fmt::format(
          "section {} ({:.6g} mm): {:.0f} % of what lies within '{}' lies outside '{}'; exchange them there",
          here.section + 1, stack.sections[here.section].at / 1e3, 100. * outside, options.inner,
          options.outer));
  }
}

// How much of what lies within one lies outside of the other, and has it on all four sides in its section: in its holes, or in
// bays of it that are nearly closed.
std::size_t surrounded(const ScalarGrid& one, const ScalarGrid& other) {
  const auto [width, height, layers] = other.size;
  std::size_t count = 0;
  for (std::size_t z = 0; z < layers; ++z) {
    const std::size_t first = z * width * height;
    // Where it begins and ends in each column and, in turn, each row.
    std::vector<std::size_t> low(width, height), high(width, 0);
    for (std::size_t i = 0; i < width * height; ++i)
      if (other.values[first + i] < 0.f)
        low[i % width] = std::min(low[i % width], i / width), high[i % width] = i / width;
    for (std::size_t y = 0; y < height; ++y) {
      const float* row = &other.values[first + y * width];
      std::size_t left = 0, right = width;
      while (left < width && row[left] >= 0.f) ++left;
      while (right > left && row[right - 1] >= 0.f) --right;
      for (std::size_t x = left; x < right; ++x)
        count += one.values[first + y * width + x] < 0.f && row[x] >= 0.f && low[x] < y && y < high[x];
    }
  }
  return count;
}

Unjoined unjoined(std::vector<std::size_t> before, const std::vector<std::size_t>& after,
                  const Raster& raster) {
  std::vector<std::size_t> lost(before.size());
  std::ranges::transform(before, after, lost.begin(), std::minus<>());
  const auto most = std::ranges::max_element(lost);
  const double voxel = raster.step * raster.step;
  std::erase(before, 0u);
  if (before.empty()) return {};
  const auto middle = before.begin() + std::ptrdiff_t(before.size() / 2);
  std::ranges::nth_element(before, middle);
  return {std::size_t(most - lost.begin()), double(*most) * voxel, double(*most) / double(*middle)};
}

// The grid's axes are those of a section and the one across them; the mesh's are x, y, z.
void stand_up(Mesh& mesh, Axis axis) {
  for (Vec3& p : mesh.positions) p = solid({p.x(), p.y()}, p.z(), axis).cast<float>();
  if (axis == Axis::y)  // a mirror image, then
    for (Triangle& t : mesh.triangles) std::swap(t[1], t[2]);
}

// Those triangles of a mesh whose corners have the label.
Mesh labelled(const Mesh& mesh, std::uint8_t label) {
  Mesh part;
  std::vector<std::uint32_t> name(mesh.positions.size());
  for (std::size_t v = 0; v < name.size(); ++v)
    if (mesh.labels[v] == label) {
      name[v] = std::uint32_t(part.positions.size());
      part.positions.push_back(mesh.positions[v]);
    }
  for (const Triangle& t : mesh.triangles)
    if (mesh.labels[t[0]] == label) part.triangles.push_back({name[t[0]], name[t[1]], name[t[2]]});
  part.labels.assign(part.positions.size(), 0);
  return part;
}

// Both at once, so that they keep out of one another.
void make_fewer(Surfaces& surfaces, double error, double longest, Progress& progress) {
  Mesh both = std::move(surfaces.outer);
  std::ranges::fill(surfaces.inner.labels, std::uint8_t(1));
  append(both, surfaces.inner);
  surfaces.inner = {};
  both = decimated(both, {.error = error, .longest = longest}, progress);
  surfaces.outer = labelled(both, 0), surfaces.inner = labelled(both, 1);
}

}  // namespace

std::vector<float> signed_distances(const Section& section, std::uint32_t object, const Place& origin,
                                    double step, std::size_t width, std::size_t height, double band) {
  std::vector<float> squared(width * height, float(band * band));
  std::vector<std::vector<double>> crossings(height);  // of the rows
  for (const Contour& contour : section.contours) {
    if (contour.object != object) continue;
    const auto polygon = flattened(contour.curve, std::min(2., step / 50.));
    for (std::size_t i = 0; i < polygon.size(); ++i) {
      const Place a = (polygon[i] - origin) / step, b = (polygon[(i + 1) % polygon.size()] - origin) / step;
      const Place along = b - a, low = a.cwiseMin(b), high = a.cwiseMax(b);
      const double reach = band / step, scale = along.squaredNorm() > 0. ? 1. / along.squaredNorm() : 0.;
      const auto from = [&](double x) { return std::size_t(std::max(0., std::ceil(x))); };
      const auto to = [&](double x, std::size_t end) {
        return std::size_t(std::clamp(std::floor(x) + 1., 0., double(end)));
      };
      for (std::size_t y = from(low.y() - reach); y < to(high.y() + reach, height); ++y)
        for (std::size_t x = from(low.x() - reach); x < to(high.x() + reach, width); ++x) {
          const Place off = Place(double(x), double(y)) - a;
          const double share = std::clamp(off.dot(along) * scale, 0., 1.);
          float& value = squared[y * width + x];
          value = std::min(value, float((off - share * along).squaredNorm() * step * step));
        }
      for (std::size_t y = from(low.y()); y < height && double(y) < high.y(); ++y)
        crossings[y].push_back(a.x() + (double(y) - a.y()) / along.y() * along.x());
    }
  }
  for (float& value : squared) value = std::sqrt(value);
  for (std::size_t y = 0; y < height; ++y) {
    std::ranges::sort(crossings[y]);
    for (std::size_t k = 0; k + 1 < crossings[y].size(); k += 2)
      for (auto x = std::size_t(std::max(0., std::ceil(crossings[y][k])));
           x < width && double(x) < crossings[y][k + 1]; ++x)
        squared[y * width + x] = -squared[y * width + x];
  }
  return squared;
}

Surfaces surfaces_from(const ContourStack& given, const SurfaceOptions& options, Progress& progress) {
  const ContourStack stack = only(given, std::array{options.outer, options.inner});
  const std::uint32_t outer_object = object_of(stack, options.outer),
                      inner_object = object_of(stack, options.inner);
  if (const std::string fault = fault_of_numbers(stack); !fault.empty()) throw Error(fault);
  const Raster raster = raster_of(stack, options);
  if (const std::string fault = too_small_for_a_brain(stack); !fault.empty()) throw Error(fault);
  if (const std::string fault = fault_of(stack); !fault.empty()) throw Error(fault);
  for (const std::uint32_t object : {outer_object, inner_object}) must_go_on(stack, object);
  ScalarGrid inner = interpolated(stack, inner_object, raster, progress);
  ScalarGrid outer = interpolated(stack, outer_object, raster, progress);
  Surfaces result;
  const auto margin = float(options.margin), least = float(raster.step / 10.);
  // Swapped objects, or sections of different brains: most of the inner one outside is no matter of accuracy.
  std::size_t nested = 0, outside = 0;
  for (std::size_t i = 0; i < inner.count(); ++i)
    if (inner.values[i] < 0.f) ++(outer.values[i] < 0.f ? nested : outside);
  constexpr double nearly_all = .8;
  if (const double holes = double(surrounded(inner, outer)) / double(nested + outside); holes > nearly_all)
    throw Error(
        fmt::format("{:.0f} % of what lies within '{}' lies in holes of '{}'; the outer boundary must hold "
                    "grey and white matter together",
                    100. * holes, options.inner, options.outer));
  if (outside > nested / 4)
    throw Error(fmt::format(
        "{:.0f} % of what lies within '{}' lies outside '{}'; swap them or give contours of one brain",
        100. * double(outside) / double(nested + outside), options.inner, options.outer));
  must_be_nested(inner, outer, stack, raster, options);
  progress.begin("one ball, inner", 0);
  std::vector<std::uint8_t> ball;
  std::vector<std::size_t> drawn = within(inner, raster);
  result.inner_cut = grow_ball(inner, ball, least).cut;
  result.inner_unjoined = unjoined(std::move(drawn), within(inner, raster), raster);
  progress.end();
  for (std::size_t i = 0; i < inner.count(); ++i)
    if (ball[i] && outer.values[i] > inner.values[i] - margin) {
      result.pushed += outer.values[i] >= 0.f;
      outer.values[i] = inner.values[i] - margin;
    }
  progress.begin("sulci between sections", 0);
  result.opened = open_hidden_sulci(outer, inner, std::size_t(options.between), float(raster.step / 4.));
  progress.end();
  progress.begin("one ball, outer", 0);
  drawn = within(outer, raster);
  result.outer_cut = grow_ball(outer, ball, least).cut;
  result.outer_unjoined = unjoined(std::move(drawn), within(outer, raster), raster);
  progress.end();
  // Within every tetrahedron both are linear: where one is smaller at all points, its surface lies outside.
  for (std::size_t i = 0; i < inner.count(); ++i) {
    const float most = inner.values[i] > 2.f * margin ? inner.values[i] - margin : inner.values[i] / 2.f;
    if (outer.values[i] < 0.f)
      outer.values[i] = std::min(outer.values[i], inner.values[i] - margin);
    else
      outer.values[i] = std::min(outer.values[i], most);
  }
  progress.begin("surfaces", 2);
  result.inner = isosurface(inner);
  inner = {};
  progress.advance();
  result.outer = isosurface(outer);
  outer = {};
  progress.end();
  result.triangles = result.inner.triangles.size() + result.outer.triangles.size();
  if (options.error > 0.) make_fewer(result, options.error, 1.5 * raster.spacing, progress);
  stand_up(result.inner, stack.axis), stand_up(result.outer, stack.axis);
  return result;
}

}  // namespace forest::cortex
