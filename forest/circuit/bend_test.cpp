// SPDX-License-Identifier: Apache-2.0
#include "forest/circuit/bend.h"

#include <gtest/gtest.h>

#include "forest/cortex/curved_elements.h"

#include "tests/zoo.h"

namespace forest::circuit {
namespace {

using Place = Eigen::Vector3d;

// A block of tissue, 1 mm wide and 2 mm tall: the pia at y = 1 mm, u along x.
std::vector<cortex::Hexahedron> block() {
  std::array<Place, 8> corners;
  for (int c = 0; c < 8; ++c)
    corners[std::size_t(c)] = {c & 1 ? 500. : -500., c & 4 ? -1000. : 1000., c & 2 ? 500. : -500.};
  return {cortex::from_corners(corners)};
}

struct Planted {
  Circuit circuit;
  std::vector<Morphology> morphologies;
  std::vector<cortex::Seat> seats;
};

// A cell of each specimen that has its soma near the origin and stays within so many µm, half way down.
Planted of_zoo(float within) {
  Planted planted;
  for (const Specimen& s : zoo()) {
    bool small = !s.morphology.points().empty();
    for (const Point& p : s.morphology.points()) small = small && p.position().norm() < within;
    if (!small) continue;
    Instance instance;
    instance.morphology = std::uint32_t(planted.morphologies.size());
    planted.circuit.instances.push_back(instance);
    planted.morphologies.push_back(s.morphology);
    planted.seats.push_back({.element = 0});
  }
  return planted;
}

TEST(Bend, LeavesNeuronsInStraightTissueAsTheyAre) {
  const auto elements = block();
  const Planted p = of_zoo(400.f);
  ASSERT_GT(p.morphologies.size(), 3u);
  const Bent bent = bend(p.circuit, p.morphologies, p.seats, {elements}, Progress::none());
  ASSERT_EQ(bent.neurons.size(), p.morphologies.size());
  for (std::size_t i = 0; i < bent.neurons.size(); ++i) {
    const auto before = p.morphologies[i].points(), after = bent.neurons[i].points();
    ASSERT_EQ(before.size(), after.size());
    for (std::size_t k = 0; k < before.size(); ++k) {
      EXPECT_LT((before[k].position() - after[k].position()).norm(), 1e-3f);
      EXPECT_EQ(before[k].radius, after[k].radius);
    }
  }
  EXPECT_NEAR(bent.bending.length_ratio, 1., 1e-6);
  EXPECT_EQ(bent.bending.shortened, 0u);
  EXPECT_EQ(bent.bending.beyond_pia + bent.bending.pressed + bent.bending.beyond_white, 0.);
}

TEST(Bend, WhatIsTallerThanTheTissueAboveItEndsAtThePia) {
  const auto elements = block();
  Planted p = of_zoo(400.f);
  std::size_t tall = 0;
  for (std::size_t i = 0; i < p.seats.size(); ++i) {
    float height = 0.f;
    for (const Point& at : p.morphologies[i].points()) height = std::max(height, at.y);
    p.seats[i].uvw[2] = .005;  // 10 µm below the pia
    tall += height > 10.f;
  }
  ASSERT_GT(tall, 0u);
  const Bent bent = bend(p.circuit, p.morphologies, p.seats, {elements}, Progress::none());
  EXPECT_EQ(bent.bending.shortened, tall);
  EXPECT_LT(bent.bending.length_ratio, 1.);
  // Told against the neurons as they were: what is pressed together changes its angles, too.
  EXPECT_GT(bent.bending.turn.most, 5.);
  EXPECT_EQ(bent.bending.beyond_pia, 0.);
  for (const Morphology& m : bent.neurons)
    for (const Point& at : m.points()) EXPECT_LT(at.y, 10.01f);
}

}  // namespace
}  // namespace forest::circuit
