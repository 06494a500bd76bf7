// SPDX-License-Identifier: Apache-2.0
#include "forest/scene/gallery.h"

#include <cmath>
#include <set>

#include <fmt/format.h>
#include <gtest/gtest.h>

#include "forest/scene/path.h"

#include "tests/sample_forest.h"

namespace forest::scene {
namespace {

std::vector<Morphology> trees(std::size_t count) {
  std::vector<Morphology> list;
  for (std::size_t i = 0; i < count; ++i) list.push_back(testing::random_tree(i, i % 3 ? 10 : 80));
  return list;
}

std::vector<std::string> names_of(std::size_t count) {
  std::vector<std::string> list;
  for (std::size_t i = 0; i < count; ++i) list.push_back(fmt::format("cell{}", i));
  return list;
}

// The corners of what each neuron takes, about its soma.
Bounds box_of(const Morphology& neuron, const frame::Instance& at) {
  const Bounds box = neuron.bounds();
  const Vec3 soma = neuron.soma().sphere().position(), place(at.x, at.y, at.z);
  Bounds out;
  out.add(Vec3(box.low - soma + place)), out.add(Vec3(box.high - soma + place));
  return out;
}

TEST(Gallery, NeuronsHangSideBySideAndTheViewHoldsAll) {
  for (const std::size_t count : {1u, 2u, 7u, 40u})
    for (const float aspect : {.5f, 1.f, 16.f / 9.f, 4.f}) {
      const std::vector<Morphology> neurons = trees(count);
      const Forest forest = gallery(neurons, names_of(count), aspect);
      ASSERT_TRUE(is_gallery(forest));
      ASSERT_EQ(forest.instances().size(), count);
      std::vector<Bounds> boxes;
      for (std::size_t i = 0; i < count; ++i) boxes.push_back(box_of(neurons[i], forest.instances()[i]));
      for (std::size_t i = 0; i < count; ++i)
        for (std::size_t k = 0; k < i; ++k)
          EXPECT_TRUE(boxes[i].low.x() > boxes[k].high.x() || boxes[i].high.x() < boxes[k].low.x() ||
                      boxes[i].low.y() > boxes[k].high.y() || boxes[i].high.y() < boxes[k].low.y())
              << i << ' ' << k;
      // In the order of reading: to the right, or in a lower row.
      for (std::size_t i = 1; i < count; ++i) {
        const frame::Instance &before = forest.instances()[i - 1], &now = forest.instances()[i];
        EXPECT_TRUE(now.y < before.y || (now.y == before.y && now.x > before.x));
      }
      // All of it in the picture, and much of the picture taken.
      const View view = overview(forest, aspect);
      EXPECT_EQ(view.colour_by, ColourBy::kind);
      const frame::Viewport viewport{1000.f * aspect, 1000.f};
      Bounds seen;
      for (const Bounds& box : boxes)
        for (const Vec3& corner : {box.low, box.high}) {
          const Vec3 at = project(view.camera, viewport, corner);
          EXPECT_GT(at.z(), view.camera.near);
          seen.add(Vec3(at.x() / viewport.width, at.y() / viewport.height, 0.f));
        }
      EXPECT_GT(seen.low.minCoeff(), -1e-3f);
      EXPECT_LT(seen.high.maxCoeff(), 1.f);
      EXPECT_GT(std::max(seen.extent().x(), seen.extent().y()), .8f);
    }
}

TEST(Gallery, AFilmGoesAllAroundAndLosesNothing) {
  const std::vector<Morphology> neurons = trees(3);
  const Forest forest = gallery(neurons, names_of(3), 1.5f);
  const CameraPath path = walk(forest, {}, 1.5f);
  const frame::Viewport viewport{900.f, 600.f};
  EXPECT_LT((path.at(0.f).camera.eye - path.at(1.f).camera.eye).norm(), 1.f);
  EXPECT_GT((path.at(0.f).camera.eye - path.at(.5f).camera.eye).norm(), 100.f);
  float longest = 0.f, way = 0.f;
  for (int step = 0; step <= 100; ++step) {
    const View view = path.at(.01f * float(step));
    if (step) {  // at one speed, but at its ends
      const float moved = (view.camera.eye - path.at(.01f * float(step - 1)).camera.eye).norm();
      longest = std::max(longest, moved), way += moved;
    }
    for (std::size_t i = 0; i < 3; ++i) {
      const Bounds box = box_of(neurons[i], forest.instances()[i]);
      for (int corner = 0; corner < 8; ++corner) {
        const Vec3 at =
            project(view.camera, viewport,
                    {corner & 1 ? box.low.x() : box.high.x(), corner & 2 ? box.low.y() : box.high.y(),
                     corner & 4 ? box.low.z() : box.high.z()});
        EXPECT_GT(at.z(), view.camera.near);
        EXPECT_TRUE(at.x() > 0.f && at.x() < viewport.width && at.y() > 0.f && at.y() < viewport.height)
            << step;
      }
    }
  }
  EXPECT_LT(longest, 1.3f * way / 100.f);
}

TEST(Gallery, ThinBranchesAreSeenWhereThereIsRoomForThem) {
  const std::vector<Morphology> neurons = trees(1);
  const Forest one = gallery(neurons, names_of(1), 1.5f);
  const View view = overview(one, 1.5f);
  EXPECT_EQ(least_width_of(one, view.camera, 900, 600), 1.f);
  EXPECT_NEAR(least_width_of(one, view.camera, 2100, 1400), 2.f, 1e-6f);
  View near = view;
  near.camera.eye = near.camera.target + .001f * (view.camera.eye - view.camera.target);
  EXPECT_EQ(least_width_of(one, near.camera, 900, 600), 0.f);  // nothing but branches
  const Forest many = Forest::from_bytes(pack(testing::sample_circuit(400), testing::sample_neurons()));
  EXPECT_EQ(least_width_of(many, overview(many, 1.5f).camera, 900, 600), 0.f);
}

TEST(Gallery, NamesStandBelowEach) {
  const std::vector<Morphology> neurons = trees(3);
  const Forest forest = gallery(neurons, names_of(3), 1.5f);
  const View view = overview(forest, 1.5f);
  frame::Image image;
  image.width = 900, image.height = 600;
  image.pixels.assign(std::size_t(900) * 600 * 4, 0);
  paint_names(image, forest, view);
  const frame::Viewport viewport{900.f, 600.f};
  for (std::size_t i = 0; i < 3; ++i) {
    const Bounds box = box_of(neurons[i], forest.instances()[i]);
    const Vec3 low = project(view.camera, viewport, box.low), high = project(view.camera, viewport, box.high);
    int below = 0, above = 0;
    for (int y = 0; y < 600; ++y)
      for (int x = std::max(0, int(low.x())); x < std::min(900, int(high.x())); ++x)
        (float(y) > low.y() ? below : above) += image.pixels[std::size_t(4 * (900 * y + x))] > 100;
    EXPECT_GT(below, 50) << i;
    EXPECT_EQ(above, 0) << i;
  }
}

}  // namespace
}  // namespace forest::scene
