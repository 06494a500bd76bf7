// SPDX-License-Identifier: Apache-2.0
// Curves of two samples of cells (Sholl's crossings by radius), and how far apart their means may be by chance.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace forest::statistics {

using Curve = std::vector<double>;

/// Values behind the end of a curve are 0.
Curve mean_curve(std::span<const Curve> curves);

/// Where the mean of `cells` further cells of a population would lie, of which `known` and `more` cells are known.
struct Band {
  Curve mean;  // of `known`
  // Between them, at 95 % of radii, is the mean of `cells` cells of the same population, in 95 % of the cases.
  Curve lower, upper;
};

/// By the bootstrap: pairs of samples, as large as `known` and as `cells`, are drawn with repetition from all known
/// cells; the band is as wide as the standard deviation of their difference at each radius, times what holds 95 % of the
/// pairs at 95 % of the radii. Radii that hardly any cell reaches do not count.
Band band_of(std::span<const Curve> known, std::span<const Curve> more, std::size_t cells, std::size_t draws,
             std::uint64_t seed);

/// Share of radii at which a curve lies in the band: of those where the band's mean is more than a fiftieth of its highest one, or the
/// curve more than twice that, which leaves out what only one or two cells reach.
double share_inside(const Curve& curve, const Band& band);

}  // namespace forest::statistics
