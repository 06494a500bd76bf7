// SPDX-License-Identifier: Apache-2.0
// A zoo of small neurons, with what is known of each without measuring. For laws that must hold of any neuron: walk
// over zoo(). Each specimen is here because it once broke a program somewhere.
#pragma once

#include <cmath>
#include <numbers>
#include <optional>
#include <string>
#include <vector>

#include "forest/core/random.h"
#include "forest/morphology/morphology.h"

namespace forest {

struct Specimen {
  std::string name;
  Morphology morphology;
  std::size_t sections = 0, tips = 0;
  std::optional<double> length = {};  // µm, where it can be said
};

namespace zoo_parts {

inline Soma sphere(float radius) {
  return {.kind = SomaKind::sphere, .points = {{0, 0, 0, radius}}, .parents = {}, .contour_starts = {}};
}
using Points = std::vector<Point>;

/// Stem, then two daughters at every tip: 2^levels tips, sections of 10 µm that thin.
inline Morphology binary_tree(int levels) {
  MorphologyBuilder b;
  b.set_soma(sphere(8));
  std::vector<SectionId> tips{
      b.add_section({}, SectionKind::basal, Points{{0, 8, 0, 2}, {0, 18, 0, 2}}, 3, 0)};
  std::vector<Vec3> ends{{0, 18, 0}};
  for (int level = 0; level < levels; ++level) {
    std::vector<SectionId> next;
    std::vector<Vec3> next_ends;
    for (std::size_t i = 0; i < tips.size(); ++i)
      for (const float side : {-6.f, 6.f}) {
        const Vec3 end = ends[i] + Vec3(level % 2 ? 0.f : side, 8.f, level % 2 ? side : 0.f);
        const float radius = 2.f / float(level + 2);
        next.push_back(
            b.add_section(tips[i], SectionKind::basal, Points{{end.x(), end.y(), end.z(), radius}}));
        next_ends.push_back(end);
      }
    tips = next, ends = next_ends;
  }
  return b.build();
}

/// A random walk that branches, of arbitrary floats: `sections` sections, each with a random parent.
inline Morphology random_tree(std::uint64_t seed, std::size_t sections) {
  Random random(seed, 0, 77);
  MorphologyBuilder b;
  b.set_soma(sphere(float(random.uniform(3., 12.))));
  std::vector<Point> ends;
  for (std::size_t i = 0; i < sections; ++i) {
    const bool root = i == 0 || random.below(20) == 0;
    const std::uint32_t parent = root ? 0 : random.below(std::uint32_t(i));
    Point at = root ? Point{0, 0, 0, 1} : ends[parent];
    Points points;
    for (std::uint32_t k = 0, count = 1 + random.below(12); k < count; ++k) {
      at.x += float(random.normal(0, 5)), at.y += float(random.normal(0, 5)),
          at.z += float(random.normal(0, 5));
      at.radius = float(random.uniform(.05, 3.));
      points.push_back(at);
    }
    const SectionKind kind = i % 3 ? SectionKind::basal : SectionKind::axon;
    b.add_section(root ? SectionId() : SectionId(parent), kind, points, std::int32_t(kind), root ? 0 : -1);
    ends.push_back(at);
  }
  return b.build();
}

}  // namespace zoo_parts

inline std::vector<Specimen> zoo() {
  using namespace zoo_parts;
  std::vector<Specimen> zoo;
  MorphologyBuilder b;
  const auto add = [&](std::string name, std::size_t sections, std::size_t tips,
                       std::optional<double> length = {}) {
    zoo.push_back({std::move(name), b.build(), sections, tips, length});
  };
  constexpr auto axon = SectionKind::axon, basal = SectionKind::basal, apical = SectionKind::apical;

  add("nothing", 0, 0, 0.);

  b.set_soma(sphere(10));
  add("soma alone", 0, 0, 0.);

  b.set_soma({.kind = SomaKind::cylinders,
              .points = {{0, -5, 0, 4}, {0, 5, 0, 4}},
              .parents = {-1, 0},
              .contour_starts = {}});
  b.add_section({}, apical, Points{{0, 5, 0, 1}, {0, 25, 0, 1}}, 4, 1);
  b.add_section({}, axon, Points{{0, -5, 0, 1}, {3, -9, 0, .5f}}, 2, 0);
  add("soma of a cylinder", 2, 2, 25.);

  b.set_soma({.kind = SomaKind::cylinders,
              .points = {{0, 0, 0, 5}, {0, -5, 0, 5}, {0, 5, 0, 5}},
              .parents = {-1, 0, 0},
              .contour_starts = {}});
  b.add_section({}, basal, Points{{0, 5, 0, 1}, {0, 9, 0, 1}}, 3, 2);
  add("soma of three points", 1, 1, 4.);

  b.set_soma({.kind = SomaKind::cylinders,
              .points = {{0, 0, 0, 5}, {0, 4, 0, 4}, {0, 8, 0, 2}, {4, 4, 0, 2}, {7, 4, 0, 1}},
              .parents = {-1, 0, 1, 1, 3},
              .contour_starts = {}});
  b.add_section({}, apical, Points{{9, 4, 0, 1}, {9, 14, 0, 1}}, 4, 4);
  add("soma that branches", 1, 1, 10.);

  b.set_soma({.kind = SomaKind::contours,
              .points = {{-10, 10, 0, .1f},
                         {10, 10, 0, .1f},
                         {10, -10, 0, .1f},
                         {-10, -10, 0, .1f},
                         {-5, 5, 9, .1f},
                         {5, 5, 9, .1f},
                         {5, -5, 9, .1f}},
              .parents = {},
              .contour_starts = {0, 4}});
  b.add_section({}, basal, Points{{10, 0, 0, 2}, {30, 0, 0, 2}}, 3, 0);
  add("soma of two outlines", 1, 1, 20.);

  b.set_soma(sphere(5));
  b.add_section({}, basal, Points{{0, 5, 0, 1}, {0, 105, 0, 1}}, 3, 0);
  add("ball and stick", 1, 1, 100.);

  b.set_soma(sphere(5));
  {
    const auto stem = b.add_section({}, apical, Points{{0, 5, 0, 2}, {0, 15, 0, 1}}, 4, 0);
    b.add_section(stem, apical, Points{{3, 19, 0, 1}});
    b.add_section(stem, apical, Points{{0, 15, 0, .5f}, {-3, 19, 0, .5f}});
  }
  add("bifurcation with a joint of its own radius", 3, 2, 20.);

  b.set_soma(sphere(5));
  {
    const auto stem = b.add_section({}, basal, Points{{0, 5, 0, 1}}, 3, 0);
    for (int i = 0; i < 5; ++i) b.add_section(stem, basal, Points{{float(i - 2), 5, 10, .5f}});
  }
  add("multifurcation of a stem with one point", 6, 5);

  b.add_section({}, axon, Points{{0, 0, 0, 1}, {0, 3, 4, 1}}, 2, -1);
  b.add_section({}, basal, Points{{500, 0, 0, 1}}, 3, -1);
  b.add_section({}, axon, Points{{0, 0, 700, 1}, {0, 0, 701, 1}}, 2, -1);
  add("three roots and no soma", 3, 3, 6.);

  b.set_soma(sphere(5));
  {
    const auto stem = b.add_section({}, basal, Points{{0, 5, 0, 1}, {0, 15, 0, 1}}, 3, 0);
    b.add_section(stem, axon, Points{{0, 25, 0, .5f}});
    b.add_section({}, basal, Points{{500, 0, 0, 1}, {510, 0, 0, 1}}, 3, -1);
  }
  add("axon out of a dendrite, and a lost piece", 3, 2, 30.);

  b.set_soma(sphere(5));
  {
    SectionId at = b.add_section({}, basal, Points{{0, 5, 0, 1}, {0, 15, 0, 1}}, 3, 0);
    for (int i = 2; i < 6; ++i) at = b.add_section(at, basal, Points{{0, float(10 * i + 5), 0, 1}});
  }
  add("nodes with a single daughter", 5, 1, 50.);

  b.set_soma(sphere(5));
  {
    const auto stem =
        b.add_section({}, basal, Points{{0, 5, 0, 1}, {0, 5, 0, 1}, {0, 5, 0, 3}, {0, 15, 0, 1}}, 3, 0);
    b.add_section(stem, basal, Points{{0, 15, 0, 1}, {0, 15, 0, 1}, {0, 15, 0, 2}, {0, 20, 0, 1}});
    b.add_section(stem, basal, Points{{0, 15, 0, 4}, {0, 15, 0, 1}});
    const auto third = b.add_section(stem, basal, Points{{0, 15, 0, 1}});
    b.add_section(third, basal, Points{{0, 15, 0, 0}, {0, 15, 0, 0}, {5, 15, 0, 0}});
  }
  add("points at one place, radii of zero", 5, 3, 20.);

  b.set_soma(sphere(5));
  for (const std::int32_t tag : {0, 2, 3, 4, 5, 6, 7, 8, 19, 20, 1000000, -5}) {
    const auto kind = tag >= 0 && tag <= 7 ? SectionKind(tag) : SectionKind::custom;
    const auto stem =
        b.add_section({}, kind, Points{{float(tag % 50), 5, 0, 1}, {float(tag % 50), 15, 0, 1}}, tag, 0);
    b.add_section(stem, SectionKind::custom, Points{{float(tag % 50), 25, 0, 1}}, 9);
  }
  add("every kind and custom numbers", 24, 12, 240.);

  b.set_soma(sphere(5));
  {
    const auto stem = b.add_section({}, axon, Points{{1, 5, 0, 1}, {1, 15, 0, 1}}, 2, 0);
    const auto fork = b.add_section(stem, SectionKind::custom, Points{{1, 16, 0, 1}}, 5);
    b.add_section(fork, SectionKind::unspecified, Points{{2, 17, 0, 1}});
    b.add_section(fork, SectionKind::unspecified, Points{{0, 17, 0, 1}});
  }
  add("custom kinds where others mark forks and tips", 4, 2);

  b.set_soma(sphere(1e-20f));
  b.add_section({}, basal,
                Points{{1e30f, -1e30f, 1e-30f, 1e-40f}, {1.17549435e-38f, 16777217.f, 0.1f, 3e37f}}, 3, 0);
  add("numbers at the ends of their range", 1, 1);

  b.set_soma(sphere(5));
  b.add_section({}, apical, Points{{0, 5, 0, 1}, {0, 55, 0, 1}}, 4, 0);
  b.add_spine({SectionId(0), 12.5f, Vec3(1, 0, .25f), .6f, .1f, SpineShape::mushroom});
  b.add_spine({SectionId(0), 31.f, Vec3(-1, 0, 0), .4f, .1f, SpineShape::thin});
  add("spines", 1, 1, 50.);

  b.set_soma({.kind = SomaKind::sphere, .points = {{-0.f, 0, -0.f, 5}}, .parents = {}, .contour_starts = {}});
  b.add_section({}, apical, Points{{-0.f, 5, 0, 1}, {0, 15, -0.f, 1}, {-0.f, 25, -0.f, 1}}, 4, 0);
  b.add_spine({SectionId(0), 5.f, Vec3(-0.f, 1, -0.f), .5f, .1f, SpineShape::thin});
  b.add_spine({SectionId(0), 15.f, Vec3(1, -0.f, 0), .5f, .1f, SpineShape::stubby});
  add("zeros with a sign", 1, 1, 20.);

  b.annotate("CREATURE", "rat");
  b.annotate("comment", "  two\nlines # and a\ttab  ");
  b.annotate("species", "Mus musculus");
  b.annotate("comment", "");
  b.annotate("comment", "start synapse");
  b.annotate("synapse", "1 2 3");
  b.annotate("FOREST_NODE", "2");
  b.annotate("comment", "Brain Forest SWC 1 (INCF v1)");
  b.annotate("naïve µm", "\x01 ünïcode");
  b.set_soma(sphere(5));
  b.add_section({}, basal, Points{{0, 5, 0, 1}, {0, 6, 0, 1}}, 3, 0);
  add("annotations of all sorts", 1, 1, 1.);

  {
    b.set_soma(sphere(5));
    SectionId at = b.add_section({}, axon, Points{{0, 5, 0, 1}, {0, 6, 0, 1}}, 2, 0);
    for (int i = 1; i <= 2000; ++i) {
      b.add_section(at, axon, Points{{1, float(5 + i), 0, .5f}});
      at = b.add_section(at, axon, Points{{0, float(6 + i), 0, .5f}});
    }
  }
  add("caterpillar of order 2000", 4001, 2001);

  zoo.push_back({"binary tree of 32 tips", binary_tree(5), 63, 32, 630.});
  for (std::uint64_t seed = 1; seed <= 3; ++seed) {
    Morphology tree = random_tree(seed, 60);
    std::size_t tips = 0;
    for (std::size_t i = 0; i < 60; ++i) tips += tree.is_terminal(SectionId(i));
    zoo.push_back({"random tree " + std::to_string(seed), std::move(tree), 60, tips, {}});
  }
  return zoo;
}

}  // namespace forest
