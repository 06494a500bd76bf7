// Near runs: one thread a segment. It draws what is small alone, and leaves the rest to workgroups (close_ups.glsl).

layout(local_size_x = FOREST_GROUP) in;

bool hidden(Capsule c) {
  vec2 p = to_pixel(c.a), q = to_pixel(c.b), r = reaches(c);
  return hidden(min(p - r.x, q - r.y), max(p + r.x, q + r.y), max(min(c.a.z - c.ra, c.b.z - c.rb), view.near), 16u);
}

void main() {
  Capsule c;
  bool drawn = fetch_queued(c);
  uint manner = 0u, parts = 0u;
  if (drawn) {
    manner = manner_of(c);
    drawn = manner == as_line || !hidden(c);
    if (drawn && manner == as_solid) {
      Squares s = squares_of(c);
      drawn = all(lessThan(s.low, s.high));  // else beside the picture, and still along all of it
      parts = parts_of(s);
    } else if (drawn) {
      parts = parts_of(c);
    }
  }
  uint at = places_for(parts);
  if (!drawn || shared_by_groups(queued_code(), parts, at)) return;
  if (manner == as_line)
    draw_line(c, 0, 1);
  else if (manner == as_tube)
    draw_tube(c, 0, 1);
  else
    draw_capsule(c, 0, 1);
}
