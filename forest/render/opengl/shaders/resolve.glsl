// From keys to colour: palette × shade, a dark rim where something nearer stands beside (after eye-dome lighting,
// Boucheny 2009), fog, the mean over subframes, sRGB.

layout(local_size_x = 64) in;

layout(std430, binding = 1) buffer Sums { float sums[]; };               // four floats a pixel
layout(std430, binding = 2) writeonly buffer Output { uint image[]; };

float depth_at(int x, int y) {
  x = clamp(x, 0, int(view.width) - 1);
  y = clamp(y, 0, int(view.height) - 1);
  return float(texelFetch(keys_seen, int(uint(y) * view.width + uint(x))).x >> 12) / FOREST_DEPTH_STEPS;  // octaves
}

// As frame::glass_depth; 1e30 where the ray does not meet the glass.
float glass_depth(vec2 pixel) {
  vec2 beside = vec2(pixel.x - view.centre_x, view.centre_y - pixel.y) / view.focal;
  float across = dot(vec2(view.glass_x, view.glass_y), beside);
  float z = (view.glass_at - view.parallel * across) / (view.converge * across + view.glass_z);
  if (!(z > view.near)) return 1e30;
  float wide = view.converge * z + view.parallel;
  float right = wide * dot(vec2(view.glass_right_x, view.glass_right_y), beside) + view.glass_right_z * z;
  float up = wide * dot(vec2(view.glass_up_x, view.glass_up_y), beside) + view.glass_up_z * z;
  return right >= view.glass_left_edge && right <= view.glass_right_edge && up >= view.glass_low_edge && up <= view.glass_high_edge ? z : 1e30;
}

float srgb(float c) {
  c = clamp(c, 0.0, 1.0);
  return c <= 0.0031308 ? 12.92 * c : 1.055 * pow(c, 1.0 / 2.4) - 0.055;
}

void main() {
  uint x = gl_GlobalInvocationID.x, y = gl_GlobalInvocationID.y;
  if (x >= view.width) return;
  uint at = y * view.width + x;
  uint key = texelFetch(keys_seen, int(at)).x;
  vec3 colour = mix(vec3(view.top_red, view.top_green, view.top_blue),
                    vec3(view.bottom_red, view.bottom_green, view.bottom_blue), (float(y) + 0.5) / float(view.height));
  float covered = 0.0;
  if (key != FOREST_KEY_EMPTY) {
    covered = 1.0;
    uint entry = (key >> 5) & 127u;
    float shade = float(key & 31u) / 31.0;
    float octave = float(key >> 12) / FOREST_DEPTH_STEPS, z = exp2(octave - FOREST_DEPTH_BASE);
    int ix = int(x), iy = int(y);
    float rim = 0.0;
    int count = view.halo > 0.0 ? 8 : 1, i = 0;
    do {
      int sign = 1 - 2 * (i & 1);
      ivec2 to = i < 2 ? ivec2(sign, 0) : i < 4 ? ivec2(0, sign) : ivec2(2 * sign, i < 6 ? 2 : -2);
      rim += clamp((octave - depth_at(ix + to.x, iy + to.y)) * 40.0, 0.0, 1.0);
    } while (++i < count);
    rim *= view.halo / 8.0;
    vec3 base = texelFetch(palette, int(entry)).rgb;
    float fog = 1.0 - exp(-max(0.0, z - view.fog_start) / view.fog_length);
    colour = mix(base * (0.16 + 1.05 * shade * shade) * exp(-1.1 * rim), vec3(view.fog_red, view.fog_green, view.fog_blue), fog);
  }
  if (view.glass_opacity > 0.0) {
    float z = key == FOREST_KEY_EMPTY ? 1e29 : depth_of(key);
    if (glass_depth(vec2(x, y) + 0.5) < z) colour = mix(colour, vec3(view.glass_red, view.glass_green, view.glass_blue), view.glass_opacity);
  }
  vec4 sum = vec4(colour, covered);
  if (view.subframe > 0u) sum += vec4(sums[at * 4u], sums[at * 4u + 1u], sums[at * 4u + 2u], sums[at * 4u + 3u]);
  if (view.subframe + 1u < view.subframes) {
    sums[at * 4u] = sum.x;
    sums[at * 4u + 1u] = sum.y;
    sums[at * 4u + 2u] = sum.z;
    sums[at * 4u + 3u] = sum.w;
  }
  if (view.subframe + 1u < view.last_subframe) return;
  sum /= float(view.subframe + 1u);
  vec3 c = sum.xyz * view.exposure;
  uvec3 b = uvec3(255.0 * vec3(srgb(c.x), srgb(c.y), srgb(c.z)) + noise_at(int(x), int(y)));  // no bands in a dark sky
  image[at] = b.x | (b.y << 8) | (b.z << 16) | (uint(255.0 * sum.w + 0.5) << 24);
}
