// Long thin segments, which the 64 threads of a workgroup share.

layout(local_size_x = 64) in;

void main() {
  Capsule c;
  uint part;
  if (fetch_shared(c, part)) draw_line(c, int(gl_LocalInvocationID.x), 64);
}
