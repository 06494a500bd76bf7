// SPDX-License-Identifier: Apache-2.0
#include "forest/scene/arrangement.h"

#include <algorithm>
#include <cmath>
#include <set>

#include <gtest/gtest.h>

namespace forest::scene {
namespace {

constexpr frame::Viewport picture{640.f, 360.f};

// Nothing but the ground of a picture.
frame::Image empty(Background background = Background::dark) {
  frame::Image image{640, 360, std::vector<std::uint8_t>(std::size_t(4) * 640 * 360, 255), 0.};
  const Paper paper = paper_of(background);
  for (std::size_t y = 0; y < image.height; ++y) {
    const Vec3 c = 255.f * screen_of(paper.top + (float(y) + .5f) / 360.f * (paper.bottom - paper.top));
    for (std::size_t x = 0; x < image.width; ++x)
      for (std::size_t k = 0; k < 3; ++k)  // dithered
        image.pixels[4 * (y * image.width + x) + k] = std::uint8_t(
            std::min(255.f, std::floor(c[Eigen::Index(k)] + float((7 * x + 3 * y) % 10) / 10.f)));
  }
  return image;
}

// Words whose letters are one box of a colour that nothing else has.
Block words(Block::Kind kind, Spot usual, float width = 120.f, float height = 60.f) {
  return {kind, usual, width, height, 10.f, [=](frame::Image& image, float left, float top) {
            fill(image, {left + 20.f, top + 20.f, left + width - 20.f, top + height - 20.f}, {1.f, 0.f, 1.f});
          }};
}

// The middle of what is written.
Vec2 written_at(const frame::Image& image) {
  Vec2 sum = Vec2::Zero();
  float count = 0.f;
  for (std::size_t y = 0; y < image.height; ++y)
    for (std::size_t x = 0; x < image.width; ++x) {
      const std::uint8_t* p = &image.pixels[4 * (y * image.width + x)];
      if (p[0] == 255 && p[1] == 0 && p[2] == 255) sum += Vec2(float(x) + .5f, float(y) + .5f), count += 1.f;
    }
  return count > 0.f ? Vec2(sum / count) : Vec2(-1.f, -1.f);
}

void cover(frame::Image& image, const Box& box) { fill(image, box, {.9f, .6f, .2f}); }

TEST(Arrangement, WordsStandWhereTheyUsuallyDoWhereTheyHideNothing) {
  for (const Background background : {Background::dark, Background::light})
    for (std::size_t i = 0; i < spots; ++i) {
      frame::Image image = empty(background);
      const Block block = words(Block::names, Spot(i));
      Arrangement().paint(image, paper_of(background), {&block, 1});
      const Box box = block.at(Spot(i), picture);
      EXPECT_LT((written_at(image) - Vec2(box.left + 60.f, box.top + 30.f)).norm(), 1.f) << i;
      frame::Image bare = empty(background);
      block.paint(bare, box.left, box.top);
      EXPECT_EQ(image.pixels, bare.pixels) << "and have no plate";
    }
}

TEST(Arrangement, AllSpotsLieWithinThePictureAndAreDifferent) {
  std::set<std::pair<float, float>> places;
  for (std::size_t i = 0; i < spots; ++i) {
    const Box box = words(Block::names, Spot::top_left).at(Spot(i), picture);
    EXPECT_GE(std::min(box.left, box.top), 10.f);
    EXPECT_LE(box.right, 630.f);
    EXPECT_LE(box.bottom, 350.f);
    places.emplace(box.left, box.top);
  }
  EXPECT_EQ(places.size(), spots);
}

TEST(Arrangement, WordsGoWhereNothingIsDrawn) {
  for (std::size_t only = 0; only < spots; ++only) {
    const Block block = words(Block::names, Spot::top_left);
    const Box free = block.at(Spot(only), picture);
    frame::Image image = empty();
    for (std::size_t i = 0; i < spots; ++i)
      if (i != only) cover(image, block.at(Spot(i), picture));
    const frame::Image before = image;
    Arrangement().paint(image, paper_of(Background::dark), {&block, 1});
    EXPECT_LT((written_at(image) - Vec2(free.left + 60.f, free.top + 30.f)).norm(), 1.f) << only;
    EXPECT_EQ(hidden_by(free, before, paper_of(Background::dark)), 0.f);
  }
}

TEST(Arrangement, WhereAllIsDrawnOverWordsHaveQuietGround) {
  frame::Image image = empty();
  cover(image, {0.f, 0.f, 640.f, 360.f});
  const Block block = words(Block::names, Spot::top_left);
  Arrangement().paint(image, paper_of(Background::dark), {&block, 1});
  const Box box = block.at(Spot::top_left, picture);
  EXPECT_LT((written_at(image) - Vec2(box.left + 60.f, box.top + 30.f)).norm(), 1.f);
  const auto red = [&](std::size_t x, std::size_t y) { return int(image.pixels[4 * (y * 640 + x)]); };
  EXPECT_LT(red(15, 15), 80);  // on the plate, through which it is seen faintly
  EXPECT_GT(red(15, 15), 20);
  EXPECT_GT(red(300, 200), 200);
}

TEST(Arrangement, NoTwoBlocksStandOnOneAnother) {
  frame::Image image = empty();
  cover(image, {0.f, 180.f, 640.f, 360.f});
  const Block blocks[] = {words(Block::values, Spot::top_left), words(Block::names, Spot::top_left),
                          words(Block::scale, Spot::bottom_left), words(Block::step, Spot::top_right)};
  Arrangement places;
  places.paint(image, paper_of(Background::dark), blocks);
  std::vector<Box> boxes;
  for (const Block& block : blocks) boxes.push_back(places.place(block, picture));
  for (std::size_t i = 0; i < boxes.size(); ++i)
    for (std::size_t k = 0; k < i; ++k)
      EXPECT_TRUE(boxes[i].left >= boxes[k].right || boxes[k].left >= boxes[i].right ||
                  boxes[i].top >= boxes[k].bottom || boxes[k].top >= boxes[i].bottom)
          << i << k;
}

TEST(Arrangement, InAFilmWordsStandWhereTheyHideLeastOfAllOfItAndStayThere) {
  const Paper paper = paper_of(Background::dark);
  const Block block = words(Block::names, Spot::top_left);
  // Something moves from one spot to the next, and spends no time in the last corner.
  std::vector<frame::Image> pictures;
  for (std::size_t i = 0; i < spots; ++i) {
    pictures.push_back(empty());
    if (Spot(i) != Spot::bottom_right) cover(pictures.back(), block.at(Spot(i), picture));
  }
  Arrangement places;
  for (const frame::Image& image : pictures) places.look_at(image, paper, {&block, 1});
  const Box stands = block.at(Spot::bottom_right, picture);
  for (frame::Image& image : pictures) {
    places.paint(image, paper, {&block, 1});
    EXPECT_LT((written_at(image) - Vec2(stands.left + 60.f, stands.top + 30.f)).norm(), 1.f);
  }
  const Block longer = words(Block::names, Spot::top_left, 300.f);  // grows out of its corner
  EXPECT_EQ(places.place(longer, picture).right, stands.right);
}

}  // namespace
}  // namespace forest::scene
