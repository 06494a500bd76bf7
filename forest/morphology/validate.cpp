// SPDX-License-Identifier: Apache-2.0
#include "forest/morphology/validate.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include <fmt/format.h>

#include "forest/morphology/measure.h"

namespace forest {
namespace {

constexpr double jump_factor = 50.;     // of the median segment length
constexpr double stem_gap_factor = 3.;  // of the soma's radius
constexpr std::size_t end_points = 5;   // of a tip; as NeuroM takes them
constexpr double fat_end_factor = 2.;   // of their mean radius
constexpr double narrow_factor = .5;    // of the second point's radius

double median_segment_length(const Morphology& m) {
  std::vector<double> lengths;
  for (std::size_t i = 0; i < m.sections().size(); ++i) {
    const auto points = m.points(SectionId(i));
    for (std::size_t k = 1; k < points.size(); ++k)
      lengths.push_back(segment_length(points[k - 1], points[k]));
  }
  if (lengths.empty()) return 0.;
  const auto middle = lengths.begin() + std::ptrdiff_t(lengths.size() / 2);
  std::nth_element(lengths.begin(), middle, lengths.end());
  return *middle;
}

/// Whether a tip ends in a ball: a last radius of more than twice the mean of the last five.
bool ends_fat(std::span<const Point> points) {
  const auto last = points.last(std::min(points.size(), end_points));
  double sum = 0.;
  for (const Point& p : last) sum += double(p.radius);
  return double(last.back().radius) > fat_end_factor * sum / double(last.size());
}

// Where neighbouring 32-bit numbers are more than a nanometre apart.
bool is_far(const Point& p) {
  const float most = std::max({std::abs(p.x), std::abs(p.y), std::abs(p.z)});
  return std::nextafter(most, std::numeric_limits<float>::infinity()) - most > 1e-3f;
}

}  // namespace

std::vector<Finding> validate(const Morphology& m) {
  std::vector<Finding> findings;
  const auto add = [&](Severity severity, std::string_view code, SectionId section, std::int64_t point,
                       std::string sentence) {
    findings.push_back({severity, code, section, point, std::move(sentence)});
  };
  if (m.soma().kind == SomaKind::none)
    add(Severity::note, "no-soma", {}, -1, "there is no soma; sizes that need one are not computed");
  if (m.sections().empty())
    add(Severity::warning, "no-section", {}, -1, "there is no neurite; check that the right file was read");

  const double median = median_segment_length(m);
  const Point soma = m.soma().sphere();
  for (std::size_t i = 0; i < m.sections().size(); ++i) {
    const SectionId id(i);
    const Section& section = m.section(id);
    const auto points = m.points(id);
    if (points.size() == 1)
      add(Severity::note, "single-point-stem", id, 0, "the stem has one point and no length");
    for (std::size_t k = 0; k < points.size(); ++k) {
      const std::int64_t at = std::int64_t(k);
      if (points[k].radius == 0.f)
        add(Severity::warning, "zero-radius", id, at, "the radius is 0; give the measured one");
      if (k == 0) continue;
      const double length = segment_length(points[k - 1], points[k]);
      if (length == 0.)
        add(Severity::note, "zero-length", id, at,
            is_far(points[k]) ? "two points lie at one place, or are nearer than 32-bit numbers tell apart "
                                "there; move the neuron to the origin"
                              : "two points lie at one place; drop one");
      if (median > 0. && length > jump_factor * median)
        add(Severity::warning, "jump", id, at,
            fmt::format("a segment of {:.1f} µm among segments of {:.1f} µm; look for a missing part", length,
                        median));
    }
    const std::size_t daughters = m.children(id).size();
    if (daughters == 1)
      add(Severity::note, "unifurcation", id, -1,
          "the section has a single daughter; join them unless their kinds differ");
    if (daughters > 2)
      add(Severity::note, "multifurcation", id, -1, fmt::format("the section has {} daughters", daughters));
    if (section.parent.valid() && m.section(section.parent).kind != section.kind)
      add(Severity::note, "kind-change", id, -1,
          fmt::format("{} grows out of {}", name_of(section.kind), name_of(m.section(section.parent).kind)));
    if (daughters == 0 && ends_fat(points))
      add(Severity::note, "fat-end", id, std::int64_t(points.size()) - 1,
          "the tip is more than twice as thick as what leads to it; look whether it is a growth cone or a "
          "slip");
    if (!section.parent.valid() && points.size() > 1 &&
        double(points[0].radius) <= narrow_factor * double(points[1].radius) && points[1].radius > 0.f)
      add(Severity::note, "narrow-start", id, 0,
          "the stem begins at most half as thick as it goes on; measure where it leaves the soma");
    if (!section.parent.valid() && soma.radius > 0.f) {
      const double gap = segment_length(soma, points[0]);
      if (gap > stem_gap_factor * soma.radius + points[0].radius)
        add(Severity::note, "far-stem", id, 0,
            fmt::format("the stem begins {:.1f} µm from the centre of the soma", gap));
    }
  }
  return findings;
}

}  // namespace forest
