// SPDX-License-Identifier: Apache-2.0
// Grey values of pictures of sections: PNG and TIFF, with all the bits that they have.
#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

namespace forest::io {

struct GreyPicture {
  std::uint32_t width = 0, height = 0;
  std::vector<float> values;  // rows from the top, 0 black to 1 white; of a TIFF of floats, as they are
};

/// What a file of pictures may be called, in small letters.
bool is_picture_name(std::string_view extension);  // ".tif"

/// A file of one picture (PNG) or of many pages (TIFF). Its bytes must outlive it.
class GreyFile {
 public:
  /// Throws InputError when it is neither.
  GreyFile(std::string_view bytes, const std::string& name);
  ~GreyFile();
  GreyFile(const GreyFile&) = delete;
  GreyFile& operator=(const GreyFile&) = delete;

  std::size_t pages() const;
  /// A page; in their order is fastest. Colours become grey by their luminance (ITU-R BT.709), opacity is left out. Of TIFF 6.0
  /// (Adobe 1992) all that libtiff unpacks: strips and tiles, grey of 8, 16 and 32 bits (what has a sign is -1 to 1) and
  /// floats, colours of 8 and 16 bits, palettes, JPEG, upright and turned by half.
  /// Throws InputError: no such page, damaged, of more than 2²⁸ pixels, lying on its side.
  GreyPicture read(std::size_t page = 0);

 private:
  class Pages;
  std::unique_ptr<Pages> pages_;
};

}  // namespace forest::io
