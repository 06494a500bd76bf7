// SPDX-License-Identifier: Apache-2.0
#include "forest/geometry/weld.h"

#include <bit>
#include <unordered_map>

namespace forest {
namespace {

using Bits = std::array<std::uint32_t, 3>;

struct Hash {
  std::size_t operator()(const Bits& bits) const {
    std::uint64_t h = 0x9e3779b97f4a7c15u;
    for (const std::uint32_t x : bits) h = (h ^ x) * 0xff51afd7ed558ccdu, h ^= h >> 29;
    return std::size_t(h);
  }
};

Bits bits_of(const Vec3& at) {
  Bits bits;
  for (std::size_t a = 0; a < 3; ++a)
    bits[a] = std::bit_cast<std::uint32_t>(at[Eigen::Index(a)] + 0.f);  // minus zero is zero
  return bits;
}

}  // namespace

Mesh welded(const Mesh& mesh) {
  Mesh result;
  std::unordered_map<Bits, std::uint32_t, Hash> known;
  std::vector<std::uint32_t> now;  // its number, of each vertex
  now.reserve(mesh.positions.size());
  for (std::size_t v = 0; v < mesh.positions.size(); ++v) {
    const auto [at, fresh] =
        known.try_emplace(bits_of(mesh.positions[v]), std::uint32_t(result.positions.size()));
    now.push_back(at->second);
    if (!fresh) continue;
    result.positions.push_back(mesh.positions[v]);
    if (v < mesh.labels.size()) result.labels.push_back(mesh.labels[v]);
  }
  for (const Triangle& old : mesh.triangles)
    if (const Triangle t{now[old[0]], now[old[1]], now[old[2]]}; t[0] != t[1] && t[1] != t[2] && t[2] != t[0])
      result.triangles.push_back(t);
  return result;
}

Mesh welded_if_open(Mesh mesh) {
  if (is_closed(mesh)) return mesh;
  Mesh together = welded(mesh);
  return is_closed(together) ? together : mesh;
}

}  // namespace forest
