// SPDX-License-Identifier: Apache-2.0
#include "forest/circuit/bend.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <utility>

#include "forest/core/parallel.h"
#include "forest/morphology/transform.h"

namespace forest::circuit {
namespace {

using Place = Eigen::Vector3d;

// A neuron as warp wants it. The first point of a section repeats its parent's last; what follows is joined to that.
struct Tree {
  std::vector<Place> points;
  std::vector<std::int32_t> parents;
  double height = 0.;  // µm above the soma

  explicit Tree(const Morphology& m) {
    for (const Section& s : m.sections()) {
      const std::int32_t above =
          s.parent.valid()
              ? std::int32_t(m.section(s.parent).first_point + m.section(s.parent).point_count) - 1
              : -1;
      for (std::uint32_t i = 0; i < s.point_count; ++i) {
        points.push_back(m.points()[s.first_point + i].position().cast<double>());
        parents.push_back(i > 1 || (i == 1 && above < 0) ? std::int32_t(points.size()) - 2 : above);
        height = std::max(height, points.back().y());
      }
    }
  }
};

struct OfOne {
  cortex::Warped warped;
  double pressed = 0.;  // µm that would have passed the pia
  bool shortened = false;
};

OfOne bend_one(const Tree& tree, const cortex::Seat& seat, const cortex::Sheet& sheet) {
  OfOne result;
  std::vector<Place> straight = tree.points;
  const Place down = sheet.elements[seat.element].jacobian(seat.uvw).col(2);
  if (const double room = seat.uvw[2] * down.norm(); tree.height > room) {
    const double share = std::max(.5, room / tree.height);
    result.shortened = true;
    for (Place& p : straight)
      if (p.y() > 0.) p.y() *= share;
  }
  result.warped = cortex::warp(sheet, seat, straight, tree.parents, {.traced = tree.points});
  if (result.warped.distortion.beyond_pia > 0.) {
    result.pressed = result.warped.distortion.beyond_pia;
    result.warped =
        cortex::warp(sheet, seat, straight, tree.parents, {.below_pia = true, .traced = tree.points});
  }
  return result;
}

Spread spread(std::vector<double> values) {
  if (values.empty()) return {};
  std::ranges::sort(values);
  const auto at = [&](double share) {
    return values[std::size_t(std::lround(share * double(values.size() - 1)))];
  };
  return {at(0.), at(.01), at(.5), at(.99), at(1.)};
}

Bending sum_of(std::span<const OfOne> all) {
  Bending b;
  double after = 0.;
  std::vector<double> ratios, turns;
  for (const OfOne& one : all) {
    const cortex::Distortion& d = one.warped.distortion;
    b.length += d.straight_length, after += d.length;
    b.beyond_pia += d.beyond_pia, b.pressed += one.pressed, b.beyond_white += d.beyond_white,
        b.beside += d.beside;
    b.shortened += one.shortened;
    if (d.straight_length > 0.) ratios.push_back(d.length / d.straight_length), turns.push_back(d.mean_turn);
  }
  if (after > 0.)
    b.length_ratio = after / b.length, b.beyond_pia /= after, b.beyond_white /= after, b.beside /= after,
    b.pressed /= after;
  b.ratio = spread(std::move(ratios)), b.turn = spread(std::move(turns));
  return b;
}

}  // namespace

Bent bend(const Circuit& circuit, std::span<const Morphology> morphologies,
          std::span<const cortex::Seat> seats, const cortex::Sheet& sheet, Progress& progress) {
  std::vector<Tree> trees;
  for (const Morphology& m : morphologies) trees.emplace_back(m);
  const std::size_t count = circuit.instances.size();
  Bent result{.neurons = std::vector<Morphology>(count), .bending = {}};
  std::vector<OfOne> all(count);
  progress.begin("bending", count);
  parallel_for(count, 16, [&](std::size_t i) {
    const Instance& instance = circuit.instances[i];
    const cortex::Seat& seat = seats[i];
    all[i] = bend_one(trees[instance.morphology], seat, sheet);
    const Place soma = sheet.elements[seat.element].at(seat.uvw);
    std::vector<Vec3> points;
    points.reserve(all[i].warped.points.size());
    for (const Place& p : all[i].warped.points) points.push_back((p - soma).cast<float>());
    all[i].warped.points = {};  // of thousands of neurons they are large
    result.neurons[i] = reshaped(morphologies[instance.morphology], points, instance.orientation);
    progress.advance();
  });
  progress.end();
  result.bending = sum_of(all);
  return result;
}

}  // namespace forest::circuit
