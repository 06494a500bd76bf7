// Thin runs: one thread a segment. It leaves long ones to workgroups (long_lines.glsl).

layout(local_size_x = FOREST_GROUP) in;

void main() {
  Capsule c;
  bool drawn = fetch_queued(c);
  uint parts = drawn ? parts_of(c) : 0u, at = places_for(parts);
  if (drawn && !shared_by_groups(queued_code(), parts, at)) draw_line(c, 0, 1);
}
