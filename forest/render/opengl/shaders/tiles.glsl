// The farthest key of every tile: what lies wholly behind it cannot be seen. Two levels, 8 × 8 pixels and 64 × 64.

layout(local_size_x = 64) in;

void main() {
  uint wide = (view.width + FOREST_TILE - 1u) / FOREST_TILE, high = (view.height + FOREST_TILE - 1u) / FOREST_TILE;
  uint coarse_wide = (wide + FOREST_TILE - 1u) / FOREST_TILE, coarse_high = (high + FOREST_TILE - 1u) / FOREST_TILE;
  uint at = gl_GlobalInvocationID.x, farthest = 0u;
  if ((view.flags & FOREST_COARSE) == 0u) {
    if (at >= wide * high) return;
    uint left = at % wide * FOREST_TILE, top = at / wide * FOREST_TILE;
    uint right = min(left + FOREST_TILE, view.width), bottom = min(top + FOREST_TILE, view.height);
    for (uint y = top; y < bottom; ++y)
      for (uint x = left; x < right; ++x) farthest = max(farthest, texelFetch(keys_seen, int(y * view.width + x)).x);
    tiles[at] = farthest;
  } else {
    if (at >= coarse_wide * coarse_high) return;
    uint left = at % coarse_wide * FOREST_TILE, top = at / coarse_wide * FOREST_TILE;
    uint right = min(left + FOREST_TILE, wide), bottom = min(top + FOREST_TILE, high);
    for (uint y = top; y < bottom; ++y)
      for (uint x = left; x < right; ++x) farthest = max(farthest, texelFetch(tiles_seen, int(y * wide + x)).x);
    tiles[wide * high + at] = farthest;
  }
}
