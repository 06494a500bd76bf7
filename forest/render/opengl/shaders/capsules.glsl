// Near runs: one thread a segment. A thread draws its segment as a line when it is thin, leaves it
// to a whole workgroup (close_ups.glsl) when it is large, and else draws it alone.

layout(local_size_x = FOREST_GROUP) in;

const float tube_width = 7.0;     // pixels; below, a capsule is shaded by its distance from the axis on screen
const float large_area = 300.0;  // pixels of the rectangle around it

void main() {
  Capsule c;
  if (!fetch_queued(c)) return;
  float width = view.focal * max(c.ra / lens(c.a.z), c.rb / lens(c.b.z));
  if (width < 0.75) {
    draw_line(c);
    return;
  }
  vec2 p = to_pixel(c.a), q = to_pixel(c.b);
  float reach = 1.0 + 1.05 * width;
  float nearest = max(min(c.a.z - c.ra, c.b.z - c.rb), view.near);
  if (hidden(min(p, q) - reach, max(p, q) + reach, nearest, 16u)) return;
  if (2.0 * width < tube_width && distance(p, q) > 0.5 * width) {
    draw_tube(c);
    return;
  }
  vec2 low = max(min(p, q) - reach, vec2(0.0)), high = min(max(p, q) + reach, vec2(view.width, view.height));
  if ((high.x - low.x) * (high.y - low.y) < large_area) {
    draw_capsule(c, 0, 1);
    return;
  }
  uint at = atomicAdd(large_queued, 1u);
  if (at >= uint(large.length())) {  // the queue is full: slower, and still right
    draw_capsule(c, 0, 1);
    return;
  }
  large[at] = texelFetch(queue_seen, int(4u + thread_index())).x;
  atomicMax(large_x, min(at + 1u, 32768u));
  atomicMax(large_y, at / 32768u + 1u);
}
