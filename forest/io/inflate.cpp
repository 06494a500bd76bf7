// SPDX-License-Identifier: Apache-2.0
#include "forest/io/inflate.h"

#include <algorithm>
#include <array>
#include <zlib.h>

#include "forest/core/error.h"

namespace forest::io {

std::string inflated(std::string_view bytes, std::size_t most, const std::string& name) {
  z_stream stream{};
  if (inflateInit2(&stream, 15 + 32) != Z_OK) throw Error("there is too little memory to unpack a file");
  struct End {
    z_stream& stream;
    ~End() { inflateEnd(&stream); }
  } end{stream};
  std::string result;
  std::array<char, 1 << 16> piece;
  constexpr std::string_view gzip = "\x1f\x8b";
  const bool of_members = bytes.starts_with(gzip);
  constexpr std::size_t step = 1u << 30;  // zlib counts in 32 bits
  for (int state = Z_OK; state != Z_STREAM_END;) {
    if (stream.avail_in == 0) {
      const std::size_t taken = std::min(bytes.size(), step);
      // zlib reads through a pointer that is not const for old compilers' sake.
      stream.next_in = reinterpret_cast<Bytef*>(const_cast<char*>(bytes.data()));
      stream.avail_in = uInt(taken);
      bytes.remove_prefix(taken);
    }
    stream.next_out = reinterpret_cast<Bytef*>(piece.data());
    stream.avail_out = uInt(piece.size());
    state = inflate(&stream, Z_NO_FLUSH);
    result.append(piece.data(), piece.size() - stream.avail_out);
    if (result.size() > most)
      throw InputError(name, 0, "unpacks to more than it says it holds; it is broken, get it again");
    if (state == Z_STREAM_END) {
      bytes = {reinterpret_cast<const char*>(stream.next_in), stream.avail_in + bytes.size()};
      if (bytes.find_first_not_of('\0') == bytes.npos) break;  // padding, of tapes
      if (!of_members || !bytes.starts_with(gzip))
        throw InputError(name, 0, "holds other bytes after its packed ones; get the file again");
      inflateReset(&stream);
      stream.avail_in = 0, state = Z_OK;
      continue;
    }
    if (state != Z_OK && state != Z_BUF_ERROR)
      throw InputError(name, 0, "its packed bytes are broken; get the file again");
    if (stream.avail_in == 0 && bytes.empty() && stream.avail_out != 0)
      throw InputError(name, 0, "its packed bytes are cut off; get the whole file");
  }
  return result;
}

}  // namespace forest::io
