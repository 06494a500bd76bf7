// A picture of nothing.

layout(local_size_x = 64) in;

void main() {
  uint x = gl_GlobalInvocationID.x;
  if (x < view.width) keys[gl_GlobalInvocationID.y * view.width + x] = FOREST_KEY_EMPTY;
}
