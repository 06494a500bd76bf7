// Which items of the band can be seen: those whose sphere is not wholly behind the tiles it covers.

layout(local_size_x = 64) in;

bool hidden(vec4 sphere) {
  vec3 centre = to_camera(sphere.xyz);
  float nearest = centre.z - sphere.w;
  if (nearest <= view.near) return false;
  float reach = view.focal * sphere.w * (view.parallel + view.converge * length(centre) / (centre.z * nearest)) + 2.0;  // as scene/occlusion.cpp
  vec2 at = to_pixel(centre);
  return hidden(at - reach, at + reach, nearest, 64u);
}

void main() {
  uint at = group_index() * 64u + gl_LocalInvocationID.x;
  uint item = view.first_item + at;
  if (at >= view.item_count || hidden(uintBitsToFloat(texelFetch(items, int(2u * item + 1u))))) return;
  uint drawn = texelFetch(items, int(2u * item)).z, count = uint(bitCount(drawn));
  uint place = atomicAdd(queued, count);
  for (uint i = 0u; i < count; ++i, drawn &= drawn - 1u) queue[place + i] = item * 64u + uint(findLSB(drawn));
  uint groups = (place + count + FOREST_GROUP - 1u) / FOREST_GROUP;
  atomicMax(groups_x, min(groups, 32768u));
  atomicMax(groups_y, (groups + 32767u) / 32768u);
}
