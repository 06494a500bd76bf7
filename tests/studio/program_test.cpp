// SPDX-License-Identifier: Apache-2.0
// The studio as a program: what it opens, refuses and says.
#include "forest/core/file.h"

#include "tests/sample_forest.h"
#include "tests/studio/driven_studio.h"

namespace forest::studio {
namespace {

TEST(Studio, ShowsASurfaceWithoutAForest) {
  if (!std::getenv("DISPLAY")) GTEST_SKIP() << "there is no display; ctest runs this under xvfb-run";
  // An octahedron of 40 mm, as FreeSurfer writes surfaces.
  std::string bytes =
      "\xff\xff\xfe"
      "made by a test\n\n";
  const auto add = [&](std::uint32_t word) {
    for (int shift = 24; shift >= 0; shift -= 8) bytes += char(word >> shift & 255);
  };
  add(6), add(8);
  for (int i = 0; i < 6; ++i)
    for (int axis = 0; axis < 3; ++axis)
      add(std::bit_cast<std::uint32_t>(axis == i / 2 ? (i % 2 ? -40.f : 40.f) : 0.f));
  for (const std::uint32_t x : {0u, 1u})
    for (const std::uint32_t y : {2u, 3u})
      for (const std::uint32_t z : {4u, 5u})
        add(x), add((x + y + z) % 2 ? y : z), add((x + y + z) % 2 ? z : y);
  write_file(folder / "lh.pial", bytes);
  Studio studio(
      {folder / "lh.pial", "--size", "800x600", "--report", "--screenshot", folder / "surface.png"});
  const Json report = studio.wait_for("settled");
  const scene::View view = scene::parse_view(report.at("view").dump());
  EXPECT_GT((view.camera.eye - view.camera.target).norm(), 40e3f);
  EXPECT_EQ(report.at("segments"), 0);
  EXPECT_EQ(report.at("cut_off"), Json::array());  // of coordinates with six digits
  EXPECT_EQ(studio.end(), std::pair(std::string(), 0));
  const io::Picture seen = io::read_png(folder / "surface.png");
  std::size_t bright = 0;
  for (std::size_t i = 0; i < seen.pixels.size(); i += 4)
    bright += seen.pixels[i] > 110 && seen.pixels[i + 2] > 60;
  EXPECT_GT(bright, 5000u);
  // Values have their colours explained at the top left.
  const auto yellow = [&](const char* picture) {  // the end of the map
    const io::Picture drawn = io::read_png(folder / picture);
    std::size_t count = 0;
    for (std::size_t y = 20; y < 130; ++y)
      for (std::size_t x = 20; x < 260; ++x) {
        const std::uint8_t* p = &drawn.pixels[4 * (y * drawn.width + x)];
        count += p[0] > 220 && p[1] > 220 && p[2] < 90;
      }
    return count;
  };
  write_file(folder / "values.txt", "1\n2\n3\n4\n5\n6\n");
  Studio coloured({folder / "lh.pial", "--overlay", folder / "values.txt", "--size", "800x600",
                   "--screenshot", folder / "values.png"});
  EXPECT_EQ(coloured.end(), std::pair(std::string(), 0));
  EXPECT_EQ(yellow("surface.png"), 0u);
  EXPECT_GT(yellow("values.png"), 50u);
  Studio wrong({sample_file(), "--overlay", folder / "lh.pial"});
  EXPECT_NE(wrong.end().first.find("more overlays (1) than surfaces (0)"), std::string::npos);
}

TEST(Studio, RefusesASimulationOfAnotherCircuit) {
  if (!std::getenv("DISPLAY")) GTEST_SKIP() << "there is no display; ctest runs this under xvfb-run";
  sample_activity();
  write_file(folder / "fewer.forest", scene::pack(testing::sample_circuit(100), testing::sample_neurons()));
  const auto [said, status] =
      Studio({folder / "fewer.forest", "--activity", folder / "sample.activity"}).end();
  EXPECT_EQ(status, 1);
  EXPECT_NE(said.find("with 120 neurons and the forest has 100"), std::string::npos) << said;
  EXPECT_EQ(std::ranges::count(said, '\n'), 1) << said;
}

TEST(Studio, TakesAViewAsTextAndSaysWhatIsWrongWithIt) {
  if (!std::getenv("DISPLAY")) GTEST_SKIP() << "there is no display; ctest runs this under xvfb-run";
  const auto path = folder / "text.png";
  std::filesystem::remove(path);
  setenv("XDG_CONFIG_HOME", (folder / "settings").c_str(), 1);
  Studio good({sample_file(), "--view", scene::to_json(scene::overview(sample())), "--screenshot", path});
  EXPECT_EQ(good.end(), std::pair(std::string(), 0));
  EXPECT_TRUE(std::filesystem::exists(path));
  Studio bad({sample_file(), "--view", "{\"eye\": [1, 2, 3],\n oops}"});
  const auto [said, status] = bad.end();
  EXPECT_EQ(status, 1);
  EXPECT_NE(said.find("--view:2: is no JSON from column 2"), std::string::npos) << said;
}

TEST(Studio, WritesAScreenshotOfItsWindow) {
  if (!std::getenv("DISPLAY")) GTEST_SKIP() << "there is no display; ctest runs this under xvfb-run";
  const auto path = folder / "screenshot.png";
  std::filesystem::remove(path);
  setenv("XDG_CONFIG_HOME", (folder / "settings").c_str(), 1);
  Studio studio({sample_file(), "--size", "1000x700", "--screenshot", path});
  EXPECT_EQ(studio.end(), std::pair(std::string(), 0));
  const io::Picture picture = io::read_png(path);
  EXPECT_EQ(picture.width, 1000u);
  EXPECT_EQ(picture.height, 700u);
}

// Of a screen whose pixels are smaller: the size is still that of the picture.
TEST(Studio, TheSizeIsInPixelsOfTheScreen) {
  if (!std::getenv("DISPLAY")) GTEST_SKIP() << "there is no display; ctest runs this under xvfb-run";
  const std::string picture = folder / "fine_pixels.png";
  setenv("QT_SCALE_FACTOR", "1.5", 1);
  Studio studio({sample_file(), "--size", "1200x780", "--screenshot", picture});
  unsetenv("QT_SCALE_FACTOR");
  EXPECT_EQ(studio.end().second, 0);
  const io::Picture seen = io::read_png(picture);
  EXPECT_NEAR(double(seen.width), 1200., 1.);
  EXPECT_NEAR(double(seen.height), 780., 1.);
}

TEST(Studio, SaysWhichNodeSetReplacesWhich) {
  if (!std::getenv("DISPLAY")) GTEST_SKIP() << "there is no display; ctest runs this under xvfb-run";
  sample_file();
  write_file(folder / "one.json", R"({"mine": {"node_id": [1, 2]}})");
  write_file(folder / "two.json", R"({"mine": {"node_id": [3]}})");
  const auto [said, status] = Studio({sample_file(), "--node-sets", folder / "one.json", folder / "two.json",
                                      "--screenshot", folder / "sets.png"})
                                  .end();
  EXPECT_EQ(status, 0);
  EXPECT_NE(said.find("two.json replaces the node set 'mine' of the files before it"), std::string::npos)
      << said;
  EXPECT_EQ(std::ranges::count(said, '\n'), 1) << said;
}

TEST(Studio, OpensAForestWithTheLongestName) {
  if (!std::getenv("DISPLAY")) GTEST_SKIP() << "there is no display; ctest runs this under xvfb-run";
  // That of its synapses would be longer than any file's may be.
  const auto path = folder / (std::string(255 - 7, 'x') + ".forest");
  write_file(path, MappedFile(sample_file()).bytes());
  Studio studio({path, "--screenshot", folder / "long.png"});
  EXPECT_EQ(studio.end(), std::pair(std::string(), 0));
  std::filesystem::remove(path);
}

TEST(Studio, WhatGoesWrongIsOneSentence) {
  std::filesystem::create_directories(folder);
  write_file(folder / "no.forest", "this is no forest");
  write_file(folder / "no.json", "{\"eye\": 3}");
  const std::pair<std::vector<std::string>, int> wrong[] = {
      {{folder / "missing.forest"}, 1},
      {{folder / "no.forest"}, 1},
      {{sample_file(), "--view", folder / "no.json"}, 1},
      {{sample_file(), "--size", "big"}, 1},
      {{}, 2},
      {{sample_file(), "--no-such-option"}, 2},
  };
  for (const auto& [arguments, status] : wrong) {
    const auto [said, ended] = Studio(arguments).end();
    EXPECT_EQ(ended, status) << said;
    EXPECT_FALSE(said.empty());
    if (status == 1) {
      EXPECT_EQ(std::ranges::count(said, '\n'), 1) << said;
    }
  }
}

TEST(Studio, WithoutOpenGlItSaysWhatToInstall) {
  if (!std::getenv("DISPLAY")) GTEST_SKIP() << "there is no display; ctest runs this under xvfb-run";
  for (const auto& [name, value] :
       {std::pair{"QT_XCB_GL_INTEGRATION", "none"}, {"QT_QPA_PLATFORM", "offscreen"}}) {
    setenv(name, value, 1);
    const auto [said, ended] = Studio({sample_file(), "--renderer", "cpu"}).end();
    unsetenv(name);
    EXPECT_EQ(ended, 1);
    EXPECT_NE(said.find("install libgl1-mesa-dri"), std::string::npos) << said;
    EXPECT_EQ(std::ranges::count(said, '\n'), 1) << said;
  }
}

TEST(Studio, WithoutADisplayItSaysSo) {
  const char* display = std::getenv("DISPLAY");
  const std::string kept = display ? display : "";
  unsetenv("DISPLAY");
  unsetenv("WAYLAND_DISPLAY");
  const auto [said, ended] = Studio({sample_file()}).end();
  if (display) setenv("DISPLAY", kept.c_str(), 1);
  EXPECT_EQ(ended, 1);
  EXPECT_NE(said.find("no display"), std::string::npos) << said;
  EXPECT_EQ(std::ranges::count(said, '\n'), 1) << said;
}

}  // namespace
}  // namespace forest::studio
