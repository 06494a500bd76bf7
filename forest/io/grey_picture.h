// SPDX-License-Identifier: Apache-2.0
// Grey values of pictures of sections: PNG and TIFF, with all the bits that they have.
#pragma once

#include <cstdint>
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

/// How many pictures a file has: 1 of a PNG, the pages of a TIFF. Throws InputError.
std::size_t pages_of(std::string_view bytes, const std::string& name);

/// A page. Colours become grey by their luminance (ITU-R BT.709), opacity is left out. Of TIFF 6.0 (Adobe 1992) all that libtiff
/// unpacks: strips and tiles, grey of 8, 16 and 32 bits and floats, colours of 8 and 16 bits, palettes, JPEG.
/// Throws InputError: no such picture, damaged, of more than 2²⁸ pixels.
GreyPicture read_grey(std::string_view bytes, const std::string& name, std::size_t page = 0);

}  // namespace forest::io
