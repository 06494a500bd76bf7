// SPDX-License-Identifier: Apache-2.0
// A small forest with everything in it, for tests of scene and render.
#pragma once

#include <algorithm>
#include <vector>

#include "forest/circuit/circuit.h"
#include "forest/core/random.h"
#include "forest/morphology/morphology.h"

namespace forest::testing {

// A random binary tree with meandering branches: enough to need several levels.
inline Morphology random_tree(std::uint64_t seed, int sections = 150) {
  Random random(seed);
  MorphologyBuilder builder;
  builder.set_soma(
      {.kind = SomaKind::sphere, .points = {{10, 20, 30, 8}}, .parents = {}, .contour_starts = {}});
  struct Tip {
    SectionId id;
    Point at;
  };
  std::vector<Tip> tips;
  for (int i = 0; i < 4; ++i) tips.push_back({{}, {10, 28, 30, 2}});
  for (int i = 0; i < sections; ++i) {
    const std::size_t pick = random.below(std::uint32_t(tips.size()));
    const Tip tip = tips[pick];
    tips.erase(tips.begin() + std::ptrdiff_t(pick));
    std::vector<Point> points{tip.at};
    const Vec3 way =
        Vec3(float(random.normal()), float(random.normal()), float(random.normal())).normalized() * 4.f;
    for (int k = int(random.below(12)) + 1; k > 0; --k) {
      const Point& p = points.back();
      points.push_back({p.x + way.x() + float(random.normal()), p.y + way.y() + float(random.normal()),
                        p.z + way.z() + float(random.normal()), std::max(.2f, p.radius * .97f)});
    }
    const SectionId id =
        builder.add_section(tip.id, i % 5 ? SectionKind::basal : SectionKind::apical, points);
    tips.push_back({id, points.back()});
    tips.push_back({id, points.back()});
  }
  return builder.build();
}

/// `count` neurons of three distinct ones in a column of 200 µm radius and two layers.
inline circuit::Circuit sample_circuit(std::size_t count = 40, std::uint64_t seed = 5) {
  circuit::Circuit c;
  c.radius = 200.f;
  c.layers = {{"upper", 300.f, 600.f}, {"lower", 0.f, 300.f}};
  c.types = {{"first", "a", true}, {"second", "b", false}};
  c.morphologies = {"one", "two", "three"};
  Random random(seed);
  for (std::size_t i = 0; i < count; ++i) {
    const float out = 200.f * std::sqrt(float(random.uniform())), turn = float(random.uniform(0, 6.28));
    const float half = float(random.uniform(0, 3.14));
    c.instances.push_back(
        {.position = {out * std::cos(turn), float(random.uniform(1, 599)), out * std::sin(turn)},
         .orientation = Quat(std::cos(half), 0, std::sin(half), 0),
         .morphology = random.below(3),
         .type = random.below(2),
         .layer = 0});
    c.instances.back().layer = c.instances.back().position.y() < 300.f;
  }
  return c;
}

inline std::vector<Morphology> sample_neurons() {
  return {random_tree(1), random_tree(2, 60), random_tree(3, 20)};
}

}  // namespace forest::testing
