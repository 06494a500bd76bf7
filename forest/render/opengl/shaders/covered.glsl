// How much of every row shows something, in 255ths of a pixel: one workgroup a row.

layout(local_size_x = 64) in;

layout(std430, binding = 2) readonly buffer Output { uint image[]; };
layout(std430, binding = 1) writeonly buffer Rows { uint rows[]; };

shared uint sum;

void main() {
  uint lane = gl_LocalInvocationID.x, row = gl_WorkGroupID.x, mine = 0u;
  if (lane == 0u) sum = 0u;
  barrier();
  for (uint x = lane; x < view.width; x += 64u) mine += image[row * view.width + x] >> 24;
  atomicAdd(sum, mine);
  barrier();
  if (lane == 0u) rows[row] = sum;
}
