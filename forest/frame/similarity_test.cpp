// SPDX-License-Identifier: Apache-2.0
#include "forest/frame/similarity.h"

#include <cmath>

#include <gtest/gtest.h>

#include "forest/core/error.h"
#include "forest/core/random.h"

namespace forest::frame {
namespace {

Image noise(std::uint32_t width, std::uint32_t height, std::uint64_t seed) {
  Random random(seed);
  Image image{width, height, std::vector<std::uint8_t>(std::size_t(4) * width * height, 255)};
  for (std::size_t i = 0; i < image.pixels.size(); i += 4)
    for (std::size_t c = 0; c < 3; ++c) image.pixels[i + c] = std::uint8_t(random.below(256));
  return image;
}

Image grey(std::uint32_t width, std::uint32_t height, std::uint8_t level) {
  return {width, height, std::vector<std::uint8_t>(std::size_t(4) * width * height, level)};
}

Image mixed(const Image& a, const Image& b, double share) {
  Image image = a;
  for (std::size_t i = 0; i < image.pixels.size(); ++i)
    image.pixels[i] = std::uint8_t(std::lround((1. - share) * a.pixels[i] + share * b.pixels[i]));
  return image;
}

// The formula of the paper, window by window and weight by weight.
double by_the_book(const Image& a, const Image& b) {
  const auto la = luminance(a), lb = luminance(b);
  double total = 0., windows = 0.;
  for (int y = 5; y + 5 < int(a.height); ++y)
    for (int x = 5; x + 5 < int(a.width); ++x) {
      double weight = 0., ma = 0., mb = 0., aa = 0., bb = 0., ab = 0.;
      for (int v = -5; v <= 5; ++v)
        for (int u = -5; u <= 5; ++u) {
          const double w = std::exp(-(u * u + v * v) / 4.5);
          const std::size_t at = std::size_t(y + v) * a.width + std::size_t(x + u);
          const double p = la[at], q = lb[at];
          weight += w, ma += w * p, mb += w * q, aa += w * p * p, bb += w * q * q, ab += w * p * q;
        }
      ma /= weight, mb /= weight;
      aa = aa / weight - ma * ma, bb = bb / weight - mb * mb, ab = ab / weight - ma * mb;
      total += (2. * ma * mb + 6.5025) * (2. * ab + 58.5225) /
               ((ma * ma + mb * mb + 6.5025) * (aa + bb + 58.5225));
      ++windows;
    }
  return total / windows;
}

TEST(Similarity, IsOneForEqualPicturesAndFallsWithWhatIsMixedIn) {
  const Image a = noise(40, 30, 1), b = noise(40, 30, 2);
  EXPECT_NEAR(similarity(a, a), 1., 1e-9);
  double before = 1.;
  for (const double share : {.1, .3, .6, 1.}) {
    const double now = similarity(a, mixed(a, b, share));
    EXPECT_LT(now, before);
    EXPECT_NEAR(now, similarity(mixed(a, b, share), a), 1e-9);
    before = now;
  }
  EXPECT_LT(before, .1);
}

TEST(Similarity, IsThatOfTheBook) {
  const Image a = noise(33, 21, 3);
  for (const Image& b : {noise(33, 21, 4), mixed(a, noise(33, 21, 5), .4), grey(33, 21, 90)})
    EXPECT_NEAR(similarity(a, b), by_the_book(a, b), 1e-6);
}

TEST(Similarity, OfEvenPicturesComparesTheirBrightnessAlone) {
  EXPECT_NEAR(similarity(grey(20, 20, 100), grey(20, 20, 50)), (2. * 100 * 50 + 6.5025) / (12500. + 6.5025),
              1e-6);
}

TEST(Similarity, ChangeIsTheMeanDifferenceInLuminance) {
  EXPECT_NEAR(change(grey(8, 8, 200), grey(8, 8, 190)), 10., 1e-4);
  Image one = grey(8, 8, 0);
  one.pixels[4 * 10 + 1] = 255;  // a single green pixel
  EXPECT_NEAR(change(one, grey(8, 8, 0)), .7152 * 255. / 64., 1e-4);
}

TEST(Similarity, PicturesSmallerThanAWindowAreCompared) {
  const Image a = noise(4, 3, 6);
  EXPECT_NEAR(similarity(a, a), 1., 1e-9);
  EXPECT_LT(similarity(a, noise(4, 3, 7)), .9);
}

TEST(Similarity, RefusesPicturesOfTwoSizes) {
  EXPECT_THROW(similarity(grey(8, 8, 0), grey(8, 9, 0)), Error);
  EXPECT_THROW(change(grey(8, 8, 0), grey(9, 8, 0)), Error);
  EXPECT_THROW(similarity(Image(), Image()), Error);
}

}  // namespace
}  // namespace forest::frame
