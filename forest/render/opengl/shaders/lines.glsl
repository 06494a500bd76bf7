// Thin runs: one workgroup an item, one thread a segment.

layout(local_size_x = 64) in;

void main() {
  Capsule c;
  if (group_index() < queued && fetch(queue[group_index()], gl_LocalInvocationID.x, c)) draw_line(c);
}
