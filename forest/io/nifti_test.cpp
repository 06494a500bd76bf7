// SPDX-License-Identifier: Apache-2.0
#include "forest/io/nifti.h"

#include <algorithm>
#include <cmath>
#include <cstring>

#include <gtest/gtest.h>

#include "forest/core/error.h"
#include "forest/core/file.h"

#include "tests/real_data.h"
#include "tests/refused.h"

namespace forest::io {
namespace {

// 4 × 3 × 2 voxels of 1, 2, 3 mm, value 100 z + 10 y + x, as the standard lays them out.
struct File {
  std::string bytes;
  bool wide, big;

  template <class T>
  void put(std::size_t at, T value) {
    char raw[sizeof(T)];
    std::memcpy(raw, &value, sizeof(T));
    if (big) std::reverse(raw, raw + sizeof(T));
    std::memcpy(bytes.data() + at, raw, sizeof(T));
  }
  void put_real(std::size_t at, double value) { wide ? put(at, value) : put(at, float(value)); }
  void put_whole(std::size_t at, long value) {
    wide ? put(at, std::int64_t(value)) : put(at, std::int16_t(value));
  }
};

File small(bool wide = false, bool big = false) {
  const std::size_t header = wide ? 540 : 348, offset = wide ? 544 : 352;
  File file{std::string(offset + 24 * 2, '\0'), wide, big};
  file.put(0, std::int32_t(header));
  std::memcpy(file.bytes.data() + (wide ? 4 : 344), wide ? "n+2\0\r\n\032\n" : "n+1\0", wide ? 8 : 4);
  const std::size_t dim = wide ? 16 : 40, each = wide ? 8 : 2, real = wide ? 8 : 4;
  const long sizes[] = {3, 4, 3, 2, 1, 1, 1, 1};
  for (std::size_t k = 0; k < 8; ++k) file.put_whole(dim + each * k, sizes[k]);
  file.put(wide ? 12 : 70, std::int16_t(4));
  file.put(wide ? 14 : 72, std::int16_t(16));
  for (std::size_t k = 0; k < 4; ++k) file.put_real((wide ? 104 : 76) + real * k, double(k ? k : 1));
  wide ? file.put(168, std::int64_t(offset)) : file.put(108, float(offset));
  file.put_real(wide ? 176 : 112, 1.);
  wide ? file.put(500, std::int32_t(2)) : file.put(123, std::int8_t(2));
  const std::size_t srow = wide ? 400 : 280;
  wide ? file.put(348, std::int32_t(1)) : file.put(254, std::int16_t(1));
  const double affine[3][4] = {{1, 0, 0, -10}, {0, 2, 0, 20}, {0, 0, 3, 5}};
  for (std::size_t r = 0; r < 3; ++r)
    for (std::size_t c = 0; c < 4; ++c) file.put_real(srow + real * (4 * r + c), affine[r][c]);
  for (int z = 0; z < 2; ++z)
    for (int y = 0; y < 3; ++y)
      for (int x = 0; x < 4; ++x)
        file.put(offset + 2 * std::size_t(12 * z + 4 * y + x), std::int16_t(100 * z + 10 * y + x));
  return file;
}

std::string sentence(const std::string& bytes) {
  return refused<InputError>([&] { (void)read_nifti(bytes, "v.nii"); });
}

TEST(Nifti, IsTheSameInBothVersionsAndOrdersOfBytes) {
  for (const bool wide : {false, true})
    for (const bool big : {false, true}) {
      const File file = small(wide, big);
      EXPECT_TRUE(may_be_nifti(file.bytes));
      const cortex::Volume volume = read_nifti(file.bytes, "v.nii").volume;
      EXPECT_EQ(volume.size, (std::array<std::size_t, 3>{4, 3, 2}));
      EXPECT_EQ(volume.origin, Eigen::Vector3d(-10000., 20000., 5000.));
      EXPECT_EQ(volume.step, Eigen::Vector3d(1000., 2000., 3000.));
      for (std::size_t z = 0; z < 2; ++z)
        for (std::size_t y = 0; y < 3; ++y)
          for (std::size_t x = 0; x < 4; ++x) EXPECT_EQ(volume.at(x, y, z), float(100 * z + 10 * y + x));
    }
}

TEST(Nifti, IsTurnedSoThatAxesRunAsThoseOfSpace) {
  File file = small();
  // The first axis runs to the left, the second one upwards, the third one to the front.
  const float affine[3][4] = {{-1, 0, 0, 7}, {0, 0, 3, 5}, {0, 2, 0, 1}};
  for (std::size_t r = 0; r < 3; ++r)
    for (std::size_t c = 0; c < 4; ++c) file.put(280 + 4 * (4 * r + c), affine[r][c]);
  const cortex::Volume volume = read_nifti(file.bytes, "v.nii").volume;
  EXPECT_EQ(volume.size, (std::array<std::size_t, 3>{4, 2, 3}));
  EXPECT_EQ(volume.origin, Eigen::Vector3d(4000., 5000., 1000.));
  EXPECT_EQ(volume.at(3, 0, 0), 0.f);
  EXPECT_EQ(volume.at(0, 0, 0), 3.f);
  EXPECT_EQ(volume.at(3, 1, 0), 100.f);
  EXPECT_EQ(volume.at(3, 0, 2), 20.f);
}

TEST(Nifti, TakesTheQuaternionWhereNoAffineIs) {
  File file = small();
  file.put(254, std::int16_t(0)), file.put(252, std::int16_t(1));
  file.put(268, 3.f), file.put(272, 4.f), file.put(276, 5.f);
  file.put(264, 1.f);  // half a turn around z
  const cortex::Volume volume = read_nifti(file.bytes, "v.nii").volume;
  EXPECT_NEAR((volume.origin - Eigen::Vector3d(0., 0., 5000.)).norm(), 0., 1e-3);
  EXPECT_EQ(volume.at(3, 2, 0), 0.f);
}

TEST(Nifti, ScalesItsValuesAndItsUnit) {
  File file = small();
  file.put(112, .5f), file.put(116, 7.f);
  file.put(123, std::int8_t(3));  // µm
  const cortex::Volume volume = read_nifti(file.bytes, "v.nii").volume;
  EXPECT_EQ(volume.at(3, 2, 1), 7.f + .5f * 123.f);
  EXPECT_EQ(volume.step.x(), 1.);
  for (const bool big : {false, true}) {  // of the second version the unit takes four bytes
    File wide = small(true, big);
    wide.put(500, std::int32_t(3));
    EXPECT_EQ(read_nifti(wide.bytes, "v.nii").volume.step.x(), 1.);
  }
}

TEST(Nifti, IsRefusedWhereverItIsCutOff) {
  for (const bool wide : {false, true}) {
    const File file = small(wide);
    for (std::size_t size = 0; size < file.bytes.size(); ++size)
      EXPECT_NE(sentence(file.bytes.substr(0, size)), "") << size;
  }
}

TEST(Nifti, WithAnyByteOfItsHeaderWrongIsRefusedOrRead) {
  const File file = small();
  for (std::size_t at = 0; at < 352; ++at)
    for (const char byte : {'\0', '\x01', '\x7f', '\x80', '\xff'}) {
      File broken = file;
      broken.bytes[at] = byte;
      const auto look = [&] {
        const cortex::Volume volume = read_nifti(broken.bytes, "v.nii").volume;
        EXPECT_EQ(volume.values.size(), volume.size[0] * volume.size[1] * volume.size[2]);
      };
      (void)refused<InputError>(look);
    }
}

TEST(Nifti, WithSizesThatLieIsRefusedBeforeTheyAreBelieved) {
  for (const long size : {0L, -1L, 32767L}) {
    File file = small();
    file.put_whole(42, size);
    EXPECT_NE(sentence(file.bytes), "") << size;
  }
  for (const long size : {1L << 40, 1L << 62, -5L}) {
    File file = small(true);
    file.put_whole(24, size), file.put_whole(32, size);
    EXPECT_NE(sentence(file.bytes), "") << size;
  }
  for (const float offset : {-1.f, 0.f, 1e30f, NAN}) {
    File file = small();
    file.put(108, offset);
    EXPECT_NE(sentence(file.bytes), "") << offset;
  }
}

TEST(Nifti, SaysWhatToDo) {
  EXPECT_NE(sentence("text").find(".nii"), std::string::npos);
  File file = small();
  std::memcpy(file.bytes.data() + 344, "ni1", 3);
  EXPECT_NE(sentence(file.bytes).find(".img"), std::string::npos);
  file = small();
  file.put(70, std::int16_t(128));  // RGB
  EXPECT_NE(sentence(file.bytes).find("type 128"), std::string::npos);
  file = small();
  file.put(284, .5f);
  EXPECT_NE(sentence(file.bytes).find("oblique"), std::string::npos);
  file = small();
  file.put(280, NAN);
  EXPECT_NE(sentence(file.bytes).find("no number"), std::string::npos);
}

TEST(Nifti, OfAnAverageBrainIsWhereItsSpaceSays) {
  FOREST_REAL_DATA(folder, "cortex/mni152");
  const MappedFile file(folder / "mni_icbm152_gm_tal_nlin_sym_09a_converted.nii.gz");
  const cortex::Volume volume = read_nifti(file.text(), "gm.nii.gz").volume;
  EXPECT_EQ(volume.step, Eigen::Vector3d(1000., 1000., 1000.));
  EXPECT_GT(volume.size[1], 200u);
  EXPECT_LT(volume.origin.x(), -70000.);
  EXPECT_LT(volume.origin.y(), -100000.);
  const double planes[] = {0.};
  const cortex::ContourStack stack = cortex::contours_of(volume, "grey", cortex::Axis::y, planes, .5);
  EXPECT_GT(stack.sections[0].contours.size(), 2u);
  EXPECT_EQ(cortex::fault_of(stack), "");
}

}  // namespace
}  // namespace forest::io
