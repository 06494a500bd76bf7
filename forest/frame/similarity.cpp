// SPDX-License-Identifier: Apache-2.0
#include "forest/frame/similarity.h"

#include <algorithm>
#include <array>
#include <cmath>

#include <fmt/format.h>

#include "forest/core/error.h"
#include "forest/core/parallel.h"

namespace forest::frame {
namespace {

constexpr int reach = 5;  // of the window, to each side
using Window = std::array<double, 2 * reach + 1>;

Window gaussian() {
  Window window{};
  double sum = 0.;
  for (int i = -reach; i <= reach; ++i)
    sum += window[std::size_t(i + reach)] = std::exp(-double(i * i) / (2. * 1.5 * 1.5));
  for (double& w : window) w /= sum;
  return window;
}

// The weighted sums that a window needs: of both pictures, their squares and their product.
using Moments = Eigen::Array<double, 5, 1>;

void require_same_size(const Image& a, const Image& b) {
  if (a.width != b.width || a.height != b.height || !a.width || !a.height)
    throw Error(
        fmt::format("pictures of {} × {} and {} × {} pixels cannot be compared; draw both in one size",
                    a.width, a.height, b.width, b.height));
}

}  // namespace

std::vector<float> luminance(const Image& image) {
  std::vector<float> result(std::size_t(image.width) * image.height);
  for (std::size_t i = 0; i < result.size(); ++i) {
    const std::uint8_t* p = &image.pixels[4 * i];
    result[i] = .2126f * p[0] + .7152f * p[1] + .0722f * p[2];
  }
  return result;
}

double similarity(const Image& a, const Image& b) {
  require_same_size(a, b);
  static const Window window = gaussian();
  const int width = int(a.width), height = int(a.height);
  const std::vector<float> la = luminance(a), lb = luminance(b);

  // The window is separable: across first, then down.
  std::vector<Moments> rows(la.size());
  const auto weighted = [](int at, int size, const auto& value) {
    Moments sum = Moments::Zero();
    double weight = 0.;
    for (int i = std::max(at - reach, 0); i <= std::min(at + reach, size - 1); ++i) {
      const double w = window[std::size_t(i - at + reach)];
      sum += w * value(i);
      weight += w;
    }
    return Moments(sum / weight);
  };
  parallel_for(std::size_t(height), 8, [&](std::size_t y) {
    for (int x = 0; x < width; ++x)
      rows[y * a.width + std::size_t(x)] = weighted(x, width, [&](int i) {
        const double p = la[y * a.width + std::size_t(i)], q = lb[y * a.width + std::size_t(i)];
        return Moments(p, q, p * p, q * q, p * q);
      });
  });
  const int side = width > 2 * reach ? reach : 0, top = height > 2 * reach ? reach : 0;
  std::vector<double> sums(std::size_t(height), 0.);
  parallel_for(std::size_t(height - 2 * top), 8, [&](std::size_t row) {
    const int y = int(row) + top;
    for (int x = side; x < width - side; ++x) {
      const Moments m = weighted(y, height, [&](int i) -> const Moments& {
        return rows[std::size_t(i) * a.width + std::size_t(x)];
      });
      constexpr double c1 = .01 * 255. * .01 * 255., c2 = .03 * 255. * .03 * 255.;
      const double variance_a = m[2] - m[0] * m[0], variance_b = m[3] - m[1] * m[1],
                   covariance = m[4] - m[0] * m[1];
      sums[row] += (2. * m[0] * m[1] + c1) * (2. * covariance + c2) /
                   ((m[0] * m[0] + m[1] * m[1] + c1) * (variance_a + variance_b + c2));
    }
  });
  double sum = 0.;
  for (const double s : sums) sum += s;
  return sum / (double(width - 2 * side) * double(height - 2 * top));
}

double change(const Image& a, const Image& b) {
  require_same_size(a, b);
  const std::vector<float> la = luminance(a), lb = luminance(b);
  double sum = 0.;
  for (std::size_t i = 0; i < la.size(); ++i) sum += std::abs(double(la[i]) - double(lb[i]));
  return sum / double(la.size());
}

}  // namespace forest::frame
