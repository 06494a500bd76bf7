// The farthest key of every tile: what lies wholly behind it cannot be seen. Two levels, 8 × 8 pixels and 64 × 64: one workgroup
// for each of these.

layout(local_size_x = 64) in;

layout(std430, binding = 6) writeonly buffer Depths { float depths[]; };  // of the tiles, µm; infinite where nothing is

shared uint farthest_of_all;

void main() {
  uint wide = (view.width + FOREST_TILE - 1u) / FOREST_TILE, high = (view.height + FOREST_TILE - 1u) / FOREST_TILE;
  uint lane = gl_LocalInvocationID.x;
  uvec2 at = gl_WorkGroupID.xy * FOREST_TILE + uvec2(lane % FOREST_TILE, lane / FOREST_TILE);
  if (lane == 0u) farthest_of_all = 0u;
  barrier();
  if (at.x < wide && at.y < high) {
    uvec2 begin = at * FOREST_TILE, end = min(begin + FOREST_TILE, uvec2(view.width, view.height));
    uint farthest = 0u;
    for (uint y = begin.y; y < end.y; ++y)
      for (uint x = begin.x; x < end.x; ++x) farthest = max(farthest, texelFetch(keys_seen, int(y * view.width + x)).x);
    tiles[at.y * wide + at.x] = farthest;
    depths[at.y * wide + at.x] = farthest == FOREST_KEY_EMPTY ? uintBitsToFloat(0x7f800000u) : depth_of(farthest);
    atomicMax(farthest_of_all, farthest);
  }
  barrier();
  if (lane == 0u) tiles[wide * high + gl_WorkGroupID.y * gl_NumWorkGroups.x + gl_WorkGroupID.x] = farthest_of_all;
}
