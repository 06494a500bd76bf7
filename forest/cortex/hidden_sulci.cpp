// SPDX-License-Identifier: Apache-2.0
#include "forest/cortex/hidden_sulci.h"

#include <algorithm>
#include <cmath>

#include "forest/core/parallel.h"
#include "forest/geometry/nearest_inside.h"

namespace forest::cortex {
namespace {

// Where banks meet, it is at least so many times as far from white matter as the cortex around is thick; and the ways there from
// before and behind, between sections, make an angle of this cosine or less. Of .5 to .9, and -.7 to 0, on one brain
// (docs/cortex/surfaces.md): less of either opens more, and more that is none.
constexpr double least_share = .7, most_cosine = -.3;
constexpr double block = 8000.;  // µm over which the cortex is about as thick

// The way from every point to white matter.
class Ways {
 public:
  explicit Ways(const ScalarGrid& inner) : grid_(inner), nearest_(nearest_inside(inner)) {}

  Eigen::Vector3d place(std::size_t i) const {
    const auto [nx, ny, nz] = grid_.size;
    return grid_.step.cwiseProduct(Eigen::Vector3d(double(i % nx), double(i / nx % ny), double(i / nx / ny)));
  }
  Eigen::Vector3d operator()(std::size_t i) const { return place(nearest_[i]) - place(i); }
  // Up to the surface, which lies a little before the nearest point.
  double distance(std::size_t i) const {
    return std::max(0., (*this)(i).norm() + double(grid_.values[nearest_[i]]));
  }

 private:
  const ScalarGrid& grid_;
  std::vector<std::uint32_t> nearest_;
};

// How thick the cortex is where sections show both its surfaces, in the mean of blocks and those beside them.
class Thickness {
 public:
  Thickness(const ScalarGrid& outer, const Ways& ways, std::size_t between) : grid_(outer) {
    for (std::size_t k = 0; k < 3; ++k)
      size_[k] = 1 + std::size_t(double(outer.size[k] - 1) * outer.step[Eigen::Index(k)] / block);
    std::vector<std::pair<double, double>> sums(size_[0] * size_[1] * size_[2]);  // weight, of distances
    const std::size_t layer = outer.size[0] * outer.size[1];
    const auto reach = float(outer.step[0]);
    for (std::size_t i = 0; i < outer.count(); ++i)
      if (outer.values[i] >= 0.f && outer.values[i] < reach && i / layer % between == 0) {
        auto& [count, sum] = sums[block_of(i)];
        count += 1., sum += ways.distance(i);
      }
    std::pair<double, double> all;
    for (const auto& [count, sum] : sums) all.first += count, all.second += sum;
    if (all.first == 0.) return;
    mean_.resize(sums.size());
    for (std::size_t z = 0; z < size_[2]; ++z)
      for (std::size_t y = 0; y < size_[1]; ++y)
        for (std::size_t x = 0; x < size_[0]; ++x) {
          std::pair<double, double> near(1., all.second / all.first);  // where nothing is known
          for (std::size_t c = z - std::min<std::size_t>(z, 1); c < std::min(z + 2, size_[2]); ++c)
            for (std::size_t b = y - std::min<std::size_t>(y, 1); b < std::min(y + 2, size_[1]); ++b)
              for (std::size_t a = x - std::min<std::size_t>(x, 1); a < std::min(x + 2, size_[0]); ++a) {
                const auto& [count, sum] = sums[(c * size_[1] + b) * size_[0] + a];
                near.first += count, near.second += sum;
              }
          mean_[(z * size_[1] + y) * size_[0] + x] = near.second / near.first;
        }
  }

  bool known() const { return !mean_.empty(); }
  double at(std::size_t i) const { return mean_[block_of(i)]; }

 private:
  std::size_t block_of(std::size_t i) const {
    const auto [nx, ny, nz] = grid_.size;
    const auto part = [&](std::size_t n, Eigen::Index axis) {
      return std::size_t(double(n) * grid_.step[axis] / block);
    };
    return (part(i / nx / ny, 2) * size_[1] + part(i / nx % ny, 1)) * size_[0] + part(i % nx, 0);
  }

  const ScalarGrid& grid_;
  std::size_t size_[3];
  std::vector<double> mean_;
};

}  // namespace

std::size_t open_hidden_sulci(ScalarGrid& outer, const ScalarGrid& inner, std::size_t between, float value) {
  const auto [nx, ny, nz] = outer.size;
  const std::size_t layer = nx * ny;
  if (between < 2 || std::ranges::none_of(inner.values, [](float v) { return v < 0.f; })) return 0;
  const Ways ways(inner);
  const Thickness thickness(outer, ways, between);
  if (!thickness.known()) return 0;

  enum : std::uint8_t { no, meet, opened };
  std::vector<std::uint8_t> state(outer.count(), no);
  parallel_for(nz, 1, [&](std::size_t z) {
    if (z % between == 0 || z + 1 >= nz) return;
    for (std::size_t i = z * layer; i < (z + 1) * layer; ++i) {
      if (!(outer.values[i] < 0.f) || inner.values[i] < 0.f) continue;
      if (ways.distance(i) < least_share * thickness.at(i)) continue;
      const Eigen::Vector3d here = ways.place(i), before = ways(i - layer) + ways.place(i - layer) - here,
                            behind = ways(i + layer) + ways.place(i + layer) - here;
      if (before.dot(behind) < most_cosine * before.norm() * behind.norm()) state[i] = meet;
    }
  });
  // From outside inwards.
  std::vector<std::size_t> front;
  const auto open_beside = [&](std::size_t i) {
    const std::size_t x = i % nx, y = i / nx % ny, z = i / layer;
    for (std::size_t c = z - std::min<std::size_t>(z, 1); c < std::min(z + 2, nz); ++c)
      for (std::size_t b = y - std::min<std::size_t>(y, 1); b < std::min(y + 2, ny); ++b)
        for (std::size_t a = x - std::min<std::size_t>(x, 1); a < std::min(x + 2, nx); ++a) {
          const std::size_t j = outer.index(a, b, c);
          if (state[j] == meet) state[j] = opened, front.push_back(j);
        }
  };
  for (std::size_t i = 0; i < outer.count(); ++i)
    if (outer.values[i] >= 0.f) open_beside(i);
  std::size_t count = 0;
  while (!front.empty()) {
    const std::size_t i = front.back();
    front.pop_back();
    outer.values[i] = value, ++count;
    open_beside(i);
  }
  return count;
}

}  // namespace forest::cortex
