// Thin runs: one thread a segment.

layout(local_size_x = FOREST_GROUP) in;

void main() {
  Capsule c;
  if (fetch_queued(c)) draw_line(c);
}
