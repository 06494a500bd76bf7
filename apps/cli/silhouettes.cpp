// SPDX-License-Identifier: Apache-2.0
#include "apps/cli/silhouettes.h"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <utility>
#include <vector>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "forest/core/random.h"
#include "forest/core/round_numbers.h"

namespace forest::cli {
namespace {

constexpr double width = 880., gap = 8.;  // of the drawing and between neurons, pixels
constexpr double most_scale = 1.2;        // pixels a µm
constexpr double smallest_step = .6;      // pixels: what is nearer than this to the point before is not drawn
constexpr std::size_t in_a_row = 6;

struct Box {
  Vec3 low = Vec3::Constant(INFINITY), high = Vec3::Constant(-INFINITY);
};

Box box_of(const Morphology& m, const statistics::KindSet& kinds) {
  Box box;
  const auto take = [&](const Point& p) {
    box.low = box.low.cwiseMin(p.position()), box.high = box.high.cwiseMax(p.position());
  };
  take(m.soma().sphere());
  for (std::uint32_t i = 0; i < m.sections().size(); ++i)
    if (kinds.contains(m.section(SectionId(i)).kind))
      for (const Point& p : m.points(SectionId(i))) take(p);
  return box;
}

char letter(std::size_t i) { return char('A' + i % 26); }

}  // namespace

std::string silhouettes(std::span<const Morphology* const> neurons, const statistics::KindSet& kinds) {
  std::vector<Box> boxes;
  double widest = 1., tallest = 1.;
  for (const Morphology* m : neurons) {
    const Box& box = boxes.emplace_back(box_of(*m, kinds));
    widest = std::max(widest, double(box.high.x() - box.low.x()));
    tallest = std::max(tallest, double(box.high.y() - box.low.y()));
  }
  const double column = width / double(in_a_row), room = 1.7 * column;
  const double scale = std::min({most_scale, (column - gap) / widest, room / tallest}),
               row = scale * tallest + 3. * gap;
  std::string body;
  const auto out = std::back_inserter(body);
  for (std::size_t i = 0; i < neurons.size(); ++i) {
    const Morphology& m = *neurons[i];
    const Vec3 middle = .5f * (boxes[i].low + boxes[i].high);
    const double left = (double(i % in_a_row) + .5) * column, bottom = double(i / in_a_row + 1) * row - gap;
    const auto x = [&](const Point& p) { return left + scale * double(p.x - middle.x()); };
    const auto y = [&](const Point& p) { return bottom - scale * double(p.y - boxes[i].low.y()); };
    for (std::uint32_t s = 0; s < m.sections().size(); ++s) {
      const SectionId id(s);
      if (!kinds.contains(m.section(id).kind)) continue;
      const auto points = m.points(id);
      double thick = 0., last_x = x(points.front()), last_y = y(points.front());
      fmt::format_to(out, "<path d=\"M{:.1f} {:.1f}", last_x, last_y);
      for (const Point& p : points) {
        thick += 2. * double(p.radius) / double(points.size());
        if (std::hypot(x(p) - last_x, y(p) - last_y) < smallest_step && &p != &points.back()) continue;
        fmt::format_to(out, "L{:.1f} {:.1f}", x(p), y(p));
        last_x = x(p), last_y = y(p);
      }
      fmt::format_to(out, "\" stroke-width=\"{:.2f}\"{}/>\n", std::max(.5, scale * thick),
                     m.section(id).kind == SectionKind::apical ? "" : " stroke-opacity=\"0.75\"");
    }
    const Point soma = m.soma().sphere();
    fmt::format_to(
        out, "<circle cx=\"{:.1f}\" cy=\"{:.1f}\" r=\"{:.1f}\" fill=\"currentColor\" stroke=\"none\"/>\n",
        x(soma), y(soma), std::max(1., scale * double(soma.radius)));
    fmt::format_to(
        out,
        "<text x=\"{:.1f}\" y=\"{:.1f}\" font-size=\"13\" fill=\"currentColor\" stroke=\"none\">{}</text>\n",
        left - .5 * column + 4., bottom - scale * tallest + 4., letter(i));
  }
  const double bar = round_below(.4 * column / scale),
               height = row * std::ceil(double(neurons.size()) / double(in_a_row));
  fmt::format_to(out,
                 "<path d=\"M4 {0:.1f}h{1:.1f}\" stroke-width=\"2\"/>\n<text x=\"{2:.1f}\" y=\"{3:.1f}\" "
                 "font-size=\"12\" "
                 "fill=\"currentColor\" stroke=\"none\">{4:.6g} µm</text>\n",
                 height + 10., scale * bar, 10. + scale * bar, height + 14., bar);
  return fmt::format(
      "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {:.0f} {:.0f}\" role=\"img\" "
      "aria-label=\"neurons\" "
      "font-family=\"'DejaVu Sans', Verdana, sans-serif\">\n<g fill=\"none\" stroke=\"currentColor\" "
      "stroke-linecap=\"round\" stroke-linejoin=\"round\">\n{}</g></svg>\n",
      width, height + 22., body);
}

Riddle which_is_which(std::span<const Morphology> traced, std::span<const Morphology> grown, std::size_t each,
                      const statistics::KindSet& kinds, std::uint64_t seed) {
  // Those with something to be seen: a soma alone would give itself away.
  std::vector<const Morphology*> seen[2];
  for (const bool is_grown : {false, true})
    for (const Morphology& m : is_grown ? grown : traced)
      if (std::ranges::any_of(m.sections(), [&](const Section& s) { return kinds.contains(s.kind); }))
        seen[is_grown].push_back(&m);
  each = std::min({each, seen[0].size(), seen[1].size()});
  Random random(seed, 0, 0x51de);
  const auto shuffled = [&](auto items) {
    for (std::size_t i = items.size(); i > 1; --i)
      std::swap(items[i - 1], items[random.below(std::uint32_t(i))]);
    return items;
  };
  std::vector<std::pair<const Morphology*, bool>> all;
  for (const bool is_grown : {false, true}) {
    const std::vector<const Morphology*> some = shuffled(std::move(seen[is_grown]));
    for (std::size_t i = 0; i < each; ++i) all.emplace_back(some[i], is_grown);
  }
  all = shuffled(std::move(all));
  std::vector<const Morphology*> neurons;
  std::vector<char> answer[2];
  for (std::size_t i = 0; i < all.size(); ++i) {
    neurons.push_back(all[i].first);
    answer[all[i].second].push_back(letter(i));
  }
  return {silhouettes(neurons, kinds), fmt::format("Traced are {}; grown are {}.", fmt::join(answer[0], ", "),
                                                   fmt::join(answer[1], ", "))};
}

}  // namespace forest::cli
