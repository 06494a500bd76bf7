// Surfaces: one thread a triangle. It leaves large ones to a whole workgroup (triangle_close_ups.glsl).

layout(local_size_x = FOREST_GROUP) in;

const int large_area = 300;  // pixels of the rectangle around it

void main() {
  uint at = thread_index();
  if (at >= view.item_count) return;
  Facet f = fetch_facet(at);
  if (!f.seen) return;
  ivec2 size = f.high - f.low;
  if (size.x * size.y >= large_area) {
    uint place = atomicAdd(large_queued, 1u);
    if (place < uint(large.length())) {
      large[place] = at;
      atomicMax(large_x, min(place + 1u, 32768u));
      atomicMax(large_y, place / 32768u + 1u);
      return;
    }  // the queue is full: slower, and still right
  }
  draw_facet(f, 0, 1);
}
