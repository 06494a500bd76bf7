// SPDX-License-Identifier: Apache-2.0
#include "forest/io/grey_picture.h"

#include <cstring>
#include <filesystem>
#include <png.h>
#include <tiffio.h>
#include <unistd.h>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "forest/core/error.h"
#include "forest/core/file.h"

#include "tests/refused.h"

namespace forest::io {
namespace {

using ::testing::HasSubstr;

constexpr std::uint32_t width = 37, height = 21;

// What is painted: a ramp, other on every page, in shares of white.
double painted(std::uint32_t x, std::uint32_t y, std::uint32_t page) {
  return double((x * 7 + y * 29 + page * 13) % 256) / 255.;
}

struct Kind {
  std::string name;
  std::uint16_t bits = 8, samples = 1, format = SAMPLEFORMAT_UINT, shown = PHOTOMETRIC_MINISBLACK,
                packing = COMPRESSION_NONE;
  bool tiled = false, apart = false;
  double error = 1e-6;
  std::uint16_t first = ORIENTATION_TOPLEFT;
};
const Kind kinds[] = {
    {"grey8"},
    {.name = "grey8_lzw", .packing = COMPRESSION_LZW},
    {.name = "grey16", .bits = 16},
    {.name = "grey16_tiles_deflated", .bits = 16, .packing = COMPRESSION_ADOBE_DEFLATE, .tiled = true},
    {.name = "grey32", .bits = 32},
    {.name = "floats", .bits = 32, .format = SAMPLEFORMAT_IEEEFP},
    {.name = "white_is_0", .shown = PHOTOMETRIC_MINISWHITE},
    {.name = "colours", .samples = 3, .shown = PHOTOMETRIC_RGB},
    {.name = "colours_apart", .samples = 3, .shown = PHOTOMETRIC_RGB, .apart = true},
    {.name = "colours16_with_opacity", .bits = 16, .samples = 4, .shown = PHOTOMETRIC_RGB, .tiled = true},
    {.name = "palette", .shown = PHOTOMETRIC_PALETTE},
    {.name = "one_bit", .bits = 1, .error = .51},
    {.name = "with_a_sign", .bits = 16, .format = SAMPLEFORMAT_INT, .error = 2e-5},
    {.name = "first_pixel_below", .first = ORIENTATION_BOTLEFT},
    {.name = "first_pixel_below_right", .bits = 16, .first = ORIENTATION_BOTRIGHT},
    {.name = "palette_first_pixel_below", .shown = PHOTOMETRIC_PALETTE, .first = ORIENTATION_BOTLEFT},
};

void put(std::vector<std::byte>& row, std::size_t at, const Kind& kind, double share) {
  const auto store = [&]<class T>(T number) {
    std::memcpy(row.data() + at * sizeof number, &number, sizeof number);
  };
  if (kind.format == SAMPLEFORMAT_IEEEFP)
    store(float(share));
  else if (kind.bits == 8)
    store(std::uint8_t(std::lround(share * 255.)));
  else if (kind.format == SAMPLEFORMAT_INT)
    store(std::int16_t(std::lround((share - .5) * 2. * 32767.)));
  else if (kind.bits == 16)
    store(std::uint16_t(std::lround(share * 65535.)));
  else if (kind.bits == 32)
    store(std::uint32_t(std::llround(share * 4294967295.)));
  else if (share > .5)
    row[at / 8] |= std::byte(0x80 >> (at % 8));
}

std::string written(const Kind& kind, std::uint32_t pages = 1) {
  const auto path =
      std::filesystem::temp_directory_path() / ("forest_grey_" + std::to_string(::getpid()) + ".tif");
  TIFF* tiff = TIFFOpen(path.c_str(), "w");
  for (std::uint32_t page = 0; page < pages; ++page) {
    TIFFSetField(tiff, TIFFTAG_IMAGEWIDTH, width), TIFFSetField(tiff, TIFFTAG_IMAGELENGTH, height);
    TIFFSetField(tiff, TIFFTAG_BITSPERSAMPLE, kind.bits),
        TIFFSetField(tiff, TIFFTAG_SAMPLESPERPIXEL, kind.samples);
    TIFFSetField(tiff, TIFFTAG_SAMPLEFORMAT, kind.format),
        TIFFSetField(tiff, TIFFTAG_PHOTOMETRIC, kind.shown);
    TIFFSetField(tiff, TIFFTAG_COMPRESSION, kind.packing);
    TIFFSetField(tiff, TIFFTAG_ORIENTATION, kind.first);
    TIFFSetField(tiff, TIFFTAG_PLANARCONFIG, kind.apart ? PLANARCONFIG_SEPARATE : PLANARCONFIG_CONTIG);
    if (kind.samples == 4) {
      const std::uint16_t opacity = EXTRASAMPLE_UNASSALPHA;
      TIFFSetField(tiff, TIFFTAG_EXTRASAMPLES, 1, &opacity);
    }
    if (kind.shown == PHOTOMETRIC_PALETTE) {
      std::vector<std::uint16_t> map(256);
      for (std::size_t i = 0; i < 256; ++i) map[i] = std::uint16_t(i * 257);
      TIFFSetField(tiff, TIFFTAG_COLORMAP, map.data(), map.data(), map.data());
    }
    // Colours: the share in green alone would be .7152 of it, so red, green and blue have it all.
    const std::uint32_t wide = kind.tiled ? 16 : width, high = kind.tiled ? 16 : 8;
    if (kind.tiled)
      TIFFSetField(tiff, TIFFTAG_TILEWIDTH, wide), TIFFSetField(tiff, TIFFTAG_TILELENGTH, high);
    else
      TIFFSetField(tiff, TIFFTAG_ROWSPERSTRIP, high);
    const std::uint16_t planes = kind.apart ? kind.samples : 1, mixed = kind.apart ? 1 : kind.samples;
    for (std::uint16_t plane = 0; plane < planes; ++plane)
      for (std::uint32_t top = 0; top < height; top += high)
        for (std::uint32_t left = 0; left < width; left += wide) {
          const std::uint32_t rows = kind.tiled ? high : std::min(high, height - top);
          const std::size_t stride = (std::size_t(wide) * mixed * kind.bits + 7) / 8;
          std::vector<std::byte> block;
          for (std::uint32_t y = 0; y < rows; ++y) {
            std::vector<std::byte> row(stride);
            for (std::uint32_t x = 0; x < wide && left + x < width && top + y < height; ++x)
              for (std::uint16_t k = 0; k < mixed; ++k) {
                const double share = painted(left + x, top + y, page);
                put(row, x * mixed + k, kind,
                    k == 3                                 ? .25
                    : kind.shown == PHOTOMETRIC_MINISWHITE ? 1. - share
                                                           : share);
              }
            block.insert(block.end(), row.begin(), row.end());
          }
          if (kind.tiled)
            TIFFWriteEncodedTile(tiff, TIFFComputeTile(tiff, left, top, 0, plane), block.data(),
                                 tmsize_t(block.size()));
          else
            TIFFWriteEncodedStrip(tiff, TIFFComputeStrip(tiff, top, plane), block.data(),
                                  tmsize_t(block.size()));
        }
    TIFFWriteDirectory(tiff);
  }
  TIFFClose(tiff);
  std::string bytes(MappedFile(path).text());
  std::filesystem::remove(path);
  return bytes;
}

class Greys : public ::testing::TestWithParam<Kind> {};

TEST_P(Greys, AreWhatWasPainted) {
  const std::string bytes = written(GetParam());
  GreyFile file(bytes, "a.tif");
  ASSERT_EQ(file.pages(), 1u);
  const GreyPicture picture = file.read();
  ASSERT_EQ(picture.width, width);
  ASSERT_EQ(picture.height, height);
  ASSERT_EQ(picture.values.size(), std::size_t(width) * height);
  const std::uint16_t first = GetParam().first;
  const bool below = first == ORIENTATION_BOTLEFT || first == ORIENTATION_BOTRIGHT,
             right = first == ORIENTATION_BOTRIGHT;
  for (std::uint32_t y = 0; y < height; ++y)
    for (std::uint32_t x = 0; x < width; ++x)
      ASSERT_NEAR(GetParam().format == SAMPLEFORMAT_INT ? .5 + .5 * double(picture.values[y * width + x])
                                                        : double(picture.values[y * width + x]),
                  painted(right ? width - 1 - x : x, below ? height - 1 - y : y, 0), GetParam().error)
          << x << " " << y;
}

TEST_P(Greys, CutOffAnywhereAreAPictureOrASentence) {
  const std::string bytes = written(GetParam());
  std::size_t refused = 0;
  for (std::size_t size = 0; size < bytes.size(); ++size) {
    const std::string cut = bytes.substr(0, size);
    try {
      const GreyPicture picture = GreyFile(cut, "cut.tif").read();
      EXPECT_EQ(picture.values.size(), std::size_t(picture.width) * picture.height);
    } catch (const InputError& error) {
      EXPECT_THAT(error.what(), HasSubstr("cut.tif: "));
      ++refused;
    }
  }
  EXPECT_GT(refused, std::size_t(width) * height / 9);  // of its pixels, at the least
}

INSTANTIATE_TEST_SUITE_P(Kinds, Greys, ::testing::ValuesIn(kinds),
                         [](const auto& kind) { return kind.param.name; });

TEST(GreyPicture, EveryPageIsRead) {
  const std::string bytes = written({.name = "pages", .bits = 16}, 5);
  GreyFile file(bytes, "a.tif");
  ASSERT_EQ(file.pages(), 5u);
  for (const std::uint32_t page : {0u, 1u, 2u, 3u, 4u, 1u, 4u, 0u})
    EXPECT_NEAR(double(file.read(page).values[3]), painted(3, 0, page), 1e-6) << page;
  EXPECT_THAT(refused([&] { file.read(5); }), HasSubstr("has 5 pages, and none with the number 6"));
}

TEST(GreyPicture, WhatLiesOnItsSideIsRefusedHoweverItIsKept) {
  for (const Kind& kind : kinds)
    for (std::uint16_t first = ORIENTATION_LEFTTOP; first <= ORIENTATION_LEFTBOT; ++first) {
      Kind lying = kind;
      lying.first = first;
      const std::string bytes = written(lying);
      EXPECT_THAT(refused([&] { GreyFile(bytes, "a.tif").read(); }), HasSubstr("lies on its side"))
          << kind.name << " " << first;
    }
}

TEST(GreyPicture, OfSixteenBitsAPngKeepsThem) {
  std::vector<std::uint16_t> pixels(width * height);
  for (std::size_t i = 0; i < pixels.size(); ++i) pixels[i] = std::uint16_t(30000 + i);
  png_image image{};
  image.version = PNG_IMAGE_VERSION, image.width = width, image.height = height,
  image.format = PNG_FORMAT_LINEAR_Y;
  std::string bytes(PNG_IMAGE_PNG_SIZE_MAX(image), '\0');
  png_alloc_size_t size = bytes.size();
  ASSERT_TRUE(png_image_write_to_memory(&image, bytes.data(), &size, 0, pixels.data(), 0, nullptr));
  bytes.resize(size);
  GreyFile file(bytes, "a.png");
  ASSERT_EQ(file.pages(), 1u);
  const GreyPicture picture = file.read();
  for (std::size_t i = 0; i < pixels.size(); ++i)
    ASSERT_NEAR(double(picture.values[i]) * 65535., double(pixels[i]), .01);
  for (std::size_t end = 0; end < bytes.size(); ++end)
    EXPECT_THAT(refused([&] { GreyFile(bytes.substr(0, end), "cut.png").read(); }),
                HasSubstr("cut.png: is n"))
        << end;
}

TEST(GreyPicture, WhatIsNoneIsRefused) {
  EXPECT_THAT(refused([] { GreyFile("", "a.tif"); }),
              HasSubstr("a.tif: is neither a PNG nor a TIFF picture"));
  EXPECT_THAT(refused([] { GreyFile("II not a picture at all", "a.tif"); }),
              HasSubstr("a.tif: is no TIFF picture"));
  std::string large = written({});
  const auto at =
      large.find(std::string("\x00\x01\x03\x00\x01\x00\x00\x00\x25", 9));  // its width, a short number
  ASSERT_NE(at, std::string::npos);
  large[at + 2] = 4, large[at + 10] = large[at + 11] = '\x7f';
  EXPECT_THAT(refused([&] { GreyFile(large, "large.tif").read(); }), HasSubstr("pixels, and 1 to"));
}

}  // namespace
}  // namespace forest::io
