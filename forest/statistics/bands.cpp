// SPDX-License-Identifier: Apache-2.0
#include "forest/statistics/bands.h"

#include <algorithm>
#include <cmath>

#include "forest/core/parallel.h"
#include "forest/core/random.h"
#include "forest/statistics/two_samples.h"

namespace forest::statistics {

// Of the highest mean: below it a curve is that of one or two cells, of which no band can be made.
constexpr double faint = .02;

Curve mean_curve(std::span<const Curve> curves) {
  Curve sum;
  for (const Curve& curve : curves) {
    if (curve.size() > sum.size()) sum.resize(curve.size(), 0.);
    for (std::size_t i = 0; i < curve.size(); ++i) sum[i] += curve[i];
  }
  for (double& x : sum) x /= double(curves.size());
  return sum;
}

Band band_of(std::span<const Curve> known, std::span<const Curve> more, std::size_t cells, std::size_t draws,
             std::uint64_t seed) {
  std::vector<const Curve*> all;
  std::size_t radii = 0;
  for (const auto part : {known, more})
    for (const Curve& curve : part) all.push_back(&curve), radii = std::max(radii, curve.size());
  Band band{.mean = mean_curve(known), .lower = Curve(radii, 0.), .upper = Curve(radii, 0.)};
  band.mean.resize(radii, 0.);
  if (known.empty() || radii == 0 || cells == 0) return band;

  std::vector<Curve> apart(std::max<std::size_t>(draws, 2), Curve(radii, 0.));
  parallel_for(apart.size(), 16, [&](std::size_t k) {
    Random random(seed, k, 0x62616e64);  // "band"
    const auto draw = [&](std::size_t count, double sign) {
      for (std::size_t i = 0; i < count; ++i) {
        const Curve& curve = *all[random.below(std::uint32_t(all.size()))];
        for (std::size_t r = 0; r < curve.size(); ++r) apart[k][r] += sign * curve[r] / double(count);
      }
    };
    draw(known.size(), 1.);
    draw(cells, -1.);
  });
  Curve sd(radii, 0.);
  for (const Curve& curve : apart)
    for (std::size_t r = 0; r < radii; ++r) sd[r] += curve[r] * curve[r] / double(apart.size());
  for (double& x : sd) x = std::sqrt(x);

  const double least = faint * *std::ranges::max_element(band.mean);
  // How many standard deviations a pair needs so that 95 % of its radii are within.
  std::vector<double> reach;
  for (const Curve& curve : apart) {
    std::vector<double> z;
    for (std::size_t r = 0; r < radii; ++r)
      if (sd[r] > 0. && band.mean[r] > least) z.push_back(std::abs(curve[r]) / sd[r]);
    if (z.empty()) continue;
    const auto enough = z.begin() + std::ptrdiff_t(std::ceil(.95 * double(z.size()))) - 1;
    std::nth_element(z.begin(), enough, z.end());
    reach.push_back(*enough);
  }
  const double times = reach.empty() ? 0. : quantile(reach, .95);
  for (std::size_t r = 0; r < radii; ++r) {
    band.lower[r] = std::max(0., band.mean[r] - times * sd[r]);
    band.upper[r] = band.mean[r] + times * sd[r];
  }
  return band;
}

double share_inside(const Curve& curve, const Band& band) {
  const double least = faint * (band.mean.empty() ? 0. : *std::ranges::max_element(band.mean));
  std::size_t inside = 0, count = 0;
  for (std::size_t r = 0; r < std::max(curve.size(), band.mean.size()); ++r) {
    const bool known = r < band.mean.size();
    const double x = r < curve.size() ? curve[r] : 0.;
    if (x <= 2. * least && (!known || band.mean[r] <= least)) continue;
    ++count;
    inside += known && x >= band.lower[r] - 1e-9 && x <= band.upper[r] + 1e-9;
  }
  return count ? double(inside) / double(count) : 1.;
}

}  // namespace forest::statistics
