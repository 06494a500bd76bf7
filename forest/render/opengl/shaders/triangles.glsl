// Surfaces: one thread a triangle. It leaves large ones to workgroups (triangle_close_ups.glsl).

layout(local_size_x = FOREST_GROUP) in;

void main() {
  uint number = thread_index(), parts = 0u;
  Facet f;
  f.seen = false;
  if (number < view.item_count) f = fetch_facet(number);
  if (f.seen) parts = parts_of(squares_of(f.low, f.high));
  uint at = places_for(parts);
  if (f.seen && !shared_by_groups(number, parts, at)) draw_facet(f, f.low, f.high, 0, 1);
}
