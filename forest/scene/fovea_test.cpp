// SPDX-License-Identifier: Apache-2.0
#include "forest/scene/fovea.h"

#include <bit>
#include <set>

#include <gtest/gtest.h>

#include "forest/core/random.h"
#include "forest/scene/path.h"

#include "tests/sample_forest.h"

namespace forest::scene {
namespace {

constexpr std::uint32_t width = 1920, height = 1080;

View view_with_gaze(const Vec2& gaze) {
  View view;
  view.camera = {.eye = {0, 0, 500}, .target = {0, 0, 0}};
  view.detail.gaze = gaze;
  view.samples = 1;
  return view;
}

// Guenter et al. 2012: w = m e + w0 with w0 = 1/48°; a screen 40° high with 1080 pixels has .0386° a pixel in its middle.
TEST(Gaze, ResolvesWhatThePaperSays) {
  const View view = view_with_gaze({.5f, .5f});
  const Gaze gaze(view.camera, {width, height}, detail_for(view, width, height));
  EXPECT_NEAR(gaze.angle(1.f), .03862f, 1e-4f);
  EXPECT_NEAR(gaze.eccentricity({960, 0}), 20.f, 1e-3f);  // half the field of view
  EXPECT_NEAR(gaze.eccentricity({960, 540}), 0.f, 1e-3f);
  for (const float e : {0.f, 5.f, 20.f})
    EXPECT_NEAR(gaze.resolved(e, view.detail), (1.5f / 60.f * e + 1.f / 48.f) / .03862f, 2e-3f * (1.f + e));
  EXPECT_NEAR(gaze.resolved(gaze.where_resolved(4.f, view.detail), view.detail), 4.f, 1e-3f);
  Detail blind = view.detail;
  blind.acuity_slope = 0.f;
  EXPECT_TRUE(std::isinf(gaze.where_resolved(2.f, blind)));
  // A screen that takes half as much of the sight is seen by half as large angles.
  View small = view;
  small.detail.screen = 20.f;
  EXPECT_NEAR(Gaze(small.camera, {width, height}, detail_for(small, width, height)).eccentricity({960, 0}),
              10.f, 1e-3f);
}

TEST(Layers, AreOneWithoutAGazeAndHalvedFromWhereNothingSmallerIsResolved) {
  View view = view_with_gaze({.5f, .5f});
  const auto layers = layers_of(view, width, height);
  ASSERT_EQ(layers.size(), 4u);
  const Gaze gaze(view.camera, {width, height}, detail_for(view, width, height));
  float scale = 1.f;
  for (std::size_t i = 0; i < layers.size(); ++i, scale *= 2.f) {
    EXPECT_NEAR(layers[i].scale, scale, .01f * scale);
    EXPECT_GE(float(layers[i].width) * layers[i].scale, float(width));
    if (i + 1 == layers.size()) {
      EXPECT_TRUE(std::isinf(layers[i].until));
      EXPECT_EQ(layers[i].area, (frame::Area{0, 0, layers[i].width, layers[i].height}));
    } else {
      EXPECT_GE(layers[i].until, view.detail.fovea);
      EXPECT_GE(gaze.resolved(layers[i].until, view.detail), 2.f * scale - .01f);
      EXPECT_LT(layers[i].until, layers[i + 1].until);
      EXPECT_GT(layers[i].gone, layers[i].until);
    }
  }
  view.detail.gaze.reset();
  EXPECT_EQ(layers_of(view, width, height).size(), 1u);
}

TEST(Layers, HoldAllPixelsThatAreShownOfThemWhereverTheGazeIs) {
  Random random(8);
  for (int i = 0; i < 60; ++i) {
    View view = view_with_gaze({float(random.uniform(-.5, 1.5)), float(random.uniform(-.5, 1.5))});
    view.detail.pixel = std::array{1.f, 1.4f, 2.f, 3.f}[random.below(4)];
    const std::uint32_t w = 200 + random.below(1900), h = 150 + random.below(1000);
    const Gaze gaze(view.camera, {float(w), float(h)}, detail_for(view, w, h));
    const auto layers = layers_of(view, w, h);
    for (const Layer& layer : layers) {
      ASSERT_LT(layer.area.left, layer.area.right);
      ASSERT_LT(layer.area.top, layer.area.bottom);
      ASSERT_LE(layer.area.right, layer.width);
      ASSERT_LE(layer.area.bottom, layer.height);
      const float inner = &layer == layers.data() ? 0.f : (&layer - 1)->until;
      for (int k = 0; k < 300; ++k) {
        const Vec2 pixel(float(random.uniform(0., double(w))), float(random.uniform(0., double(h))));
        const float eccentricity = gaze.eccentricity(pixel);
        if (eccentricity > layer.gone) continue;
        const float x = (pixel.x() - .5f * float(w)) / layer.scale + .5f * float(layer.width),
                    y = (pixel.y() - .5f * float(h)) / layer.scale + .5f * float(layer.height);
        EXPECT_GE(x + .01f, float(layer.area.left));
        EXPECT_LE(x - .01f, float(layer.area.right));
        EXPECT_GE(y + .01f, float(layer.area.top));
        EXPECT_LE(y - .01f, float(layer.area.bottom));
        if (eccentricity < inner || layers.size() == 1) continue;
        // It and its neighbours, whose rims are two pixels wide, lie in squares that are wanted.
        const std::uint32_t wide = (layer.width + FOREST_TILE - 1) / FOREST_TILE;
        ASSERT_EQ(layer.unwanted.size(), wide * ((layer.height + FOREST_TILE - 1) / FOREST_TILE));
        for (const float beside : {-3.f, 3.f})
          for (const float above : {-3.f, 3.f}) {
            const float sx = std::clamp(x + beside, float(layer.area.left), float(layer.area.right) - 1.f),
                        sy = std::clamp(y + above, float(layer.area.top), float(layer.area.bottom) - 1.f);
            EXPECT_EQ(
                layer.unwanted[std::uint32_t(sy) / FOREST_TILE * wide + std::uint32_t(sx) / FOREST_TILE], 0)
                << eccentricity << " of " << inner << " to " << layer.gone;
          }
      }
    }
  }
}

TEST(Layers, WantNothingOfWhatOthersShow) {
  const View view = view_with_gaze({.5f, .5f});
  for (const Layer& layer : layers_of(view, width, height)) {
    std::size_t unwanted = 0, all = 0;
    const std::uint32_t wide = (layer.width + FOREST_TILE - 1) / FOREST_TILE;
    for (std::uint32_t y = layer.area.top; y < layer.area.bottom; y += FOREST_TILE)
      for (std::uint32_t x = layer.area.left; x < layer.area.right; x += FOREST_TILE, ++all)
        unwanted += layer.unwanted[y / FOREST_TILE * wide + x / FOREST_TILE];
    // Of a disc's square, its corners; of a disc in a disc, that too.
    EXPECT_GT(unwanted, all / 20) << layer.scale;
    EXPECT_LT(unwanted, all / 2) << layer.scale;
  }
}

TEST(Layers, HaveNoSmallerPixelsThanTheView) {
  View view = view_with_gaze({.5f, .5f});
  for (const float pixel : {1.f, 1.4f, 2.f, 3.f, 16.f}) {
    view.detail.pixel = pixel;
    const auto gazed = layers_of(view, width, height);
    View without = view;
    without.detail.gaze.reset();
    EXPECT_TRUE(layered(view));
    EXPECT_EQ(layered(without), pixel > 1.f);
    const auto alone = layers_of(without, width, height);
    ASSERT_EQ(alone.size(), 1u);
    EXPECT_EQ(alone[0].area, (frame::Area{0, 0, alone[0].width, alone[0].height}));
    for (const auto& layers : {gazed, alone}) {
      EXPECT_EQ(layers[0].height, std::uint32_t(std::ceil(height / pixel)));
      EXPECT_NEAR(layers[0].scale, pixel, .02f * pixel);
      for (std::size_t i = 1; i < layers.size(); ++i) EXPECT_GT(layers[i].scale, 1.1f * layers[i - 1].scale);
    }
    // One layer is the view at another size: with as many samples, and lines as thin in its pixels.
    EXPECT_EQ(view_for(without, alone[0]).samples, without.samples);
    EXPECT_EQ(thinnest_of(view_for(without, alone[0])), thinnest_of(without));
    EXPECT_EQ(detail_for(without, alone[0], width, height).error, without.detail.error);
  }
}

class UnitedLayers : public ::testing::TestWithParam<float> {};
INSTANTIATE_TEST_SUITE_P(OfPixels, UnitedLayers, ::testing::Values(1.f, 1.4f, 2.f));

TEST_P(UnitedLayers, AreTheFinestInTheFoveaAndShowTheSameElsewhere) {
  View view = view_with_gaze({.4f, .6f});
  view.detail.pixel = GetParam();
  const auto layers = layers_of(view, width, height);
  // A picture that rises evenly to the right and down, drawn by every layer.
  std::vector<frame::Image> pictures;
  for (const Layer& layer : layers) {
    frame::Image image{layer.width, layer.height, {}};
    for (std::uint32_t y = 0; y < layer.height; ++y)
      for (std::uint32_t x = 0; x < layer.width; ++x) {
        const float px = (float(x) + .5f - .5f * float(layer.width)) * layer.scale + .5f * float(width),
                    py = (float(y) + .5f - .5f * float(layer.height)) * layer.scale + .5f * float(height);
        image.pixels.insert(image.pixels.end(), {std::uint8_t(std::clamp(px / 8.f, 0.f, 255.f)),
                                                 std::uint8_t(std::clamp(py / 8.f, 0.f, 255.f)),
                                                 std::uint8_t(40 * pictures.size()), 255});
      }
    pictures.push_back(std::move(image));
  }
  std::vector<const frame::Image*> drawn;
  for (const frame::Image& image : pictures) drawn.push_back(&image);
  frame::Image whole;
  unite(view, layers, drawn, width, height, whole);
  ASSERT_EQ(whole.pixels.size(), std::size_t(width) * height * 4);
  EXPECT_NEAR(whole.covered, 1., .01);
  const Gaze gaze(view.camera, {width, height}, detail_for(view, width, height));
  for (std::uint32_t y = 0; y < height; y += 7)
    for (std::uint32_t x = 0; x < width; x += 5) {
      const std::uint8_t* pixel = &whole.pixels[4 * (std::size_t(y) * width + x)];
      ASSERT_NEAR(pixel[0], (float(x) + .5f) / 8.f, 1.6f) << x << " " << y;
      ASSERT_NEAR(pixel[1], (float(y) + .5f) / 8.f, 1.6f) << x << " " << y;
      const float e = gaze.eccentricity({float(x) + .5f, float(y) + .5f});
      for (std::size_t i = 0; i < layers.size(); ++i)
        if (e <= layers[i].until && (i == 0 || e >= layers[i - 1].gone)) {
          EXPECT_EQ(pixel[2], 40 * i) << x << " " << y;
        }
      if (e <= layers[0].until && GetParam() == 1.f) {
        EXPECT_EQ(pixel[0], pictures[0].pixels[4 * (std::size_t(y) * width + x)]);
      }
    }
}

TEST(Layers, WithLargerPixelsHaveWeakerRimsAndMoreThanOneSample) {
  View view = view_with_gaze({.5f, .5f});
  view.halo = .8f, view.least_width = 1.2f;
  for (const std::uint32_t samples : {1u, 16u}) {
    view.samples = samples;
    for (const Layer& layer : layers_of(view, width, height)) {
      const View shown = view_for(view, layer);
      EXPECT_NEAR(shown.halo * layer.scale, .8f, 1e-5f);
      EXPECT_NEAR(*shown.least_width * layer.scale, 1.2f, 1e-5f);
      EXPECT_EQ(shown.samples, samples > 1 ? samples : layer.scale > 1.f ? 4u : 1u);
      // As many branches, however many samples; in coarse layers fewer, and none so thin that it falls between the samples.
      if (layer.scale > 1.f)
        EXPECT_GE(thinnest_of(shown), std::max(1.5f * thinnest_of(view), .25f));
      else
        EXPECT_EQ(thinnest_of(shown), thinnest_of(view));
      EXPECT_EQ(shown.camera, view.camera);
    }
  }
}

TEST(Layers, InTheFoveaTheSameClustersAreChosen) {
  const Forest forest = Forest::from_bytes(pack(testing::sample_circuit(), testing::sample_neurons()));
  View view = overview(forest);
  view.detail.gaze = Vec2(.5f, .5f);
  view.samples = 1;
  View without = view;
  without.detail.gaze.reset();
  const frame::Viewport viewport{width, height};
  const auto layers = layers_of(view, width, height);
  const Eye gazing(view.camera, viewport, detail_for(view, layers[0], width, height)),
      seeing(view.camera, viewport, detail_for(without, width, height));
  const Cut fine = choose(forest, gazing), all = choose(forest, seeing);
  EXPECT_LT(fine.segments, all.segments);
  const Gaze gaze(view.camera, viewport, detail_for(view, width, height));
  std::size_t looked_at = 0;
  const auto straws_looked_at = [&](const Cut& cut) {
    std::set<std::uint32_t> straws;
    for (const frame::Item& item : cut.lines)
      for (std::uint32_t rest = item.instance == FOREST_IN_WORLD ? item.drawn : 0; rest; rest &= rest - 1) {
        const std::uint32_t number = item.first_segment + std::uint32_t(std::countr_zero(rest));
        const frame::Segment& s = forest.segments()[number];
        const Vec3 at =
            frame::project(view.camera, viewport, .5f * (Vec3(s.ax, s.ay, s.az) + Vec3(s.bx, s.by, s.bz)));
        if (gaze.eccentricity(at.head<2>()) <= view.detail.fovea) straws.insert(number);
      }
    return straws;
  };
  EXPECT_EQ(straws_looked_at(fine), straws_looked_at(all));
  for (const frame::Item& item : all.lines) {
    if (item.instance == FOREST_IN_WORLD) continue;
    const Vec3 at = frame::project(view.camera, viewport, {item.x, item.y, item.z});
    if (gaze.eccentricity(at.head<2>()) > view.detail.fovea) continue;
    ++looked_at;
    EXPECT_TRUE(std::ranges::any_of(fine.lines, [&](const frame::Item& other) {
      return other.instance == item.instance && other.first_segment == item.first_segment &&
             other.drawn == item.drawn;
    }));
  }
  EXPECT_GT(looked_at + straws_looked_at(all).size(), 5u);
}

TEST(Layers, ChosenTogetherAreWhatEachChoosesAlone) {
  const Forest forest = Forest::from_bytes(pack(testing::sample_circuit(200), testing::sample_neurons()));
  const CameraPath path = walk(forest);
  for (const float t : {0.f, .5f, .9f}) {
    SCOPED_TRACE(t);
    View view = path.at(t);
    view.detail.gaze = Vec2(.4f, .6f);
    view.samples = 1;
    std::vector<Eye> eyes;
    std::vector<Sight> sights;
    for (const Layer& layer : layers_of(view, width, height))
      eyes.emplace_back(view.camera, frame::Viewport{float(layer.width), float(layer.height)},
                        detail_for(view, layer, width, height));
    ASSERT_GT(eyes.size(), 2u);
    for (const Eye& eye : eyes) sights.push_back({eye});
    const std::vector<Cut> together = choose(forest, sights);
    ASSERT_EQ(together.size(), eyes.size());
    for (std::size_t i = 0; i < eyes.size(); ++i) {
      const Cut alone = choose(forest, eyes[i]);
      const auto same = [](const std::vector<frame::Item>& a, const std::vector<frame::Item>& b) {
        return std::ranges::equal(a, b, [](const frame::Item& x, const frame::Item& y) {
          return x.instance == y.instance && x.first_segment == y.first_segment && x.drawn == y.drawn;
        });
      };
      EXPECT_TRUE(same(together[i].dots, alone.dots));
      EXPECT_TRUE(same(together[i].lines, alone.lines));
      EXPECT_TRUE(same(together[i].capsules, alone.capsules));
      EXPECT_EQ(together[i].segments, alone.segments);
      EXPECT_EQ(together[i].far, alone.far);
      EXPECT_EQ(together[i].bands.size(), alone.bands.size());
    }
  }
}

bool may_see(const Eye& eye, const Sphere& sphere) {
  SeenTogether seen;
  eye.viewer()(Spheres(sphere), seen);
  return eye.may_see(seen) & 1u;
}

TEST(Viewer, SpheresSeenTogetherAreSeenAsEachAlone) {
  Random random(11);
  const auto any = [&](double most) {
    return Vec3(float(random.uniform(-most, most)), float(random.uniform(-most, most)),
                float(random.uniform(-most, most)));
  };
  for (int round = 0; round < 100; ++round) {
    frame::Camera camera{.eye = any(50.), .target = any(50.)};
    if (round % 2) camera.projection = frame::Projection::orthographic;
    const Viewer viewer(camera);
    const Spheres spheres(Spheres::most, [&](std::size_t) {
      return Sphere{any(100.), float(random.uniform(.1, 20.))};
    });
    SeenTogether together;
    viewer(spheres, together);
    for (std::size_t i = 0; i < Spheres::most; ++i) {
      const Seen alone = viewer(spheres[i]), one = together[i];
      EXPECT_EQ(one.known, alone.known);
      EXPECT_NEAR((one.at - alone.at).norm(), 0.f, 1e-4f * (1.f + alone.at.norm()));
      EXPECT_NEAR(one.nearest, alone.nearest, 1e-3f);
      const Glimpse glimpse = together.glimpse(i);
      if (!alone.known) {
        EXPECT_TRUE(std::isinf(glimpse.reach));  // nothing hides it
        continue;
      }
      EXPECT_NEAR((Vec2(glimpse.x, glimpse.y) - alone.place).norm(), 0.f, 1e-3f * (1.f + alone.place.norm()));
      EXPECT_NEAR(glimpse.reach, alone.reach, 1e-3f * (1.f + alone.reach));
    }
  }
}

// What an eye sees of a sphere: all of it within its reach, and nothing that the planes of the frustum exclude.
TEST(Eye, SeesASphereWhereItsPointsAreSeen) {
  Random random(4);
  const auto any = [&](double most) {
    return Vec3(float(random.uniform(-most, most)), float(random.uniform(-most, most)),
                float(random.uniform(-most, most)));
  };
  const frame::Viewport viewport{640.f, 360.f};
  for (int i = 0; i < 400; ++i) {
    frame::Camera camera{.eye = any(50.), .target = any(50.)};
    if (i % 2) camera.projection = frame::Projection::orthographic;
    Detail detail;
    detail.area = frame::Area{200, 50, 500, 250};
    if (i % 3) detail.hole = frame::Area{300, 100, 400, 200};
    const Eye eye(camera, viewport, detail);
    const Sphere sphere{any(100.), float(random.uniform(.1, 20.))};
    const Seen seen = eye.see(sphere);
    const float focal = camera.focal(viewport.height);
    bool wanted = false;
    for (int k = 0; k < 60; ++k) {
      const Vec3 point = sphere.centre + sphere.radius * any(1.).normalized();
      const Vec3 pixel = frame::project(camera, viewport, point);
      if (pixel.z() < camera.near) continue;
      if (seen.known) {
        EXPECT_LE((pixel.head<2>() - Vec2(320, 180) - focal * seen.place).norm(),
                  1.001f * focal * seen.reach + .01f);
        EXPECT_GE(pixel.z(), seen.nearest - 1e-3f);
      }
      const auto in = [&](const frame::Area& a) {
        return pixel.x() >= float(a.left) && pixel.x() < float(a.right) && pixel.y() >= float(a.top) &&
               pixel.y() < float(a.bottom);
      };
      wanted |= in(*detail.area) && !(detail.hole && in(*detail.hole));
    }
    if (wanted) {
      EXPECT_TRUE(may_see(eye, sphere));
    }
    if (may_see(eye, sphere)) {
      EXPECT_TRUE(frame::Frustum(camera, viewport, *detail.area)
                      .may_see({sphere.centre, 1.001f * sphere.radius + .01f}));
    }
  }
}

TEST(Eye, WantsNothingOfTheHole) {
  Detail detail;
  detail.hole = frame::Area{300, 160, 340, 200};
  const Eye eye({.eye = {0, 0, 0}, .target = {0, 0, -1}}, {640.f, 360.f}, detail);
  EXPECT_FALSE(may_see(eye, {{0, 0, -100}, .5f}));
  EXPECT_TRUE(may_see(eye, {{0, 0, -100}, 20.f}));
  EXPECT_TRUE(may_see(eye, {{10, 0, -100}, .5f}));
  EXPECT_TRUE(may_see(eye, {{0, 0, 0}, .5f}));  // around the eye: anywhere
}

}  // namespace
}  // namespace forest::scene
