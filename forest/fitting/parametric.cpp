// SPDX-License-Identifier: Apache-2.0
#include "forest/fitting/parametric.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include <fmt/format.h>

#include "forest/core/error.h"
#include "forest/lsystem/grow.h"
#include "forest/morphology/measure.h"
#include "forest/statistics/conditional.h"
#include "forest/statistics/fit_distribution.h"
#include "forest/statistics/summary.h"

namespace forest::fitting {

using namespace statistics;
using Vector = Eigen::Vector3d;

namespace {

constexpr Form form_table[] = {
    {SectionKind::basal, "basal", "Basal"},
    {SectionKind::apical, "apical", "Apical"},
    {SectionKind::glia, "glia", "Glia"},
    {SectionKind::undefined, "undefined", "Kind(0)"},
    {SectionKind::unspecified, "unspecified", "Kind(6)"},
    {SectionKind::custom, "custom", "Kind(5)"},
    {SectionKind::axon, "axon", "Axon"},
};

Vector place(const Point& p) { return p.position().cast<double>(); }

Vector along(std::span<const Point> points, double distance) {
  for (std::size_t i = 1; i < points.size(); ++i) {
    const double length = segment_length(points[i - 1], points[i]);
    if (length >= distance && length > 0.)
      return place(points[i - 1]) + distance / length * (place(points[i]) - place(points[i - 1]));
    distance -= length;
  }
  return place(points.back());
}

double degrees_between(const Vector& u, const Vector& v) {
  return std::atan2(u.cross(v).norm(), u.dot(v)) * (180. / std::numbers::pi);
}

/// Tips of a kind, the mean over cells.
double tips_of(std::span<const Morphology> cells, SectionKind kind) {
  double tips = 0.;
  for (const Morphology& cell : cells) {
    const Arbors arbors(cell, {kind});
    for (const Branch& b : arbors.sections()) tips += b.daughters == 0;
  }
  return tips / double(cells.size());
}

/// Angles between two daughters, from the branch point to their ends.
std::vector<double> spreads_of(std::span<const Morphology> cells, SectionKind kind) {
  std::vector<double> spreads;
  for (const Morphology& cell : cells) {
    const Arbors arbors(cell, {kind});
    const auto chord = [&](std::uint32_t section) {
      const auto points = arbors.points(arbors.section(section));
      return Vector(place(points.back()) - place(points.front()));
    };
    for (const Bifurcation& b : arbors.bifurcations()) {
      const Vector u = chord(b.left), v = chord(b.right);
      if (!u.isZero(0.) && !v.isZero(0.)) spreads.push_back(degrees_between(u, v));
    }
  }
  return spreads;
}

}  // namespace

std::span<const Form> forms() { return form_table; }

double first_diameter(const Arbors& arbors,
                      const Branch& b) {  // a daughter's first point repeats the branch point
  return 2. * arbors.points(b)[b.parent >= 0 ? 1 : 0].radius;
}

Angles angles_of(std::span<const Morphology> cells, SectionKind kind, double step) {
  constexpr double longest = 1e4;  // µm: a stray point must not fill the memory
  auto [turns, spreads] = Angles{.turns = {}, .spreads = spreads_of(cells, kind)};
  std::vector<std::array<double, 2>> walks;  // steps, contraction
  double cosines = 0.;
  for (const Morphology& cell : cells) {
    const Arbors arbors(cell, {kind});
    for (const Branch& b : arbors.sections()) {
      const auto points = arbors.points(b);
      if (!(b.length >= 2. * step && b.length <= longest)) continue;
      walks.push_back({b.length / step, segment_length(points.front(), points.back()) / b.length});
      Vector before = place(points.front()), heading = Vector::Zero();
      for (double at = step; at <= b.length; at += step) {
        const Vector here = along(points, at), now = here - before;
        if (at > step && !now.isZero(0.) && !heading.isZero(0.)) {
          turns.push_back(degrees_between(heading, now) + 1e-3);
          cosines += std::cos(turns.back() * (std::numbers::pi / 180.));
        }
        before = here, heading = now;
      }
    }
  }
  if (turns.empty()) return {turns, spreads};
  // Of n steps whose turns have the mean cosine c the mean square chord is n (1 + c) / (1 - c) - 2 c (1 - c^n) / (1 - c)^2.
  const auto chord = [](double n, double c) {
    return std::sqrt(n * (1. + c) / (1. - c) - 2. * c * (1. - std::pow(c, n)) / ((1. - c) * (1. - c)));
  };
  const auto too_straight = [&](double c) {
    double sum = 0.;
    for (const auto& [n, contraction] : walks) sum += chord(n, c) / n - contraction;
    return sum > 0.;
  };
  double low = 0., high = 1. - 1e-6;
  for (int i = 0; i < 50; ++i) (too_straight(0.5 * (low + high)) ? high : low) = 0.5 * (low + high);
  const double seen = 1. - cosines / double(turns.size());
  const double part = seen > 1e-9 ? std::clamp(std::sqrt((1. - low) / seen), 0.05, 1.5) : 1.;
  for (double& t : turns) t *= part;

  // How much of its first direction a daughter has at its end, by the cosine; two of them are that much further apart.
  double kept = 0.;
  for (const auto& [n, contraction] : walks) kept += (1. - std::pow(low, n)) / (1. - low) / chord(n, low);
  kept /= double(walks.size());
  if (const double wide = mean(spreads) * (std::numbers::pi / 180.); wide > 0.01) {
    const double narrow = std::acos(std::clamp(std::cos(wide) / (kept * kept), -0.99, 0.99));
    for (double& s : spreads) s *= std::clamp(narrow / wide, 0.3, 1.);
  }
  return {turns, spreads};
}

std::size_t abreast(const Arbors& arbors) {
  std::vector<std::pair<double, int>> changes;
  for (const Branch& b : arbors.sections())
    changes.insert(changes.end(), {{b.path_distance - b.length, 1}, {b.path_distance, -1}});
  std::ranges::sort(changes);  // at one place what ends comes first
  int now = 0, most = 0;
  for (const auto& [place, change] : changes) most = std::max(most, now += change);
  return std::size_t(most);
}

std::string drawn_as(const std::string& name, const std::vector<double>& values,
                     std::vector<std::string> families) {
  if (values.empty()) return fmt::format("function {} = 0\n", name);
  const Distribution d =
      fit_distribution(values, {.families = std::move(families), .atoms = false, .replicates = 0})
          .distribution;
  if (d.components.empty()) return d.declaration(name) + '\n';
  const auto [low, high] = std::ranges::minmax(values);
  return fmt::format("distribution {} = min({}, max({}, {}))\n", name, number_text(high), number_text(low),
                     d.expression());
}

std::string drawn_by_diameter(const std::string& name, const std::vector<double>& values,
                              const std::vector<double>& diameters) {
  if (values.empty()) return fmt::format("function {}(d) = 0\n", name);
  return conditional(values, diameters, {.least = 40, .most = 6}, 10).text(name, "d");
}

std::string counted_as(const std::string& name, std::vector<std::size_t> counts) {
  std::ranges::sort(counts);
  std::string rows;
  for (std::size_t i = 0; i < counts.size(); ++i)
    if (i + 1 == counts.size() || counts[i] != counts[i + 1])
      rows += fmt::format("{}{}: {}", rows.empty() ? "" : ", ",
                          i + 1 == counts.size() ? "1" : number_text(double(i + 1) / double(counts.size())),
                          counts[i]);
  return fmt::format("table {0}_counted = {1}\ncell {0} = {0}_counted(uniform(0, 1))\n", name, rows);
}

Stems stems_of(std::span<const Morphology> cells, SectionKind kind) {
  Stems stems;
  for (const Morphology& cell : cells) {
    const Arbors arbors(cell, {kind});
    std::size_t count = 0;
    for (const Branch& b : arbors.sections()) {
      if (b.parent >= 0) continue;
      ++count;
      stems.diameters.push_back(first_diameter(arbors, b));
      const Vector out = along(arbors.points(b), 20.) - place(arbors.origin());
      if (!out.isZero(0.)) stems.elevations.push_back(degrees_between(Vector::UnitY(), out));
    }
    stems.counts.push_back(count);
  }
  return stems;
}

std::string text_of(const Stems& stems, const Form& form, std::string_view first) {
  const std::string k(form.suffix);
  return counted_as("stems_" + k, stems.counts) +
         drawn_as("stem_" + k, stems.diameters, {"gamma", "lognormal", "normal"}) +
         drawn_as("elevation_" + k, stems.elevations, {"truncnormal", "normal", "uniform"}) +
         fmt::format(
             "module Stems_{0}(n)\n"
             "stem_{0}: Stems_{0}(n) : n > 0 {{ d = stem_{0}() }}\n"
             "  -> [ {1} /(uniform(0, 360)) &(elevation_{0}()) f(soma / 2) !(d) {2} ] Stems_{0}(n - 1)\n"
             "bare_{0}: Stems_{0}(n) ->\n",
             k, form.module, first);
}

std::string title_of(const std::string& name) {
  std::string title = name;
  for (char& c : title)
    if (static_cast<unsigned char>(c) < ' ' || c == '#') c = ' ';
  for (std::size_t at = 0; (at = title.find("/*", at)) != title.npos;) title[at + 1] = ' ';
  return title;
}

Cells cells_of(std::span<const Morphology> cells, KindSet kinds, const std::string& name) {
  Cells out;
  std::vector<double> lengths;
  for (const Morphology& cell : cells) {
    const Arbors arbors(cell, kinds);
    for (const Branch& b : arbors.sections())
      if (b.length > 0. && std::isfinite(b.length)) lengths.push_back(b.length);
    if (cell.soma().kind != SomaKind::none) out.somata.push_back(2. * double(cell.soma().sphere().radius));
  }
  if (lengths.empty())
    throw Error(fmt::format(
        "{} has no branch to fit a model to; give traced neurons with sections of that kind", name));
  if (out.somata.empty()) out.somata.push_back(10.);
  out.step = std::clamp(std::round(summarize(lengths).median / 6.), 1., 25.);
  return out;
}

std::string assembled(const std::string& comment, const std::string& title, const std::string& piece,
                      const Cells& shared, std::span<const Part> parts) {
  double steps = 0., modules = 0.;
  std::string axiom, texts;
  for (const Part& p : parts) {
    const double long_way = p.steps + double(*std::ranges::max_element(p.stems.counts));
    steps = std::max(steps, long_way);
    modules += 10. * long_way * 4. * double(std::max<std::size_t>(p.most_abreast, 5));
    axiom += fmt::format(" Stems_{0}(stems_{0})", p.form.suffix);
    texts += p.text;
  }
  return fmt::format(
      "{}title: {}\nsteps: {:.0f}\nlimit: {:.0f}\n\n#define dL {}  # {}\n{}cell soma = soma_diameter()\n{}\n"
      "axiom: Soma(soma){}\n",
      comment, title, std::clamp(std::ceil(steps), 1., 1e6), std::clamp(modules, 1e5, 1e8),
      statistics::number_text(shared.step), piece,
      drawn_as("soma_diameter", shared.somata, {"truncnormal", "normal"}), texts, axiom);
}

void correct(std::span<Correction*> kinds, const std::function<std::string()>& text, int rounds,
             std::uint64_t seed) {
  constexpr std::size_t grown = 80;
  struct Best {
    double more, off, tips;
  };
  std::vector<Best> best(kinds.size(), {1., 1e9, 0.});
  for (int round = 0; round < rounds; ++round) {
    const auto cells =
        lsystem::grow_population(lsystem::parse(text(), "model"), grown, seed + std::uint64_t(round));
    double worst = 0.;
    for (std::size_t k = 0; k < kinds.size(); ++k) {
      Correction& c = *kinds[k];
      const double tips = tips_of(cells, c.kind);
      const double off = std::log(std::max(c.tips, 0.1) / std::max(tips, 0.1));
      if (std::abs(off) < best[k].off) best[k] = {c.more, std::abs(off), tips};
      worst = std::max(worst, std::abs(off));
      const double slowly = round < 4 ? 0.5 : 0.25;  // by then what is left is chance
      c.more = std::clamp(c.more * std::exp(std::clamp(slowly * off, -0.4, 0.4)), 0.05, 10.);
    }
    if (worst < 0.03) break;
  }
  for (std::size_t k = 0; k < kinds.size() && rounds > 0; ++k)
    kinds[k]->more = best[k].more, kinds[k]->grown = best[k].tips;
}

std::string Correction::comment() const {
  return fmt::format("{} tips were traced in the mean{}", number_text(tips),
                     grown > 0. ? fmt::format(", and {} grew with it", number_text(grown)) : "");
}

}  // namespace forest::fitting
