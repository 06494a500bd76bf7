// SPDX-License-Identifier: Apache-2.0
#include "forest/io/png.h"

#include <png.h>
#include <string>

#include "forest/core/error.h"
#include "forest/core/file.h"

namespace forest::io {

void write_png(const std::filesystem::path& path, std::uint32_t width, std::uint32_t height,
               std::span<const std::uint8_t> pixels) {
  if (pixels.size() != std::size_t(width) * height * 4)
    throw Error("a picture needs width × height × 4 bytes");
  png_image image{};
  image.version = PNG_IMAGE_VERSION;
  image.width = width, image.height = height, image.format = PNG_FORMAT_RGBA;
  image.flags = PNG_IMAGE_FLAG_FAST;
  png_alloc_size_t size = PNG_IMAGE_PNG_SIZE_MAX(image);
  std::vector<std::byte> bytes(size);
  if (!png_image_write_to_memory(&image, bytes.data(), &size, 0, pixels.data(), 0, nullptr))
    throw Error(path.string() + ": the picture cannot be encoded (" + image.message + ")");
  bytes.resize(size);
  write_file(path, bytes);
}

Picture read_png(const std::filesystem::path& path) {
  const MappedFile file(path);
  png_image image{};
  image.version = PNG_IMAGE_VERSION;
  const auto fail = [&] {
    const std::string reason = image.message;
    png_image_free(&image);
    throw InputError(path.string(), 0, "is no PNG picture that can be read (" + reason + "); write it again");
  };
  if (!png_image_begin_read_from_memory(&image, file.bytes().data(), file.bytes().size())) fail();
  image.format = PNG_FORMAT_RGBA;
  image.flags |= PNG_IMAGE_FLAG_16BIT_sRGB;  // as those of 8 bits: the same grey is the same number
  Picture picture{image.width, image.height, std::vector<std::uint8_t>(PNG_IMAGE_SIZE(image))};
  if (!png_image_finish_read(&image, nullptr, picture.pixels.data(), 0, nullptr)) fail();
  return picture;
}

}  // namespace forest::io
