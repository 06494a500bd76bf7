// SPDX-License-Identifier: Apache-2.0
#include "forest/fitting/hillman.h"

#include <algorithm>
#include <cmath>
#include <optional>
#include <vector>

#include <fmt/format.h>

#include "forest/fitting/parametric.h"
#include "forest/statistics/distribution.h"

namespace forest::fitting {
namespace {

using namespace statistics;
using Values = std::vector<double>;

struct HillmanModel : KindModel {
  Values forking, ending;         // lengths
  Values tapers, tapered;         // … of branches of these diameters
  Values daughters, pk, parents;  // at forks of parents of these diameters
  Values thresholds, girths;
  // `correction` is of the threshold, and divides it.
};

std::optional<HillmanModel> measured(std::span<const Morphology> cells, const Form& form, double step) {
  HillmanModel model;
  model.form = &form, model.correction.kind = form.kind;
  model.stems = stems_of(cells, form.kind), model.angles = angles_of(cells, form.kind, step);
  for (const Morphology& cell : cells) {
    const Arbors arbors(cell, {form.kind});
    std::size_t tips = 0;
    for (const Branch& b : arbors.sections()) {
      const double first = first_diameter(arbors, b), last = 2. * arbors.points(b).back().radius;
      ++model.sections;
      tips += b.daughters == 0;
      model.extent = std::max(model.extent, b.path_distance);
      model.girths.push_back(last);
      if (b.length > 0. && std::isfinite(b.length))
        (b.daughters ? model.forking : model.ending).push_back(std::min(b.length, 1e5));
      if (!(first > 0.)) continue;
      model.tapers.push_back(std::clamp((first - last) / first, -1., 0.95));
      model.tapered.push_back(first);
    }
    for (const Bifurcation& f : arbors.bifurcations()) {
      const Branch &left = arbors.section(f.left), &right = arbors.section(f.right);
      const double parent = 2. * arbors.points(arbors.section(f.parent)).back().radius;
      const double x = first_diameter(arbors, left), y = first_diameter(arbors, right);
      const double big = std::max(x, y), small = std::min(x, y);
      if (!(small > 0. && parent > 0.)) continue;
      model.parents.push_back(parent);
      model.daughters.push_back(std::min(big / small, 10.));
      model.pk.push_back(std::min((std::pow(big, 1.5) + std::pow(small, 1.5)) / std::pow(parent, 1.5), 5.));
      if (left.daughters == 0 && right.daughters == 0)
        model.thresholds.push_back(0.5 * parent + 0.25 * (x + y));
    }
    model.correction.tips += double(tips) / double(cells.size());
    model.most_abreast = std::max(model.most_abreast, abreast(arbors));
  }
  model.extent = std::min(model.extent, 1e5);  // 10 cm: a stray point must not make growth endless
  std::ranges::sort(model.girths);
  if (model.sections == 0 || (model.forking.empty() && model.ending.empty())) return std::nullopt;
  return model;
}

std::string text_of(const HillmanModel& m) {
  const std::string k(m.form->suffix);
  const double finest = std::max(0.05, m.girths[m.girths.size() / 100]);
  const double thickest = std::max({finest, m.girths.back(), *std::ranges::max_element(m.stems.diameters)});
  std::string t = fmt::format("\n# {}: {} sections of {} cells\n", k, m.sections, m.stems.counts.size());
  const std::vector<std::string> sizes{"gamma", "lognormal", "weibull"};
  t += drawn_as("forking_" + k, m.forking, sizes);
  t += drawn_as("ending_" + k, m.ending, sizes);
  t += drawn_by_diameter("taper_" + k, m.tapers, m.tapered);
  t += m.thresholds.empty() ? fmt::format("function threshold_{} = {}\n", k, number_text(2. * thickest))
                            : drawn_as("threshold_" + k, m.thresholds, sizes);
  t += drawn_by_diameter("daughter_" + k, m.daughters, m.parents);
  t += drawn_by_diameter("pk_" + k, m.pk, m.parents);
  t += drawn_as("spread_" + k, m.angles.spreads, {"truncnormal", "normal"});
  t += drawn_as("wander_" + k, m.angles.turns, {"weibull", "gamma", "lognormal"});
  t += fmt::format(
      "#define extent_{0} {1}  # µm of path at most\n"
      "#define more_{0} {2}  # corrects the threshold: {3}\n"
      "function girth_{0}(d) = min({4}, max({5}, d))\n"
      "module Branch_{0}(d, path), Run_{0}(left, length, d, e, path, forks)\n"
      "total budding_{0} = Branch_{0}(d, path) : 1\n"
      "total growing_{0} = Run_{0}(left, length, d, e, path, forks) : 1\n"
      "branch_{0}: Branch_{0}(d, path) {{ e = girth_{0}(d * (1 - taper_{0}(d))),\n"
      "    forks = path < extent_{0} & growing_{0} + budding_{0} < {6} & e > threshold_{0}() / more_{0},\n"
      "    l = max(0.1, if(forks, forking_{0}(), ending_{0}())) }} -> Run_{0}(l, l, d, e, path + l, forks)\n"
      "run_{0}: Run_{0}(left, l, d, e, path, forks) : left > dL\n"
      "  -> /(uniform(0, 360)) &(wander_{0}()) F(dL, e + (d - e) * (left - dL) / l) Run_{0}(left - dL, l, d, "
      "e, path, forks)\n"
      "tip_{0}: Run_{0}(left, l, d, e, path, forks) : forks == 0 -> F(left, e)\n"
      "fork_{0}: Run_{0}(left, l, d, e, path, forks)\n"
      "  {{ q = max(1, daughter_{0}(e)), w = e * (pk_{0}(e) / (1 + q^1.5))^(2 / 3), small = girth_{0}(w), "
      "big "
      "= girth_{0}(q * w),\n"
      "    b = spread_{0}() }}\n"
      "  -> F(left, e) /(uniform(0, 360)) [ +(b * big / (small + big)) !(small) Branch_{0}(small, path) ]\n"
      "  -(b * small / (small + big)) !(big) Branch_{0}(big, path)\n",
      k, number_text(m.extent), number_text(m.correction.more), m.correction.comment(), number_text(thickest),
      number_text(finest), 4 * std::max<std::size_t>(m.most_abreast, 5));
  return t + text_of(m.stems, *m.form, fmt::format("Branch_{}(d, 0)", k));
}

std::string text_of(const std::vector<HillmanModel>& kinds, const Cells& shared, std::size_t cells,
                    const std::string& name) {
  std::vector<Part> parts;
  for (const HillmanModel& m : kinds)
    parts.push_back({*m.form, m.stems, m.most_abreast, 3. * m.extent / shared.step + 200., text_of(m)});
  return assembled(fmt::format("# Estimated from {} traced cells in the parameters of Hillman (1979), as "
                               "L-Neuron grows by them (Ascoli & Krichmar,\n"
                               "# Neurocomputing 32:1003, 2000): a branch forks when it is still thicker "
                               "than a threshold. Lengths are µm.\n",
                               cells),
                   title_of(name) + " (after Hillman 1979 and Ascoli & Krichmar 2000)", "µm between points",
                   shared, parts);
}

}  // namespace

std::string hillman_grammar(std::span<const Morphology> cells, const std::string& name,
                            const ParametricOptions& options) {
  return corrected_grammar(cells, name, options, measured, text_of);
}

}  // namespace forest::fitting
