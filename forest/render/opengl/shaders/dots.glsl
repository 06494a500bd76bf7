// Small spheres: distant somata, and the beads of branches drawn as dots; one thread a segment.

layout(local_size_x = FOREST_GROUP) in;

void draw_dot(Capsule c, float rank) {
  vec2 p = to_pixel(c.a);
  float r = view.focal * c.ra / lens(c.a.z);
  if (r < 0.6) {  // less than a pixel: drawn for its share of subframes
    if (3.14159 * r * r <= rank) return;
    ivec2 pixel = ivec2(floor(p));
    if (pixel.x >= 0 && pixel.y >= 0 && pixel.x < int(view.width) && pixel.y < int(view.height))
      put(pixel.x, pixel.y, depth_code(c.a.z), payload_of(c.entry, 0.8, rank));
    return;
  }
  int top = max(int(ceil(p.y - r - 0.5)), 0), bottom = min(int(floor(p.y + r - 0.5)), int(view.height) - 1);
  int left = max(int(ceil(p.x - r - 0.5)), 0), right = min(int(floor(p.x + r - 0.5)), int(view.width) - 1);
  for (int y = top; y <= bottom; ++y)
    for (int x = left; x <= right; ++x) {
      vec2 d = (vec2(x, y) + 0.5 - p) / r;
      float h = 1.0 - dot(d, d);
      if (h <= 0.0) continue;
      vec3 normal = vec3(d.x, -d.y, -sqrt(h));
      put(x, y, depth_code(max(c.a.z + c.ra * normal.z, view.near)),
          payload_of(c.entry, 0.5 + 0.5 * dot(normal, light()), noise_at(x, y)));
    }
}

void main() {
  Capsule c;
  if (!fetch_queued(c)) return;
  uint code = texelFetch(queue_seen, int(4u + thread_index())).x;
  uvec4 item = texelFetch(items, int(2u * (code / 64u)));
  float rank = forest_dot_rank(item.x, (c.entry & 7u) == 1u ? 0u : item.y);
  if ((view.flags & FOREST_BALLS) != 0u)  // as ball_rank in frame/constants.h
    rank = float(forest_mixed(code / 64u * FOREST_CLUSTER_SIZE + code % 64u) >> 8) / 16777216.0;
  rank += golden * float(view.subframe);
  float len = distance(c.a, c.b), width = c.ra + c.rb;
  vec3 from = c.a, way = c.b - c.a;
  uint count = 1u;
  if (len > 0.0) {  // of a branch: a string of beads, as in render/cpu/splat.cpp
    float most = min(min(0.5 * len / max(width, 1e-6), 0.5 * len * view.focal / lens(0.5 * (c.a.z + c.b.z))), 16.0);
    count = uint(max(most, 1.0));
    c.ra = sqrt(len * width / (3.14159 * float(count)));
  }
  uint k = 0u;
  do {
    c.a = from + (float(k) + 0.5) / float(count) * way;
    draw_dot(c, fract(rank + float(k) * 0.3819660));
  } while (++k < count);
}
