// SPDX-License-Identifier: Apache-2.0
// The cortex against measured layers.
#include <array>
#include <numeric>

#include <fmt/format.h>
#include <gtest/gtest.h>

#include "forest/core/file.h"
#include "forest/cortex/bok.h"
#include "forest/io/surface.h"

#include "tests/real_data.h"

namespace forest::cortex {
namespace {

TEST(BigBrain, ItsLayersKeepTheirVolumeAsItFolds) {
  FOREST_REAL_DATA(folder, "cortex/bigbrain_left");
  const auto path = [&](const std::string& what) { return folder / ("tpl-bigbrain_hemi-L_desc-" + what); };
  const auto surface = [&](const std::string& what) {
    return io::read_surface(MappedFile(path(what)).text(), what);
  };
  const Mesh pial = surface("pial.surf.gii.gz"), white = surface("white.surf.gii.gz");
  ASSERT_EQ(pial.triangles, white.triangles);
  std::vector<Place> outer, inner;
  for (const Vec3& p : pial.positions) outer.push_back(p.cast<double>());
  for (const Vec3& p : white.positions) inner.push_back(p.cast<double>());
  std::array<std::vector<float>, 6> layers;
  for (std::size_t k = 0; k < 6; ++k) {
    const std::string name = fmt::format("layer{}_thickness.txt.gz", k + 1);
    layers[k] = io::read_surface_values(MappedFile(path(name)).text(), name).values;
    ASSERT_EQ(layers[k].size(), outer.size());
  }

  const auto [measured, by_volume, vertices] = bok(outer, inner, pial.triangles, layers);
  EXPECT_GT(vertices, 150'000u);
  EXPECT_NEAR(measured.l1, .66, .02);
  EXPECT_NEAR(measured.l6, 1.42, .03);
  EXPECT_NEAR(by_volume.l1 / measured.l1, 1., .15);
  EXPECT_NEAR(by_volume.l6 / measured.l6, 1., .15);
  // Depth by length would give 1 and 1.
  EXPECT_LT(measured.l1, .85);
  EXPECT_GT(measured.l6, 1.15);
}

}  // namespace
}  // namespace forest::cortex
