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
  uint place = atomicAdd(queued, 1u);
  queue[place] = view.first_item + at;
  uint group = (view.flags & FOREST_DOTS) != 0u ? place / 64u : place;
  atomicMax(groups_x, min(group + 1u, 32768u));
  atomicMax(groups_y, group / 32768u + 1u);
}
