// SPDX-License-Identifier: Apache-2.0
#include "forest/geometry/polygonise.h"

#include <array>
#include <map>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "forest/core/error.h"
#include "forest/core/parallel.h"

namespace forest {
namespace {

BranchCone cone(const Vec3& a, const Vec3& b, float ra, float rb, std::uint32_t branch = 0) {
  return {.shape = {a, b, ra, rb}, .branch = branch, .label = 3};
}

TEST(Polygonise, ASphereAndARodHaveTheirVolumeWhereverTheyLie) {
  for (const Vec3& at : {Vec3(0, 0, 0), Vec3(1000, -2000, 500), Vec3(.3f, .1f, .7f)}) {
    const Mesh ball = polygonise({cone(at, at, 5, 5)}, {}, .5f);
    EXPECT_TRUE(is_closed(ball));
    EXPECT_EQ(count_pieces(ball), 1u);
    EXPECT_NEAR(volume(ball) / (4. / 3. * pi * 125.), 1., .01);
    const Mesh rod = polygonise({cone(at, at + Vec3(20, 30, 40), 1, 1)}, {}, .25f);
    EXPECT_TRUE(is_closed(rod));
    EXPECT_EQ(count_pieces(rod), 1u);
    EXPECT_NEAR(volume(rod) / (pi * Vec3(20, 30, 40).norm() + 4. / 3. * pi), 1., .02);
  }
}

TEST(Polygonise, VerticesLieOnTheUnion) {
  const std::vector<BranchCone> cones{cone({0, 0, 0}, {10, 0, 0}, 2, 1),
                                      cone({10, 0, 0}, {15, 5, 3}, 1, .5f)};
  const Mesh mesh = polygonise(cones, {}, .3f);
  EXPECT_TRUE(is_closed(mesh));
  for (const Vec3& p : mesh.positions) {
    float d = 1e9f;
    for (const BranchCone& c : cones) d = std::min(d, signed_distance(p, c.shape));
    EXPECT_NEAR(d, 0.f, .02f);
  }
}

TEST(Polygonise, ThinRodsOfAnyDirectionStayWhole) {
  for (int i = 0; i < 40; ++i) {
    const float t = float(i) * .37f, u = float(i) * 1.91f;
    const Vec3 along(std::cos(t) * std::cos(u), std::sin(t) * std::cos(u), std::sin(u));
    const Mesh mesh = polygonise({cone({0, 0, 0}, 40.f * along, .75f, .75f)}, {}, 1.f);
    EXPECT_TRUE(is_closed(mesh));
    EXPECT_EQ(count_pieces(mesh), 1u) << along.transpose();
  }
}

TEST(Polygonise, AJointIsRoundedAndStaysClosed) {
  const std::vector<BranchCone> cones{cone({0, 0, 0}, {0, 10, 0}, 1, 1, 0),
                                      cone({0, 10, 0}, {6, 16, 0}, 1, .7f, 1),
                                      cone({0, 10, 0}, {-6, 16, 0}, 1, .7f, 2)};
  const Mesh sharp = polygonise(cones, {}, .2f);
  const Mesh round =
      polygonise(cones, {{.centre = {0, 10, 0}, .reach = 3, .rounding = .5f, .branches = {0, 1, 2}}}, .2f);
  EXPECT_TRUE(is_closed(round));
  EXPECT_EQ(count_pieces(round), 1u);
  EXPECT_GT(volume(round), volume(sharp));
  EXPECT_LT(volume(round), 1.1 * volume(sharp));
}

TEST(Polygonise, TheInsideOfAThickConeIsNotLookedAt) {
  const Mesh mesh =
      polygonise({cone({0, 0, 0}, {0, 0, 0}, 10, 10), cone({0, 0, 0}, {0, 5, 0}, 1, 1, 1)}, {}, .25f);
  EXPECT_TRUE(is_closed(mesh));
  EXPECT_EQ(count_pieces(mesh), 1u);
}

TEST(Polygonise, TheBytesAreTheSameAtAnyNumberOfThreads) {
  const auto make = [](unsigned threads) {
    const ThreadLimit limit(threads);
    return polygonise({cone({0, 0, 0}, {30, 20, 10}, 2, .5f)}, {}, .3f);
  };
  const Mesh one = make(1), many = make(0);
  EXPECT_EQ(one.triangles, many.triangles);
  EXPECT_EQ(one.positions, many.positions);
}

TEST(Polygonise, TooFineIsRefusedWithTheFinestThatIsNot) {
  const std::vector<BranchCone> cones{cone({0, 0, 0}, {1000, 0, 0}, 5, 5)};
  try {
    polygonise(cones, {}, .001f);
    FAIL();
  } catch (const LimitError& error) {
    EXPECT_THAT(error.what(), testing::HasSubstr("million triangles"));
  }
  EXPECT_THROW(
      polygonise({cone({0, 0, 0}, {0, 0, 0}, 1, 1), cone({1e9f, 0, 0}, {1e9f, 0, 0}, 1, 1)}, {}, .5f),
      LimitError);
}

TEST(Polygonise, PiecesSideBySideMakeTheWholeSurface) {
  const std::vector<BranchCone> cones{cone({0, 0, 0}, {0, 30, 0}, 4, 3, 0),
                                      cone({0, 30, 0}, {20, 50, 5}, 3, 2, 1),
                                      cone({0, 30, 0}, {-25, 45, -9}, 3, 2.5f, 2)};
  const std::vector<Joint> joints{
      {.centre = {0, 30, 0}, .reach = 9, .rounding = 1.5f, .branches = {0, 1, 2}}};
  for (const float voxel : {1.f, .5f}) {
    const PieceLattice lattice{Vec3(-30, -5, -20) - Vec3::Constant(PieceLattice::margin_voxels), voxel};
    Bounds box;
    for (const BranchCone& c : cones)
      box.add(c.shape.a, c.shape.radius_a + 1), box.add(c.shape.b, c.shape.radius_b + 1);
    const auto [first, last] = lattice.cells(box);
    Mesh all;
    std::map<std::array<float, 3>, std::uint32_t> known;
    std::size_t pieces = 0;
    for (std::int64_t z = first[2]; z <= last[2]; ++z)
      for (std::int64_t y = first[1]; y <= last[1]; ++y)
        for (std::int64_t x = first[0]; x <= last[0]; ++x) {
          const Piece piece = polygonise_piece(cones, joints, lattice, {x, y, z});
          pieces += !piece.mesh.triangles.empty();
          ASSERT_EQ(piece.normals.size(), piece.mesh.positions.size());
          ASSERT_EQ(piece.cones.size(), piece.mesh.positions.size());
          std::vector<std::uint32_t> places;
          for (std::size_t i = 0; i < piece.mesh.positions.size(); ++i) {
            const Vec3& p = piece.mesh.positions[i];
            const Sphere around = lattice.around({x, y, z});
            EXPECT_LT((p - around.centre).norm(), around.radius + 2.f * voxel);
            EXPECT_NEAR(piece.normals[i].norm(), 1.f, 1e-4f);
            EXPECT_LT(signed_distance(p + .5f * piece.normals[i], cones[piece.cones[i]].shape), 1.6f);
            const auto [at, added] =
                known.try_emplace({p.x(), p.y(), p.z()}, std::uint32_t(all.positions.size()));
            if (added) all.positions.push_back(p), all.labels.push_back(0);
            places.push_back(at->second);
          }
          for (const Triangle& t : piece.mesh.triangles)
            all.triangles.push_back({places[t[0]], places[t[1]], places[t[2]]});
        }
    EXPECT_GT(pieces, voxel < 1.f ? 3u : 1u);
    EXPECT_TRUE(is_closed(all));
    EXPECT_EQ(count_pieces(all), 1u);
    EXPECT_NEAR(volume(all) / volume(polygonise(cones, joints, voxel)), 1., .005);
  }
}

}  // namespace
}  // namespace forest
