// SPDX-License-Identifier: Apache-2.0
#include "forest/core/random.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include <Random123/philox.h>
#include <boost/math/special_functions/erf.hpp>

namespace forest {

std::uint32_t Random::operator()() {
  if (used_ == 4) {
    const r123::Philox4x32::ctr_type counter{
        {block_++, stream_, std::uint32_t(item_), std::uint32_t(item_ >> 32)}};
    const r123::Philox4x32::key_type key{{std::uint32_t(seed_), std::uint32_t(seed_ >> 32)}};
    const auto block = r123::Philox4x32{}(counter, key);
    std::copy_n(block.begin(), 4, words_.begin());
    used_ = 0;
  }
  return words_[used_++];
}

double Random::uniform() {
  const std::uint64_t high = (*this)(), low = (*this)();
  return double((high << 21) ^ (low >> 11)) * 0x1p-53;
}

double Random::uniform(double low, double high) { return low + (high - low) * uniform(); }

std::uint32_t Random::below(std::uint32_t count) {
  // Lemire 2019: multiply, and reject the few low products that would favour small results.
  std::uint64_t product = std::uint64_t((*this)()) * count;
  if (std::uint32_t(product) < count) {
    const std::uint32_t threshold = (0u - count) % count;
    while (std::uint32_t(product) < threshold) product = std::uint64_t((*this)()) * count;
  }
  return std::uint32_t(product >> 32);
}

double Random::normal(double mean, double sd) {
  const double radius = std::sqrt(-2. * std::log1p(-uniform()));
  return mean + sd * radius * std::cos(2. * std::numbers::pi * uniform());
}

double Random::truncated_normal(double mean, double sd, double low, double high) {
  if (!(sd > 0.)) return std::clamp(mean, low, high);
  if (low > mean) return -truncated_normal(-mean, sd, -high, -low);  // near 1 a share says too little
  const auto phi = [&](double x) { return 0.5 * std::erfc(-(x - mean) / (sd * std::numbers::sqrt2)); };
  const double u = uniform(), from = phi(low), to = phi(high), p = from + (to - from) * u;
  if (high < mean && !(to > std::numeric_limits<double>::min())) {
    // Some 38 deviations away, where it falls as an exponential one does.
    const double steep = (mean - high) / (sd * sd);
    return std::max(low, high + std::log1p(-u * -std::expm1(steep * (low - high))) / steep);
  }
  if (p <= 0. || p >= 1.) return std::clamp(mean, low, high);
  return std::clamp(mean - sd * std::numbers::sqrt2 * boost::math::erfc_inv(2. * p), low, high);
}

double Random::exponential(double mean) { return -mean * std::log1p(-uniform()); }

double Random::gamma(double shape, double scale) {
  if (shape < 1.) return gamma(shape + 1., scale) * std::pow(1. - uniform(), 1. / shape);
  const double d = shape - 1. / 3., c = 1. / std::sqrt(9. * d);
  for (;;) {
    const double x = normal(), v = std::pow(1. + c * x, 3);
    if (v > 0. && std::log1p(-uniform()) < 0.5 * x * x + d - d * v + d * std::log(v)) return d * v * scale;
  }
}

double Random::von_mises(double mean, double concentration) {
  constexpr double degree = std::numbers::pi / 180.;
  double turn;
  if (concentration < 1e-6) {
    turn = uniform(-180., 180.);
  } else if (concentration > 1e6) {  // the normal distribution, closer than a float can say
    turn = normal() / std::sqrt(concentration) / degree;
  } else {
    const double t = 1. + std::sqrt(1. + 4. * concentration * concentration);
    const double rho = (t - std::sqrt(2. * t)) / (2. * concentration), r = (1. + rho * rho) / (2. * rho);
    double f, c;
    do {
      const double z = std::cos(std::numbers::pi * uniform());
      f = (1. + r * z) / (r + z), c = concentration * (r - f);
    } while (std::log1p(-uniform()) > std::log(c) + 1. - c);
    turn = std::copysign(std::acos(std::clamp(f, -1., 1.)) / degree, uniform() - 0.5);
  }
  const double whole = std::remainder(mean + turn, 360.);  // in [-180, 180]
  return whole == -180. ? 180. : whole;
}

}  // namespace forest
