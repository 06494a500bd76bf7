// Small spheres (distant somata): one thread a sphere.

layout(local_size_x = FOREST_GROUP) in;

void main() {
  Capsule c;
  if (!fetch_queued(c)) return;
  vec2 p = to_pixel(c.a);
  float r = view.focal * c.ra / lens(c.a.z);
  float rank = fract(float(texelFetch(queue_seen, int(4u + thread_index())).x / 64u) * 0.7548777 + golden * float(view.subframe));
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
