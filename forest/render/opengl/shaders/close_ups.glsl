// Large parts of near runs, which the 64 threads of a workgroup share.

layout(local_size_x = 64) in;

void main() {
  Capsule c;
  uint part;
  if (!fetch_shared(c, part)) return;
  int lane = int(gl_LocalInvocationID.x);
  uint manner = manner_of(c);
  if (manner == as_line)
    draw_line(c, lane, 64);
  else if (manner == as_tube)
    draw_tube(c, lane, 64);
  else
#if FOREST_SQUARE < FOREST_WHOLE
    draw_square(c, part, lane);
#else
    draw_capsule(c, lane, 64);
#endif
}
