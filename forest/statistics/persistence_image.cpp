// SPDX-License-Identifier: Apache-2.0
#include "forest/statistics/persistence_image.h"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "forest/core/parallel.h"
#include "forest/core/random.h"
#include "forest/statistics/dealing.h"
#include "forest/statistics/two_samples.h"

namespace forest::statistics {

PersistenceImages persistence_images(std::span<const Bars> cells, Eigen::Index side, double width) {
  PersistenceImages out{
      .side = side, .reach = 0., .images = Eigen::MatrixXd::Zero(Eigen::Index(cells.size()), side * side)};
  std::vector<double> reaches;
  for (const Bars& bars : cells) {
    double reach = 0.;
    for (const Bar& bar : bars) reach = std::max({reach, bar.birth, bar.death});
    if (!bars.empty()) reaches.push_back(reach);
  }
  if (!reaches.empty()) out.reach = quantile(reaches, .95);
  if (!(out.reach > 0.) || !std::isfinite(out.reach)) return out;
  parallel_for(cells.size(), 2, [&](std::size_t i) {
    Eigen::MatrixXd image = Eigen::MatrixXd::Zero(side, side);
    const auto profile = [&](double at) -> Eigen::VectorXd {
      Eigen::VectorXd p(side);
      for (Eigen::Index k = 0; k < side; ++k) {
        const double z = ((double(k) + .5) / double(side) - std::min(1., at / out.reach)) / width;
        p[k] = std::exp(-.5 * z * z);
      }
      return p / p.sum();  // what lies beyond the edge counts within
    };
    for (const Bar& bar : cells[i]) image += profile(bar.birth) * profile(bar.death).transpose();
    if (!cells[i].empty())
      out.images.row(Eigen::Index(i)) = image.reshaped().transpose() / double(cells[i].size());
  });
  return out;
}

DistanceTest barcode_distance(const PersistenceImages& all, std::size_t first, std::size_t dealings,
                              std::uint64_t seed, std::span<const std::uint32_t> slices) {
  const auto n = std::size_t(all.images.rows());
  if (first == 0 || first >= n) return {};
  const Eigen::MatrixXd pixels = all.images.transpose();  // a cell a column
  const Eigen::VectorXd total = pixels.rowwise().sum();
  const auto distance = [&](std::span<const std::uint32_t> order) {
    Eigen::VectorXd sum = Eigen::VectorXd::Zero(pixels.rows());
    for (const std::uint32_t cell : order.first(first)) sum += pixels.col(cell);
    return .5 * (sum / double(first) - (total - sum) / double(n - first)).lpNorm<1>();
  };
  std::vector<std::uint32_t> order(n);
  std::iota(order.begin(), order.end(), 0u);
  const double found = distance(order);
  std::vector<char> as_far(dealings);
  parallel_for(dealings, 16, [&](std::size_t k) {
    Random random(seed, k, 0x62617263);  // "barc"
    as_far[k] = distance(dealt(n, slices, random)) >= found - 1e-12;
  });
  return {found, (double(std::ranges::count(as_far, char(1))) + 1.) / (double(dealings) + 1.)};
}

}  // namespace forest::statistics
