// Large segments: one workgroup each, its 64 threads share the scan lines.

layout(local_size_x = 64) in;

void main() {
  Capsule c;
  if (group_index() >= min(large_queued, uint(large.length()))) return;
  uint entry = texelFetch(large_seen, int(4u + group_index())).x;
  if (fetch(entry / 64u, entry % 64u, c)) draw_capsule(c, int(gl_LocalInvocationID.x), 64);
}
