// SPDX-License-Identifier: Apache-2.0
#include "forest/geometry/nearest_inside.h"

#include "forest/core/parallel.h"

namespace forest {
namespace {

// The lower envelope of parabolas over one line of points: f(i) + (step (x − i))².
class Envelope {
 public:
  explicit Envelope(std::size_t points) : at_(points), from_(points), f_(points) {}

  // Calls take(x, i) for every x of `count` where some f is known: the parabola i is the lowest.
  template <class F, class Take>
  void run(std::size_t count, double step, F&& f, Take&& take) {
    std::size_t kept = 0;
    const double unit = step * step;
    for (std::size_t i = 0; i < count; ++i) {
      const double height = f(i);
      if (height < 0.) continue;  // nothing is known there
      double begins = -1.;
      while (kept > 0) {
        const double a = double(at_[kept - 1]), b = double(i);
        begins = .5 * (a + b) + (height - f_[kept - 1]) / (2. * unit * (b - a));
        if (begins > from_[kept - 1]) break;
        --kept, begins = -1.;
      }
      at_[kept] = i, from_[kept] = begins, f_[kept] = height, ++kept;
    }
    for (std::size_t x = 0, k = 0; kept > 0 && x < count; ++x) {
      while (k + 1 < kept && from_[k + 1] < double(x)) ++k;
      take(x, at_[k]);
    }
  }

 private:
  std::vector<std::size_t> at_;
  std::vector<double> from_, f_;
};

}  // namespace

std::vector<std::uint32_t> nearest_inside(const ScalarGrid& grid) {
  const auto [nx, ny, nz] = grid.size;
  std::vector<std::uint32_t> nearest(grid.count(), no_point);
  for (std::size_t i = 0; i < grid.count(); ++i)
    if (grid.values[i] < 0.f) nearest[i] = std::uint32_t(i);

  const std::size_t strides[] = {1, nx, nx * ny};
  const auto squared = [&](std::size_t i) {
    const std::uint32_t j = nearest[i];
    if (j == no_point) return -1.;
    double sum = 0.;
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const std::size_t size = grid.size[axis];
      const double off = grid.step[Eigen::Index(axis)] *
                         (double(i / strides[axis] % size) - double(j / strides[axis] % size));
      sum += off * off;
    }
    return sum;
  };
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const std::size_t length = grid.size[axis], stride = strides[axis];
    parallel_ranges(grid.count() / length, 64, [&](std::size_t begin, std::size_t end) {
      Envelope envelope(length);
      std::vector<std::uint32_t> line(length);
      for (std::size_t l = begin; l < end; ++l) {
        const std::size_t first = l / stride * stride * length + l % stride;
        bool any = false;
        envelope.run(
            length, grid.step[Eigen::Index(axis)], [&](std::size_t i) { return squared(first + i * stride); },
            [&](std::size_t x, std::size_t i) { line[x] = nearest[first + i * stride], any = true; });
        for (std::size_t x = 0; any && x < length; ++x) nearest[first + x * stride] = line[x];
      }
    });
  }
  return nearest;
}

}  // namespace forest
