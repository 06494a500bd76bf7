// SPDX-License-Identifier: Apache-2.0
#include "forest/cortex/environment.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <string>

#include "forest/core/error.h"
#include "forest/core/hash.h"

namespace forest::cortex {
namespace {

using Place = Environment::Place;

// "L2/3" is 2, "L5B" is 5; 0 when there is no number.
int number_in(const std::string& name) {
  int number = 0;
  bool found = false;
  for (const char c : name) {
    const bool digit = c >= '0' && c <= '9';
    if (found && !digit) break;
    if (digit && number < 1000) number = 10 * number + (c - '0');
    found |= digit;
  }
  return number;
}

bool within(float number) { return std::abs(number) <= float(Environment::far_away); }  // not of NaN
std::string hash_of(std::span<const Slab> layers, std::span<const Sphere> somata,
                    std::span<const Attractor> attractors) {
  std::vector<float> numbers;
  std::string names;
  const auto add = [&](const Vec3& at) { numbers.insert(numbers.end(), at.data(), at.data() + 3); };
  for (const Slab& l : layers) names += l.name + '\n', numbers.insert(numbers.end(), {l.bottom, l.top});
  for (const Sphere& s : somata) add(s.centre), numbers.push_back(s.radius);
  for (const Attractor& a : attractors) add(a.at), numbers.insert(numbers.end(), {a.strength, a.reach});
  names += std::to_string(layers.size()) + ' ' + std::to_string(somata.size()) + '\n';
  names.append(reinterpret_cast<const char*>(numbers.data()), numbers.size() * sizeof(float));
  return hash_hex(std::as_bytes(std::span(names)));
}

bool within(const Vec3& place) { return within(place.x()) && within(place.y()) && within(place.z()); }

}  // namespace

Environment::Environment() : hash_(hash_of({}, {}, {})), first_(2, 0) {}

Environment::Environment(std::vector<Slab> layers, std::vector<Sphere> somata,
                         std::vector<Attractor> attractors)
    : layers_(std::move(layers)), somata_(std::move(somata)), attractors_(std::move(attractors)) {
  for (std::size_t i = 0; i < layers_.size(); ++i) {
    const Slab& slab = layers_[i];
    if (!(slab.bottom < slab.top && within(slab.bottom) && within(slab.top)))
      throw Error("the limits of layer " + slab.name + " must be numbers of µm, the upper one the higher");
    const int number = number_in(slab.name);
    numbers_.push_back(number ? number : int(i) + 1);
  }
  Bounds bounds;
  for (std::size_t i = 0; i < somata_.size(); ++i) {
    const Sphere& s = somata_[i];
    if (!within(s.centre) || !(s.radius >= 0.f && within(s.radius)))
      throw Error("soma " + std::to_string(i + 1) + " needs a place and a radius that are numbers of µm");
    bounds.add(s.centre);
    widest_ = std::max(widest_, double(s.radius));
  }
  for (std::size_t i = 0; i < attractors_.size(); ++i) {
    const Attractor& a = attractors_[i];
    if (!within(a.at) || !within(a.strength) || !(a.reach > 0.f && within(a.reach)))
      throw Error("attractor " + std::to_string(i + 1) +
                  " needs a place, a strength and a reach above 0 that are finite numbers");
  }
  hash_ = hash_of(layers_, somata_, attractors_);
  first_.assign(2, 0);
  if (somata_.empty()) return;

  // About one soma a cell.
  low_ = bounds.low.cast<double>();
  const Place extent = bounds.extent().cast<double>();
  const double count = double(somata_.size());
  cell_ = std::cbrt(extent.cwiseMax(1.).prod() / count);
  const auto cells = [&] { return Place((extent / cell_).array().floor().matrix() + Place::Ones()); };
  while (cells().prod() > 8. * count + 64.) cell_ *= 1.5;  // where they lie in a plane or on a line
  size_ = cells().cast<int>();
  std::vector<std::uint32_t> at(somata_.size());
  first_.assign(std::size_t(size_.cast<double>().prod()) + 1, 0);
  for (std::size_t i = 0; i < somata_.size(); ++i) {
    const Cells own = cells_around(somata_[i].centre.cast<double>(), 0.);
    at[i] = std::uint32_t(row(own.low[1], own.low[2])) + std::uint32_t(own.low[0]);
    ++first_[at[i] + 1];
  }
  std::partial_sum(first_.begin(), first_.end(), first_.begin());
  order_.resize(somata_.size());
  std::vector<std::uint32_t> next(first_.begin(), first_.end() - 1);
  for (std::uint32_t i = 0; i < somata_.size(); ++i) order_[next[at[i]]++] = i;
}

Environment::Cells Environment::cells_around(const Place& place, double reach) const {
  Cells cells;
  if (somata_.empty()) return cells;
  for (int axis = 0; axis < 3; ++axis) {
    const auto cell = [&](double x) {
      return int(std::clamp(std::floor((x - low_[axis]) / cell_), 0., double(size_[axis] - 1)));
    };
    cells.low[axis] = cell(place[axis] - reach), cells.high[axis] = cell(place[axis] + reach);
  }
  return cells;
}

std::optional<double> Environment::pia() const {
  if (layers_.empty()) return {};
  return double(layers_.front().top);
}

double Environment::depth(const Place& place) const {
  return layers_.empty() ? far_away : *pia() - place.y();
}

Environment::Stratum Environment::stratum(const Place& place) const {
  for (std::size_t i = 0; i < layers_.size(); ++i)
    if (place.y() <= double(layers_[i].top) && place.y() >= double(layers_[i].bottom))
      return {numbers_[i], double(layers_[i].top) - place.y(), place.y() - double(layers_[i].bottom)};
  return {};
}

Environment::Nearest Environment::nearest_soma(const Place& place, const Place& own) const {
  Nearest nearest;
  const auto way_to = [&](std::uint32_t i) -> Place { return somata_[i].centre.cast<double>() - place; };
  const auto look = [&](std::uint32_t i) {
    const Sphere& soma = somata_[i];
    const double distance = way_to(i).norm() - double(soma.radius);
    // Of two as near the first, so that the grid does not matter.
    if (distance > nearest.distance || (distance == nearest.distance && nearest.soma && i > *nearest.soma) ||
        encloses(soma, own))
      return;
    nearest.distance = distance, nearest.soma = i;
  };
  if (somata_.empty()) return nearest;
  // Shells of cells from the one at the place outwards. Within the k-th all are at least k - 1 cells away.
  const Eigen::Vector3i middle = cells_around(place, 0.).low;
  const int last = size_.maxCoeff();
  for (int k = 0; k < last; ++k) {
    if (double(k - 1) * cell_ - widest_ > nearest.distance) break;
    const Eigen::Vector3i low = (middle.array() - k).matrix(), high = (middle.array() + k).matrix();
    for (int z = std::max(low[2], 0); z <= std::min(high[2], size_[2] - 1); ++z)
      for (int y = std::max(low[1], 0); y <= std::min(high[1], size_[1] - 1); ++y) {
        const std::size_t cell = row(y, z);
        const auto look_along = [&](int from, int to) {
          for (std::uint32_t i = first_[cell + std::size_t(std::max(from, 0))],
                             end = first_[cell + std::size_t(std::min(to, size_[0] - 1)) + 1];
               i < end; ++i)
            look(order_[i]);
        };
        if (z == low[2] || z == high[2] || y == low[1] || y == high[1]) {
          look_along(low[0], high[0]);
        } else {
          if (low[0] >= 0) look_along(low[0], low[0]);
          if (high[0] < size_[0]) look_along(high[0], high[0]);
        }
      }
  }
  if (nearest.soma) nearest.direction = way_to(*nearest.soma).stableNormalized();
  return nearest;
}

Environment::Field Environment::field(const Place& place) const {
  Field field;
  Place slope = Place::Zero();
  for (const Attractor& a : attractors_) {
    const Place way = a.at.cast<double>() - place;
    const double distance = way.norm(), reach = double(a.reach),
                 density = double(a.strength) * std::exp(-distance / reach);
    field.density += density;
    if (distance > 0.) slope += (density / (reach * distance)) * way;
  }
  field.direction = slope.stableNormalized();
  return field;
}

}  // namespace forest::cortex
