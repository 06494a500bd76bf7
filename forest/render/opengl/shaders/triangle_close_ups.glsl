// Squares of large triangles: one workgroup each, its 64 threads share the pixels.

layout(local_size_x = 64) in;

void main() {
  uint code, part;
  if (!shared_code(code, part)) return;
  Facet f = fetch_facet(code);
  Squares s = squares_of(f.low, f.high);
  ivec2 low = low_of(s, part);
  draw_facet(f, low, min(low + s.edge, s.high), int(gl_LocalInvocationID.x), 8);
}
