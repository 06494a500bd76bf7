// SPDX-License-Identifier: Apache-2.0
#include "forest/reports/code.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <limits>

namespace forest::reports {
namespace {

constexpr std::size_t groups_of(std::size_t count) { return (count + group_size - 1) / group_size; }
constexpr std::size_t bytes_of(std::size_t bits) { return group_size / 8 * bits; }

/// The codes of a group above its least, `bits` each: byte i holds those of i, i + n, i + 2n …, n being its bytes.
void pack_group(const Code* codes, Code low, unsigned bits, std::byte* out) {
  const std::size_t bytes = bytes_of(bits);
  for (std::size_t i = 0; i < bytes; ++i) {
    unsigned byte = 0;
    for (unsigned part = 0; part < 8 / bits; ++part)
      byte |= unsigned(codes[part * bytes + i] - low) << (part * bits);
    out[i] = std::byte(byte);
  }
}

template <unsigned bits>
void unpack_bits(const std::byte* in, Code low, Code* out) {
  constexpr std::size_t bytes = bytes_of(bits);
  constexpr unsigned mask = (1u << bits) - 1;
  for (unsigned part = 0; part < 8 / bits; ++part)
    for (std::size_t i = 0; i < bytes; ++i)
      out[part * bytes + i] = Code(low + ((unsigned(in[i]) >> (part * bits)) & mask));
}

void unpack_group(const std::byte* in, Code low, unsigned bits, Code* out) {
  switch (bits) {
    case 0:
      std::memset(out, low, group_size);
      break;
    case 1:
      unpack_bits<1>(in, low, out);
      break;
    case 2:
      unpack_bits<2>(in, low, out);
      break;
    case 4:
      unpack_bits<4>(in, low, out);
      break;
    default:
      unpack_bits<8>(in, low, out);
  }
}

constexpr unsigned bits_for(unsigned spread) {
  return spread == 0 ? 0 : spread < 2 ? 1 : spread < 4 ? 2 : spread < 16 ? 4 : 8;
}

}  // namespace

int Range::decimals() const { return std::max(0, int(std::ceil(-std::log10(step()))) + 2); }

float Range::value(Code code) const {
  return code == no_value ? std::numeric_limits<float>::quiet_NaN() : low + float(code) * step();
}

void Range::encode(std::span<const float> values, Code* out) const {
  const float scale = 254.f / (high - low);
  for (std::size_t i = 0; i < values.size(); ++i) {
    const float at = (values[i] - low) * scale + .5f;
    const float held = at < 0.f ? 0.f : at > 254.f ? 254.f : at;
    out[i] = at == at ? Code(int(held)) : no_value;
  }
}

void pack_row(std::span<const Code> codes, std::vector<std::byte>& out) {
  const std::size_t groups = groups_of(codes.size()), head = out.size();
  out.resize(head + groups * (2 + group_size));  // the most it can be
  std::size_t at = head + 2 * groups;
  std::array<Code, group_size> last;
  for (std::size_t g = 0; g < groups; ++g) {
    const Code* group = codes.data() + g * group_size;
    if (const std::size_t left = codes.size() - g * group_size; left < group_size) {
      std::memcpy(last.data(), group, left);
      std::fill(last.begin() + std::ptrdiff_t(left), last.end(), group[left - 1]);
      group = last.data();
    }
    Code low = group[0], high = group[0];
    for (std::size_t i = 1; i < group_size; ++i)
      low = std::min(low, group[i]), high = std::max(high, group[i]);
    const unsigned bits = bits_for(unsigned(high - low));
    out[head + 2 * g] = std::byte(bits == 8 ? 0 : low);
    out[head + 2 * g + 1] = std::byte(bits);
    if (bits) pack_group(group, bits == 8 ? Code(0) : low, bits, &out[at]);
    at += bytes_of(bits);
  }
  out.resize(at);
}

bool is_row(std::span<const std::byte> row, std::size_t count) {
  const std::size_t groups = groups_of(count);
  if (row.size() < 2 * groups) return false;
  std::size_t size = 2 * groups;
  for (std::size_t g = 0; g < groups; ++g) {
    const unsigned bits = unsigned(row[2 * g + 1]);
    if (bits > 8 || (bits & (bits - 1))) return false;
    size += bytes_of(bits);
  }
  return size == row.size();
}

void unpack(std::span<const std::byte> row, std::size_t count, std::size_t first, std::span<Code> out) {
  if (out.empty()) return;
  std::size_t at = 2 * groups_of(count), group = first / group_size;
  for (std::size_t g = 0; g < group; ++g) at += bytes_of(unsigned(row[2 * g + 1]));
  std::array<Code, group_size> part;
  for (std::size_t done = 0; done < out.size(); ++group) {
    const Code low = Code(row[2 * group]);
    const unsigned bits = unsigned(row[2 * group + 1]);
    const std::size_t skip = first + done - group * group_size;
    const std::size_t take = std::min(group_size - skip, out.size() - done);
    if (take == group_size) {
      unpack_group(row.data() + at, low, bits, out.data() + done);
    } else {
      unpack_group(row.data() + at, low, bits, part.data());
      std::memcpy(out.data() + done, part.data() + skip, take);
    }
    at += bytes_of(bits);
    done += take;
  }
}

void raise(std::span<Code> codes, std::span<const Code> others) {
  // One more than each code, in a byte: no_value becomes the least.
  for (std::size_t i = 0; i < codes.size(); ++i)
    codes[i] = Code(std::max(Code(codes[i] + 1), Code(others[i] + 1)) - 1);
}

}  // namespace forest::reports
