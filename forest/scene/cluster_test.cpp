// SPDX-License-Identifier: Apache-2.0
#include "forest/scene/cluster.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <map>
#include <set>

#include <gtest/gtest.h>

#include "forest/core/half.h"
#include "forest/core/random.h"
#include "forest/geometry/polyline.h"
#include "forest/morphology/measure.h"

#include "tests/sample_forest.h"

namespace forest::scene {
namespace {

using testing::random_tree;

Vec3 start(const frame::Segment& s) { return {s.ax, s.ay, s.az}; }
Vec3 finish(const frame::Segment& s) { return {s.bx, s.by, s.bz}; }

// Calls `visit` for random cuts of the tree: lists of clusters that draw every leaf once.
void random_cuts(const ClusterTree& tree, int count,
                 const std::function<void(const std::vector<const Cluster*>&)>& visit) {
  Random random(77);
  for (int i = 0; i < count; ++i) {
    const double deepen = random.uniform();
    std::vector<const Cluster*> cut;
    std::function<void(const Cluster&)> walk = [&](const Cluster& c) {
      if (c.is_leaf() || random.uniform() > deepen) return cut.push_back(&c);
      for (const auto child : c.children) walk(tree.clusters[child]);
    };
    walk(tree.clusters[0]);
    visit(cut);
  }
}

TEST(Cluster, LeavesHoldEverySegmentOnce) {
  const Morphology m = random_tree(1);
  const ClusterTree tree = build_clusters(m);
  std::size_t neurite_segments = 0;
  for (const auto section : tree.section) neurite_segments += section != soma_section;
  EXPECT_EQ(neurite_segments, m.segment_count());
  std::uint32_t covered = 0;
  for (const Cluster& c : tree.clusters) {
    EXPECT_LE(c.segment_count, frame::cluster_size);
    if (c.is_leaf()) {
      EXPECT_EQ(c.error, 0.f);
      EXPECT_EQ(c.segment_count, c.leaf_count);
      EXPECT_EQ(c.first_segment, c.leaf_first);
      covered += c.leaf_count;
    }
  }
  EXPECT_EQ(covered, tree.original_count);
}

// Few branches are drawn as wide as the thinnest line for all: as many as cover the same area, on the mean over orders, and in
// each order others.
TEST(Cluster, WhatWasTracedWithoutDiametersIsDrawn) {
  MorphologyBuilder builder;
  builder.add_section({}, SectionKind::basal, std::vector<Point>{{0, 0, 0, 0}, {5, 1, 0, 0}, {9, 0, 2, 0}});
  const ClusterTree tree = build_clusters(builder.build());
  ASSERT_EQ(tree.segments.size(), tree.section.size());
  EXPECT_GT(tree.clusters[0].radius, 0.f);
  for (const frame::Segment& s : tree.segments) EXPECT_GT(s.radii & 0xffff, 0u);
}

TEST(Cluster, FewBranchesCoverAsMuchAsAllInOrdersOfTheirOwn) {
  std::size_t alike = 0, trees = 400;
  for (const float magnification : {.01f, .03f, .1f, .3f}) {
    double wanted = 0., shown = 0.;
    for (std::uint64_t seed = 0; seed < trees; ++seed) {
      const ClusterTree tree = build_clusters(random_tree(seed));
      std::array<std::vector<bool>, order_count> drawn;
      for (const Cluster& c : tree.clusters) {
        if (!c.is_leaf()) continue;
        for (std::size_t order = 0; order < order_count; ++order) {
          const std::uint32_t visible = c.visible_at(magnification, order);
          for (std::uint32_t i = 0; i < c.segment_count; ++i) {
            const frame::Segment& s = tree.segments[c.first_segment + i];
            const double length = double((finish(s) - start(s)).norm()),
                         width = 2. * FOREST_MEAN_STRETCH * double(from_half(s.meta >> 16) * magnification);
            if (width == 0. || width > 1.) continue;  // the soma's; one that is drawn as it is
            drawn[order].push_back(visible >> i & 1u);
            wanted += width * length, shown += drawn[order].back() ? length : 0.;
          }
        }
      }
      alike += std::ranges::count(drawn, drawn[0]) == order_count;
    }
    EXPECT_NEAR(shown / wanted, 1., .08) << magnification;
  }
  EXPECT_LT(alike, trees / 4);  // of four times as many
}

TEST(Cluster, ErrorsGrowUpwardsAndSpheresEnclose) {
  const ClusterTree tree = build_clusters(random_tree(2));
  ASSERT_GT(tree.clusters.size(), 10u);
  for (const Cluster& c : tree.clusters) {
    const Vec3 centre(c.x, c.y, c.z);
    for (std::uint32_t i = c.first_segment; i < c.first_segment + c.segment_count; ++i) {
      EXPECT_LE((start(tree.segments[i]) - centre).norm(), c.radius * 1.001f);
      EXPECT_LE((finish(tree.segments[i]) - centre).norm(), c.radius * 1.001f);
      const Sphere group = c.group((i - c.first_segment) / Cluster::group_size);
      for (const Vec3& end : {start(tree.segments[i]), finish(tree.segments[i])})
        EXPECT_LE((end - group.centre).norm(), group.radius);
    }
    if (c.is_leaf()) continue;
    for (const auto child : c.children) {
      const Cluster& below = tree.clusters[child];
      EXPECT_GE(c.error, below.error);
      EXPECT_LE((Vec3(below.x, below.y, below.z) - centre).norm() + below.radius, c.radius * 1.001f);
    }
  }
}

TEST(Cluster, NoOriginalPointIsFurtherThanTheStatedError) {
  for (std::uint64_t seed = 3; seed < 8; ++seed) {
    const ClusterTree tree = build_clusters(random_tree(seed));
    for (const Cluster& c : tree.clusters)
      for (std::uint32_t i = c.leaf_first; i < c.leaf_first + c.leaf_count; ++i)
        for (const Vec3& point : {start(tree.segments[i]), finish(tree.segments[i])}) {
          float nearest = 1e9f;
          for (std::uint32_t k = c.first_segment; k < c.first_segment + c.segment_count; ++k)
            nearest = std::min(nearest,
                               distance_to_segment(point, start(tree.segments[k]), finish(tree.segments[k])));
          EXPECT_LE(nearest, c.error + 1e-3f);
        }
  }
}

TEST(Cluster, NoCutComesApart) {
  for (std::uint64_t seed = 8; seed < 12; ++seed) {
    const ClusterTree tree = build_clusters(random_tree(seed));
    random_cuts(tree, 60, [&](const std::vector<const Cluster*>& cut) {
      // Union of equal end points: neurites must form as many pieces as there are stems at most (they begin apart).
      std::map<std::array<float, 3>, int> node;
      std::vector<int> parent;
      const auto find = [&](int i) {
        while (parent[std::size_t(i)] != i) i = parent[std::size_t(i)];
        return i;
      };
      const auto node_of = [&](const Vec3& p) {
        const auto [it, fresh] = node.try_emplace({p.x(), p.y(), p.z()}, int(parent.size()));
        if (fresh) parent.push_back(it->second);
        return it->second;
      };
      for (const Cluster* c : cut)
        for (std::uint32_t i = c->first_segment; i < c->first_segment + c->segment_count; ++i) {
          if ((tree.segments[i].meta & 7) == 1) continue;
          const int a = find(node_of(start(tree.segments[i]))), b = find(node_of(finish(tree.segments[i])));
          parent[std::size_t(a)] = b;
        }
      std::set<int> pieces;
      for (std::size_t i = 0; i < parent.size(); ++i) pieces.insert(find(int(i)));
      EXPECT_EQ(pieces.size(), 1u);  // all stems of random_tree begin at one point
    });
  }
}

TEST(Cluster, BranchZeroIsTheLongestPath) {
  const Morphology m = random_tree(20);
  const auto numbers = branch_numbers(m);
  const auto distances = path_distances(m);
  const auto farthest = std::ranges::max_element(distances) - distances.begin();
  EXPECT_EQ(numbers[std::size_t(farthest)], 0u);
  for (std::size_t i = 0; i < numbers.size(); ++i)
    if (const SectionId parent = m.sections()[i].parent; parent.valid()) {
      EXPECT_GE(numbers[i], numbers[parent.value()]);
    }
}

TEST(Cluster, ManyStemsAndManyRootsStillMakeATree) {
  MorphologyBuilder builder;
  builder.set_soma(
      {.kind = SomaKind::sphere, .points = {{0, 0, 0, 10}}, .parents = {}, .contour_starts = {}});
  for (int i = 0; i < 300; ++i) {
    const float a = float(i);
    builder.add_section({}, SectionKind::basal,
                        std::vector<Point>{{10 * std::cos(a), float(i % 7), 10 * std::sin(a), 1},
                                           {60 * std::cos(a), float(i % 11), 60 * std::sin(a), .5f}});
  }
  const ClusterTree tree = build_clusters(builder.build());
  for (const Cluster& c : tree.clusters) {
    EXPECT_GE(c.segment_count, 1u);
    EXPECT_LE(c.segment_count, frame::cluster_size);
  }
  EXPECT_EQ(tree.clusters[0].leaf_count, tree.original_count);
}

TEST(Cluster, AnEmptyNeuronHasNone) { EXPECT_TRUE(build_clusters(Morphology()).clusters.empty()); }

}  // namespace
}  // namespace forest::scene
