// What every shader shares: the buffers, the camera, the key of a pixel, and the drawing of one line.

layout(std140, binding = 0) uniform Picture { Constants view; };
// What is only read comes as texels: llvmpipe gathers them for eight threads at once, and loads from storage buffers one by one.
layout(binding = 0) uniform usamplerBuffer segments;        // two a Segment
layout(binding = 1) uniform usamplerBuffer instances;       // two an Instance
layout(binding = 2) uniform usamplerBuffer items;           // two an Item
layout(binding = 3) uniform usamplerBuffer keys_seen;       // a pixel: perhaps an older and so a farther key
layout(binding = 4) uniform usamplerBuffer states;          // an instance: colour class, kind, opacity, flags
layout(binding = 5) uniform samplerBuffer palette;          // linear, and 0–255 for its opacity
layout(binding = 6) uniform usamplerBuffer queue_seen;
layout(binding = 7) uniform usamplerBuffer large_seen;
layout(binding = 8) uniform usamplerBuffer tiles_seen;
layout(binding = 10) uniform usamplerBuffer owners;         // of the straws, which are the last segments: instance, segment
layout(binding = 9) uniform usamplerBuffer entries;         // of this list's segments, where FOREST_ENTRIES

layout(std430, binding = 0) buffer Keys { uint keys[]; };
// Segments of this band's items that are not hidden, one thread each (item * 64 + index), and the workgroups that draw
// them (as glDispatchComputeIndirect reads them).
layout(std430, binding = 3) buffer Queue { uint groups_x, groups_y, groups_z, queued; uint queue[]; };
// What workgroups share, two numbers each: item * 64 + index, and which part of it.
layout(std430, binding = 4) buffer LargeQueue { uint large_x, large_y, large_z, large_queued; uint large[]; };
layout(std430, binding = 5) writeonly buffer Tiles { uint tiles[]; };  // farthest key of each tile; coarse ones after the fine

#define FOREST_WHOLE 32768  // pixels: wider than any picture
const uint FOREST_NOBODY = 0xffffffffu;
const float golden = 0.61803399;

// The capsule of one thread in camera coordinates: x right, y up, z depth.
struct Capsule {
  vec3 a, b;
  float ra, rb;
  uint entry;  // of the palette
  float rank;  // in [0, 1): a branch of width w < 1 pixel is drawn when w > rank
  float mean;  // radius of its branch; 0: as its own
  bool straw;
};

vec3 to_camera(vec3 world) {
  vec3 d = world - vec3(view.eye_x, view.eye_y, view.eye_z);
  return vec3(dot(d, vec3(view.right_x, view.right_y, view.right_z)), dot(d, vec3(view.up_x, view.up_y, view.up_z)),
              dot(d, vec3(view.forward_x, view.forward_y, view.forward_z)));
}

vec3 turned(vec4 q, vec3 v) { return v + 2.0 * cross(q.xyz, cross(q.xyz, v) + q.w * v); }

// What a length at this depth is divided by to be seen.
float lens(float z) { return view.converge * z + view.parallel; }

vec3 towards_eye(vec3 p) { return -normalize(vec3(view.converge * p.xy, p.z)); }

vec2 to_pixel(vec3 p) {
  float f = view.focal / lens(p.z);
  return vec2(view.centre_x + f * p.x, view.centre_y - f * p.y);
}

float depth_code(float z) { return clamp((log2(z) + FOREST_DEPTH_BASE) * FOREST_DEPTH_STEPS, 0.0, FOREST_DEPTH_MAX); }

float depth_of(uint key) { return exp2(float(key >> 12) / FOREST_DEPTH_STEPS - FOREST_DEPTH_BASE); }

uint key_of(float code, uint payload) { return (uint(code) << 12) | payload; }

#ifdef FOREST_DOOR  // a program for pictures with something transparent: what this thread draws is
uint door_opacity = 255u, door_key = 0u;

// Whether a screen door with that key is open at a pixel.
bool open_at(uint pixel) {
  return door_opacity == 255u || forest_shows(door_opacity, door_key ^ forest_mixed(pixel), view.subframe);
}
#endif

void put(int x, int y, float code, uint payload) {
  uint at = uint(y) * view.width + uint(x), key = key_of(code, payload);
#ifdef FOREST_DOOR
  if (!open_at(at)) return;
#endif
  if (key < texelFetch(keys_seen, int(at)).x) atomicMin(keys[at], key);  // the plain look first: most of a dense forest is hidden
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
  uvec4 item = texelFetch(items, int(2u * item_index));  // instance, first segment, which, state
  if ((item.z >> index & 1u) == 0u) return false;
  uvec4 at_a = texelFetch(segments, int(2u * (item.y + index))), at_b = texelFetch(segments, int(2u * (item.y + index) + 1u));
  vec2 radii = unpackHalf2x16(at_a.w);
  uint meta = at_b.w;
  c.a = uintBitsToFloat(at_a.xyz);
  c.b = uintBitsToFloat(at_b.xyz);
  c.ra = radii.x;
  c.rb = radii.y;
  c.straw = item.x == FOREST_IN_WORLD && (view.flags & FOREST_OVERLAY) == 0u;
  if ((view.flags & FOREST_OVERLAY) != 0u) {  // in the world, entry in the meta word
    c.a = to_camera(c.a);
    c.b = to_camera(c.b);
    if ((view.flags & FOREST_BALLS) == 0u) {  // at least two pixels wide
      c.ra = max(c.ra, lens(c.a.z) / view.focal);
      c.rb = max(c.rb, lens(c.b.z) / view.focal);
    }
    c.entry = meta >> 16;
#ifdef FOREST_DOOR
    if ((view.flags & FOREST_BALLS) != 0u) {
      door_opacity = meta >> 8 & 255u;
      door_key = forest_mixed(item.y + index ^ 0x6a09e667u);  // as ball_key in frame/constants.h
      if (view.subframes >= FOREST_DOOR_SUBFRAMES && door_opacity < 255u) {
        if (!forest_shows(door_opacity, door_key, view.subframe)) return false;
        door_opacity = 255u;
      }
    }
#endif
    c.rank = 0.0;
    c.mean = 0.0;
  } else {
    if (item.x == FOREST_IN_WORLD) {
      c.a = to_camera(c.a);
      c.b = to_camera(c.b);
      item.x = texelFetch(owners, int(item.y + index) - (textureSize(segments) / 2 - textureSize(owners))).x;
    } else {
      vec3 at = uintBitsToFloat(texelFetch(instances, int(2u * item.x)).xyz);
      vec4 q = uintBitsToFloat(texelFetch(instances, int(2u * item.x + 1u)));
      c.a = to_camera(at + turned(q, c.a));
      c.b = to_camera(at + turned(q, c.b));
    }
    c.mean = unpackHalf2x16(meta >> 16).x;
    uvec4 state = item.w == 0u ? texelFetch(states, int(item.x)) : (uvec4(item.w) >> uvec4(0u, 8u, 16u, 24u)) & 255u;
    c.entry = state.x * 8u + (meta & 7u);
#ifdef FOREST_DOOR
    door_opacity = (state.z * uint(texelFetch(palette, int(c.entry)).w) + 127u) / 255u;
    door_key = forest_branch_key(item.x, meta);
    if (view.subframes >= FOREST_DOOR_SUBFRAMES && door_opacity < 255u) {  // as a whole, or not at all
      if (!forest_shows(door_opacity, door_key, view.subframe)) return false;
      door_opacity = 255u;
    }
#endif
    if ((view.flags & FOREST_ENTRIES) != 0u)
      c.entry = texelFetch(entries, int((view.flags & FOREST_SINGLE) != 0u ? item_index : item_index * FOREST_CLUSTER_SIZE + index)).x;
    // Which lines are drawn for their like does not change from sample to sample.
    c.rank = fract(float((meta >> 8) & 255u) / 256.0 + golden * float(view.thinnest > 0.0 ? 0u : view.subframe));
  }
  if (!clip_near(c)) return false;
  if ((view.flags & FOREST_OVERLAY) == 0u && !c.straw) {
    c.ra = max(c.ra, view.least_radius * lens(c.a.z) / view.focal);
    c.rb = max(c.rb, view.least_radius * lens(c.b.z) / view.focal);
  }
  return true;
}

// What this thread has to draw, if anything.
bool fetch_queued(out Capsule c) {
  uint at = thread_index(), entry = texelFetch(queue_seen, int(4u + at)).x;
  return at < queued && fetch(entry / 64u, entry % 64u, c);
}

// Of the queue for workgroups so many places in a row, and the first of them: every thread of a workgroup must ask, also for
// none. A card is asked once for all of them, since it counts one after the other.
#if FOREST_ASK_TOGETHER
shared uint places_wanted, first_place;
#endif
uint places_for(uint parts) {
#if FOREST_ASK_TOGETHER
  if (gl_LocalInvocationIndex == 0u) places_wanted = 0u;
  barrier();
  uint mine = parts == 0u ? 0u : atomicAdd(places_wanted, parts);
  barrier();
  if (gl_LocalInvocationIndex == 0u && places_wanted > 0u) first_place = atomicAdd(large_queued, places_wanted);
  barrier();
  uint at = first_place + mine, end = first_place + places_wanted;
  bool asked = gl_LocalInvocationIndex == 0u && places_wanted > 0u;
#else
  uint at = parts == 0u ? 0u : atomicAdd(large_queued, parts), end = at + parts;
  bool asked = parts > 0u;
#endif
  if (asked) {
    end = min(end, uint(large.length()) / 2u);
    atomicMax(large_x, min(end, 32768u));
    atomicMax(large_y, (end + 32767u) / 32768u);
  }
  return at;
}

// Leaves to workgroups, in so many parts, what is too much for one thread. False when it is for one, or there is no room: then it
// is slower alone, and still right.
bool shared_by_groups(uint code, uint parts, uint at) {
  if (parts == 0u) return false;
  uint room = uint(large.length()) / 2u, end = min(at + parts, room);
  bool all = at + parts <= room;
  for (uint i = at; i < end; ++i) {
    large[2u * i] = all ? code : FOREST_NOBODY;
    large[2u * i + 1u] = i - at;
  }
  return all;
}

// What this workgroup shares, and which part of it; false where there is nothing.
bool shared_code(out uint code, out uint part) {
  uint at = group_index();
  if (at >= min(large_queued, uint(large.length()) / 2u)) return false;
  code = texelFetch(large_seen, int(4u + 2u * at)).x;
  part = texelFetch(large_seen, int(5u + 2u * at)).x;
  return code != FOREST_NOBODY;
}
bool fetch_shared(out Capsule c, out uint part) {
  uint code;
  return shared_code(code, part) && fetch(code / 64u, code % 64u, c);
}

// What it is called in the queues.
uint queued_code() { return texelFetch(queue_seen, int(4u + thread_index())).x; }

// Pixels [low, high), and the squares, in rows, by which workgroups share them.
struct Squares {
  ivec2 low, high, count;
  int edge;
};

Squares squares_of(ivec2 low, ivec2 high) {
  Squares s = Squares(low, high, ivec2(0), FOREST_SQUARE / 2);
  do {
    s.edge *= 2;
    s.count = (s.high - s.low + s.edge - 1) / s.edge;
  } while (s.count.x * s.count.y > 256);
  return s;
}

ivec2 low_of(Squares s, uint which) { return s.low + s.edge * ivec2(int(which) % s.count.x, int(which) / s.count.x); }
// In how many parts workgroups draw them; 0: one thread does.
uint parts_of(Squares s) {
  ivec2 size = s.high - s.low;
  return size.x * size.y < FOREST_ALONE_AREA ? 0u : uint(s.count.x * s.count.y);
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
  // One loop, tested at its end: llvmpipe goes through a loop's body once more than its slowest thread asks for.
  uvec2 at = first;
  bool seen;
  do {
    seen = texelFetch(tiles_seen, int(start + at.y * wide + at.x)).x >= code;
    if (++at.x > last.x) at = uvec2(first.x, at.y + 1u);
  } while (!seen && at.y <= last.y);
  return !seen;
}

// The same of a segment, by the steps that it takes along its major axis within the picture.
uint parts_of(Capsule c) {
  vec2 edge = vec2(view.width, view.height);
  vec2 d = abs(clamp(to_pixel(c.a), vec2(0.0), edge) - clamp(to_pixel(c.b), vec2(0.0), edge));
  return max(d.x, d.y) > FOREST_ALONE_STEPS ? 1u : 0u;
}

float width_in_pixels(Capsule c) { return view.focal * (c.ra / lens(c.a.z) + c.rb / lens(c.b.z)); }

// What stands right before the eye reaches far beyond the picture.
int clipped(float x, int limit) { return int(clamp(ceil(x), 0.0, float(limit))); }

// A line across its major axis, every column (or row) between the ends once, ends half open, so that joined segments neither
// overlap nor gap. With several subframes a pixel is drawn where its centre lies within the line: the mean is its true
// coverage. A single one draws lines of whole pixels, by rank: the area drawn is, on the mean over ranks, the true area.
// This thread draws the steps lane, lane + lanes, …
void draw_line(Capsule c, int lane, int lanes) {
  vec2 p = to_pixel(c.a), q = to_pixel(c.b);
  vec2 d = q - p;
  float thinnest = c.straw ? FOREST_STRAW_WIDTH * view.thinnest : view.thinnest, shortest = FOREST_STRAW_LENGTH * view.thinnest;
  float drawn_length = length(d), shorter = 1.0;
  if (c.straw && drawn_length < shortest) {
    shorter = drawn_length / shortest;
    d = drawn_length > 1e-3 ? d / shorter : vec2(shortest, 0.0);
    vec2 middle = 0.5 * (p + q);
    p = middle - 0.5 * d;
    q = middle + 0.5 * d;
  }
  bool steep = abs(d.y) > abs(d.x);
  float major = max(abs(d.x), abs(d.y));
  float stretch = major > 0.0 ? length(d) / major : 1.0;
  float width = width_in_pixels(c) * stretch;
  float rank = c.rank + 1.0 / 512.0;
  bool single = view.subframes == 1u;
  if (width < thinnest && c.mean > 0.0) {
    // It stands for its like, by its mean width in any direction. Which branches do was chosen before, so that none comes apart
    // (scene/cut.cpp); straws are drawn or left out here, as long as they are.
    float share = min(view.focal * c.mean * (1.0 / lens(c.a.z) + 1.0 / lens(c.b.z)) * FOREST_MEAN_STRETCH * shorter / thinnest, 1.0);
    float among = c.straw ? rank / share : fract(FOREST_SPREAD * rank);
    if (among >= 1.0) return;
    width = single ? floor(thinnest + 1.0 - among) : width / share;
  } else if (single) {
    width = floor(width + 1.0 - rank);
    if (width < 1.0) return;
  }
  if (hidden(min(p, q) - 0.5 * width, max(p, q) + 0.5 * width, min(c.a.z, c.b.z), 6u)) return;

  float za = depth_code(c.a.z), zb = depth_code(c.b.z);
  if (steep) { p = p.yx; q = q.yx; }
  if (p.x > q.x) { vec2 swap = p; p = q; q = swap; float z = za; za = zb; zb = z; }
  int limit_x = int(steep ? view.height : view.width), limit_y = int(steep ? view.width : view.height);
  int first = max(int(ceil(p.x - 0.5)), 0), last = min(int(ceil(q.x - 0.5)), limit_x);
  first += lane;
  if (first >= last) return;

  // The mean light of the half cylinder one sees, of (0.5 + 0.5 n·l)² as resolve.glsl has it: with the front's share b and
  // the side's a of the light, the mean of n·l is π b / 4, and of its square (a² + 2 b²) / 3.
  vec3 tangent = normalize(c.b - c.a + vec3(1e-9)), eye = towards_eye(c.a + c.b);
  float along = dot(tangent, light()), end_on = dot(eye, tangent);
  float b = (dot(eye, light()) - end_on * along) / sqrt(max(1.0 - end_on * end_on, 1e-4));
  float a2 = max(0.0, 1.0 - along * along - b * b);
  float shade = 0.5 * sqrt(max(0.0, 1.0 + 1.5707963 * b + (a2 + 2.0 * b * b) / 3.0));
  float noise = fract(c.rank * 7.0 + (view.thinnest > 0.0 ? golden * float(view.subframe) : 0.0));
  uint payload = payload_of(c.entry, shade, noise);
  // Of several subframes each meets the cylinder somewhere.
  vec3 beside = cross(c.b - c.a, eye);
  if ((steep ? beside.x : -beside.y) < 0.0) beside = -beside;
  float lit_side = 0.5 * dot(beside, light()) * inversesqrt(max(dot(beside, beside), 1e-30)), lit_front = 0.5 * b;
  float slope = (q.y - p.y) / (q.x - p.x), rise = (zb - za) / (q.x - p.x);
  float y = p.y + (float(first) + 0.5 - p.x) * slope - 0.5, half_width = 0.5 * width;
  float z = za + (float(first) + 0.5 - p.x) * rise;
  slope *= float(lanes);
  rise *= float(lanes);
  // One loop over the pixels of all scan lines, tested at its end (see hidden).
  int x = first, across = clipped(y - half_width, limit_y), end = clipped(y + half_width, limit_y);
  do {
    if (across < end) {
      if (!single) {
        float t = (float(across) - y) / half_width;
        payload = payload_of(c.entry, 0.5 + t * lit_side + sqrt(max(0.0, 1.0 - t * t)) * lit_front, noise);
      }
      put(steep ? across : x, steep ? x : across, z, payload);
    }
    if (++across >= end) {
      x += lanes;
      y += slope;
      z += rise;
      across = clipped(y - half_width, limit_y);
      end = clipped(y + half_width, limit_y);
    }
  } while (x < last);
}
