// What every shader shares: the buffers, the camera, the key of a pixel, and the drawing of one line.

layout(std140, binding = 0) uniform Picture { Constants view; };
layout(std430, binding = 0) readonly buffer Segments { Segment segments[]; };
layout(std430, binding = 1) readonly buffer Instances { Instance instances[]; };
layout(std430, binding = 2) readonly buffer Items { Item items[]; };
layout(std430, binding = 3) buffer Keys { uint keys[]; };
layout(std430, binding = 4) readonly buffer ColourClasses { uint colour_classes[]; };  // four a word

// Segments of this band's items that are not hidden, one thread each (item * 64 + index), and the workgroups that draw
// them (as glDispatchComputeIndirect reads them).
layout(std430, binding = 8) buffer Queue { uint groups_x, groups_y, groups_z, queued; uint queue[]; };
// Segments so large that a workgroup shares each: item * 64 + index.
layout(std430, binding = 9) buffer LargeQueue { uint large_x, large_y, large_z, large_queued; uint large[]; };
layout(std430, binding = 10) buffer Tiles { uint tiles[]; };  // farthest key of each tile; coarse ones after the fine

const float golden = 0.61803399;

// The capsule of one thread in camera coordinates: x right, y up, z depth.
struct Capsule {
  vec3 a, b;
  float ra, rb;
  uint entry;  // of the palette
  float rank;  // in [0, 1): a line of width w < 1 pixel is drawn when w > rank
};

vec3 to_camera(vec3 world) {
  vec3 d = world - vec3(view.eye_x, view.eye_y, view.eye_z);
  return vec3(dot(d, vec3(view.right_x, view.right_y, view.right_z)), dot(d, vec3(view.up_x, view.up_y, view.up_z)),
              dot(d, vec3(view.forward_x, view.forward_y, view.forward_z)));
}

vec3 turned(vec4 q, vec3 v) { return v + 2.0 * cross(q.xyz, cross(q.xyz, v) + q.w * v); }

vec2 to_pixel(vec3 p) {
  float f = view.focal / p.z;
  return vec2(view.centre_x + f * p.x, view.centre_y - f * p.y);
}

float depth_code(float z) { return clamp((log2(z) + FOREST_DEPTH_BASE) * FOREST_DEPTH_STEPS, 0.0, FOREST_DEPTH_MAX); }

void put(int x, int y, float code, uint payload) {
  uint at = uint(y) * view.width + uint(x);
  uint key = (uint(code) << 12) | payload;
  if (key < keys[at]) atomicMin(keys[at], key);  // the plain look first: most of a dense forest is hidden
}

// Shade 0–1 in five bits, the rounding moved from subframe to subframe so that their mean is smooth.
uint payload_of(uint entry, float shade, float noise) {
  return (entry << 5) | uint(clamp(shade * 31.0 + noise, 0.0, 31.0));
}

float noise_at(int x, int y) {  // interleaved gradient noise (Jimenez 2014), moved by the subframe
  return fract(52.9829189 * fract(0.06711056 * float(x) + 0.00583715 * float(y)) + golden * float(view.subframe));
}

vec3 light() { return vec3(view.light_x, view.light_y, view.light_z); }

// False when nothing of the capsule lies before the eye; otherwise it is cut at the near distance.
bool clip_near(inout Capsule c) {
  if (c.a.z < view.near && c.b.z < view.near) return false;
  if (c.a.z < view.near || c.b.z < view.near) {
    float t = (view.near - c.a.z) / (c.b.z - c.a.z);
    vec3 cut = mix(c.a, c.b, t);
    float r = mix(c.ra, c.rb, t);
    if (c.a.z < view.near) { c.a = cut; c.ra = r; } else { c.b = cut; c.rb = r; }
  }
  return true;
}

uint group_index() { return gl_WorkGroupID.y * 32768u + gl_WorkGroupID.x; }
uint thread_index() { return group_index() * FOREST_GROUP + gl_LocalInvocationID.x; }

bool fetch(uint item_index, uint index, out Capsule c) {
  Item item = items[item_index];
  if (index >= item.segment_count) return false;
  Segment s = segments[item.first_segment + index];
  vec2 radii = unpackHalf2x16(s.radii);
  c.a = vec3(s.ax, s.ay, s.az);
  c.b = vec3(s.bx, s.by, s.bz);
  c.ra = radii.x;
  c.rb = radii.y;
  if ((view.flags & FOREST_OVERLAY) != 0u) {  // overlays: in the world, at least two pixels wide, entry in the meta word
    c.a = to_camera(c.a);
    c.b = to_camera(c.b);
    c.ra = max(c.ra, c.a.z / view.focal);
    c.rb = max(c.rb, c.b.z / view.focal);
    c.entry = s.meta >> 16;
    c.rank = 0.0;
  } else {
    Instance neuron = instances[item.instance];
    vec4 q = vec4(neuron.qx, neuron.qy, neuron.qz, neuron.qw);
    vec3 at = vec3(neuron.x, neuron.y, neuron.z);
    c.a = to_camera(at + turned(q, c.a));
    c.b = to_camera(at + turned(q, c.b));
    uint colour = (colour_classes[item.instance >> 2] >> (8u * (item.instance & 3u))) & 15u;
    c.entry = colour * 8u + (s.meta & 7u);
    c.rank = fract(float((s.meta >> 8) & 255u) / 256.0 + golden * float(view.subframe));
  }
  return clip_near(c);
}

// What this thread has to draw, if anything.
bool fetch_queued(out Capsule c) {
  uint at = thread_index();
  return at < queued && fetch(queue[at] / 64u, queue[at] % 64u, c);
}

// Whether all that lies in a rectangle of pixels, at this depth or behind, is hidden by earlier bands. Looks at no more
// than `most` tiles; a rectangle that needs more is not hidden.
bool hidden(vec2 low, vec2 high, float nearest, uint most) {
  low = max(low, vec2(0.0));
  high = min(high, vec2(view.width, view.height) - 1.0);
  if (low.x > high.x || low.y > high.y) return true;  // beside the picture
  if ((view.flags & FOREST_FIRST_BAND) != 0u || nearest <= view.near) return false;
  uint wide = (view.width + FOREST_TILE - 1u) / FOREST_TILE, tall = (view.height + FOREST_TILE - 1u) / FOREST_TILE, start = 0u;
  uvec2 first = uvec2(low) / FOREST_TILE, last = uvec2(high) / FOREST_TILE, size = last - first + 1u;
  if (size.x * size.y > most) {
    start = wide * tall;
    wide = (wide + FOREST_TILE - 1u) / FOREST_TILE;
    first /= FOREST_TILE;
    last /= FOREST_TILE;
    size = last - first + 1u;
    if (size.x * size.y > 16u * most) return false;
  }
  uint code = uint(depth_code(nearest)) << 12;
  for (uint y = first.y; y <= last.y; ++y)
    for (uint x = first.x; x <= last.x; ++x)
      if (tiles[start + y * wide + x] >= code) return false;
  return true;
}

float width_in_pixels(Capsule c) { return view.focal * (c.ra / c.a.z + c.rb / c.b.z); }

// A line of whole pixels across its major axis. Every column (or row) between the ends is covered once, ends half open,
// so joined segments neither overlap nor gap; the area drawn is, on the mean over ranks, the true area.
void draw_line(Capsule c) {
  vec2 p = to_pixel(c.a), q = to_pixel(c.b);
  vec2 d = q - p;
  bool steep = abs(d.y) > abs(d.x);
  float major = max(abs(d.x), abs(d.y));
  float width = width_in_pixels(c) * (major > 0.0 ? length(d) / major : 1.0);
  int thickness = int(width + 1.0 - c.rank - 1.0 / 512.0);
  if (thickness < 1) return;
  if (hidden(min(p, q) - 0.5 * width, max(p, q) + 0.5 * width, min(c.a.z, c.b.z), 6u)) return;

  float za = depth_code(c.a.z), zb = depth_code(c.b.z);
  if (steep) { p = p.yx; q = q.yx; }
  if (p.x > q.x) { vec2 swap = p; p = q; q = swap; float z = za; za = zb; zb = z; }
  int limit_x = int(steep ? view.height : view.width), limit_y = int(steep ? view.width : view.height);
  int first = max(int(ceil(p.x - 0.5)), 0), last = min(int(ceil(q.x - 0.5)), limit_x);
  if (first >= last) return;

  vec3 tangent = normalize(c.b - c.a + vec3(1e-9));
  float along = dot(tangent, light());
  float shade = 0.35 + 0.6 * sqrt(max(0.0, 1.0 - along * along));
  uint payload = payload_of(c.entry, shade, fract(c.rank * 7.0));
  float slope = (q.y - p.y) / (q.x - p.x), rise = (zb - za) / (q.x - p.x);
  float y = p.y + (float(first) + 0.5 - p.x) * slope - 0.5 * float(thickness - 1);
  float z = za + (float(first) + 0.5 - p.x) * rise;
  for (int x = first; x < last; ++x) {
    int low = max(int(floor(y)), 0), high = min(int(floor(y)) + thickness, limit_y);
    for (int across = low; across < high; ++across) put(steep ? across : x, steep ? x : across, z, payload);
    y += slope;
    z += rise;
  }
}
