// Large triangles: one workgroup each, its 64 threads share the rows.

layout(local_size_x = 64) in;

void main() {
  if (group_index() >= min(large_queued, uint(large.length()))) return;
  draw_facet(fetch_facet(texelFetch(large_seen, int(4u + group_index())).x), int(gl_LocalInvocationID.x), 64);
}
