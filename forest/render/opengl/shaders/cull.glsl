// Which items of the band can be seen: those whose sphere is not wholly behind the tiles it covers.

layout(local_size_x = 64) in;

bool hidden(Item item) {
  vec3 centre = to_camera(vec3(item.x, item.y, item.z));
  float nearest = centre.z - item.radius;
  if (nearest <= view.near) return false;
  float reach = view.focal * item.radius / nearest + 2.0;
  vec2 at = to_pixel(centre);
  return hidden(at - reach, at + reach, nearest, 64u);
}

void main() {
  uint at = gl_GlobalInvocationID.x;
  if (at >= view.item_count || hidden(items[view.first_item + at])) return;
  uint item = view.first_item + at, count = items[item].segment_count;
  uint place = atomicAdd(queued, count);
  for (uint i = 0u; i < count; ++i) queue[place + i] = item * 64u + i;
  uint groups = (place + count + FOREST_GROUP - 1u) / FOREST_GROUP;
  atomicMax(groups_x, min(groups, 32768u));
  atomicMax(groups_y, (groups + 32767u) / 32768u);
}
