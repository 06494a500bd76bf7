// Every pixel meets the tapered capsule with its own ray, as geometry/round_cone.cpp does on the CPU.

struct Hit {
  float t;
  vec3 normal;
};

void meet_sphere(vec3 ray, vec3 centre, float radius, inout Hit hit) {
  float b = dot(ray, centre);
  vec3 closest = centre - b * ray;
  float h = radius * radius - dot(closest, closest);
  if (h < 0.0) return;
  float t = b - sqrt(h);
  if (t > 0.0 && t < hit.t) {
    hit.t = t;
    hit.normal = (t * ray - centre) / max(radius, 1e-9);
  }
}

// What all rays that meet a capsule ask of it.
struct Cone {
  vec3 u;  // along the axis; nought where one sphere holds the other
  float len, s, c2, cosine;
  bool nested;
  uint nearest;  // no pixel of it can be nearer than this key
};

Cone cone_of(Capsule c) {
  vec3 axis = c.b - c.a;
  float len = length(axis), taper = c.ra - c.rb;
  bool nested = len <= abs(taper) + 1e-6;
  float s = nested ? 0.0 : taper / len, c2 = 1.0 - s * s;
  return Cone(nested ? vec3(0.0) : axis / len, len, s, c2, sqrt(c2), nested,
              uint(depth_code(max(min(c.a.z - c.ra, c.b.z - c.rb), view.near))) << 12);
}

// Discs on screen around its ends, between which it is seen: a radius each, as Reach in render/cpu/capsule.h.
vec2 reaches(Capsule c) {
  vec2 wide = vec2(c.ra / lens(c.a.z), c.rb / lens(c.b.z));
  if (view.parallel > 0.0) return 1.0 + view.focal * wide;
  vec2 aside = vec2(length(c.a) / c.a.z, length(c.b) / c.b.z);
  float widest = max(wide.x, wide.y), farthest = max(aside.x, aside.y);
  if (widest < 0.25 && farthest < 1.58) return 1.0 + view.focal * wide * aside / (1.0 - wide);
  return vec2(widest < 1.0 ? min(1.0 + view.focal * widest * farthest / (1.0 - widest), 1e6) : 1e6);
}

void meet(Capsule c, Cone cone, int px, int py) {
  uint pixel = uint(py) * view.width + uint(px), seen = texelFetch(keys_seen, int(pixel)).x;
  if (seen < cone.nearest) return;
#ifdef FOREST_DOOR
  if (!open_at(pixel)) return;
#endif
  vec2 beside = vec2(float(px) + 0.5 - view.centre_x, view.centre_y - float(py) - 0.5) / view.focal;
  vec3 ray = normalize(vec3(view.converge * beside, 1.0)), begin = vec3(view.parallel * beside, 0.0);
  vec3 to_a = c.a - begin;
  Hit hit = Hit(1e30, vec3(0.0));
  if (!cone.nested) {
    float shift = dot(to_a, ray);
    vec3 o = shift * ray - to_a;
    float oy = dot(o, cone.u), dy = dot(ray, cone.u);
    float k0 = c.ra - cone.s * oy, k1 = -cone.s * dy;
    float A = cone.c2 * (1.0 - dy * dy) - k1 * k1;
    float B = -cone.c2 * oy * dy - k0 * k1;
    float C = cone.c2 * (dot(o, o) - oy * oy) - k0 * k0;
    float root = B * B - A * C;
    if (root < 0.0) return;  // beside the cone, within which both spheres lie
    if (A > 1e-9) {
      float local = (-B - sqrt(root)) / A, along = oy + local * dy;
      if (along >= cone.s * c.ra && along <= cone.len + cone.s * c.rb && local + shift > 0.0) {
        hit.t = local + shift;
        vec3 across = o + local * ray - along * cone.u;
        hit.normal = cone.cosine * normalize(across) + cone.s * cone.u;
      }
    }
  }
  if (hit.t > 1e29) {
    meet_sphere(ray, to_a, c.ra, hit);
    meet_sphere(ray, c.b - begin, c.rb, hit);
  }
  if (hit.t > 1e29) return;
  float z = max(hit.t * ray.z, view.near);
  float facing = dot(hit.normal, light());
  uint key = key_of(depth_code(z), payload_of(c.entry, 0.5 + 0.5 * facing, noise_at(px, py)));
  if (key < seen) atomicMin(keys[pixel], key);
}

// The scan lines lane, lane + lanes, … across its major axis.
void draw_capsule(Capsule c, int lane, int lanes) {
  vec2 p = to_pixel(c.a), q = to_pixel(c.b), r = reaches(c);
  bool steep = abs(q.y - p.y) > abs(q.x - p.x);
  if (steep) { p = p.yx; q = q.yx; }
  int limit_x = int(steep ? view.height : view.width), limit_y = int(steep ? view.width : view.height);
  int first = clipped(floor(min(p.x - r.x, q.x - r.y)), limit_x), last = clipped(ceil(max(p.x + r.x, q.x + r.y)), limit_x);
  float reach = max(r.x, r.y);
  Cone cone = cone_of(c);
  for (int x = first + lane; x < last; x += lanes) {
    // The part of the axis whose discs can reach this scan line, and from it the range across.
    float at = float(x) + 0.5, dx = q.x - p.x;
    float t0 = 0.0, t1 = 1.0;
    if (abs(dx) > 1e-3) {
      float e0 = (at - reach - p.x) / dx, e1 = (at + reach - p.x) / dx;
      t0 = clamp(min(e0, e1), 0.0, 1.0);
      t1 = clamp(max(e0, e1), 0.0, 1.0);
    }
    float y0 = mix(p.y, q.y, t0), y1 = mix(p.y, q.y, t1);
    float w = max(mix(r.x, r.y, t0), mix(r.x, r.y, t1));
    int low = clipped(floor(min(y0, y1) - w), limit_y), high = clipped(ceil(max(y0, y1) + w), limit_y);
    for (int y = low; y < high; ++y) meet(c, cone, steep ? y : x, steep ? x : y);
  }
}

// The pixels around it.
Squares squares_of(Capsule c) {
  vec2 p = to_pixel(c.a), q = to_pixel(c.b), r = reaches(c), size = vec2(view.width, view.height);
  return squares_of(ivec2(clamp(floor(min(p - r.x, q - r.y)), vec2(0.0), size)),
                    ivec2(clamp(ceil(max(p + r.x, q + r.y)), vec2(0.0), size)));
}

// One of its squares, by 64 threads: 8 by 8 pixels after the other, where it may be.
void draw_square(Capsule c, uint which, int lane) {
  Squares s = squares_of(c);
  ivec2 low = low_of(s, which), high = min(low + s.edge, s.high);
  vec2 p = to_pixel(c.a), q = to_pixel(c.b), r = reaches(c), d = q - p;
  float reach = max(r.x, r.y), scale = 1.0 / max(dot(d, d), 1e-9);
  vec2 middle = 0.5 * vec2(low + high) - p;
  if (distance(middle, clamp(dot(middle, d) * scale, 0.0, 1.0) * d) > reach + 0.71 * float(s.edge)) return;
  if (hidden(vec2(low), vec2(high), max(min(c.a.z - c.ra, c.b.z - c.rb), view.near), 16u)) return;
  Cone cone = cone_of(c);
  for (int y = low.y; y < high.y; y += 8)
    for (int x = low.x; x < high.x; x += 8) {
      middle = vec2(x, y) + 4.0 - p;
      ivec2 at = ivec2(x + lane % 8, y + lane / 8);
      if (distance(middle, clamp(dot(middle, d) * scale, 0.0, 1.0) * d) > reach + 5.7 || at.x >= high.x || at.y >= high.y) continue;
      meet(c, cone, at.x, at.y);
    }
}

// A thin capsule without a ray for every pixel: across the axis on screen, depth and shade follow a half circle. Its ends
// are cut along the scan line, a little beyond the joints, so that bends show no gap. This thread draws the scan lines lane,
// lane + lanes, …
void draw_tube(Capsule c, int lane, int lanes) {
  vec2 p = to_pixel(c.a), q = to_pixel(c.b);
  float wp = view.focal * c.ra / lens(c.a.z), wq = view.focal * c.rb / lens(c.b.z);
  float za = depth_code(c.a.z), zb = depth_code(c.b.z);
  const float octave = 1.442695 * FOREST_DEPTH_STEPS;  // of code, for a relative step in depth
  float bulge = octave * max(c.ra / c.a.z, c.rb / c.b.z);
  bool steep = abs(q.y - p.y) > abs(q.x - p.x);
  if (steep) { p = p.yx; q = q.yx; }
  if (p.x > q.x) {
    vec2 swap = p; p = q; q = swap;
    float s = wp; wp = wq; wq = s;
    s = za; za = zb; zb = s;
  }
  float dx = q.x - p.x, slope = (q.y - p.y) / dx, stretch = sqrt(1.0 + slope * slope);
  int limit_x = int(steep ? view.height : view.width), limit_y = int(steep ? view.width : view.height);
  float over = 0.4 * min(wp, wq);
  int first = max(int(ceil(p.x - over - 0.5)), 0), last = min(int(ceil(q.x + over - 0.5)), limit_x);

  // The normal at distance t from the axis: t along `side`, sqrt(1 - t²) towards the eye, both across the tangent.
  vec3 tangent = normalize(c.b - c.a), eye = towards_eye(c.a + c.b);
  vec3 facing = normalize(eye - dot(eye, tangent) * tangent), side = cross(tangent, facing);
  vec2 across = steep ? vec2(1.0, 0.0) : vec2(0.0, -1.0);  // of growing y, in camera axes
  if (dot(side.xy, across) < 0.0) side = -side;
  float lit_side = 0.5 * dot(side, light()), lit_front = 0.5 * dot(facing, light());

  for (int x = first + lane; x < last; x += lanes) {
    float along = (float(x) + 0.5 - p.x) / dx;
    float centre = p.y + slope * (along * dx), half_width = mix(wp, wq, clamp(along, 0.0, 1.0)) * stretch;
    float z = mix(za, zb, clamp(along, 0.0, 1.0)), inverse = 1.0 / half_width;
    int low = max(int(ceil(centre - half_width - 0.5)), 0), high = min(int(ceil(centre + half_width - 0.5)), limit_y);
    for (int y = low; y < high; ++y) {
      float t = (float(y) + 0.5 - centre) * inverse, h = sqrt(max(0.0, 1.0 - t * t));
      int px = steep ? y : x, py = steep ? x : y;
      put(px, py, max(z - bulge * h, 0.0), payload_of(c.entry, 0.5 + t * lit_side + h * lit_front, noise_at(px, py)));
    }
  }
}

// What a capsule is drawn as.
const uint as_line = 0u, as_tube = 1u, as_solid = 2u;
const float tube_width = 7.0;  // pixels; below, a capsule is shaded by its distance from the axis on screen

float half_width(Capsule c) { return view.focal * max(c.ra / lens(c.a.z), c.rb / lens(c.b.z)); }

uint manner_of(Capsule c) {
  float width = half_width(c);
  if (width < 0.75) return as_line;
  return 2.0 * width < tube_width && distance(to_pixel(c.a), to_pixel(c.b)) > 0.5 * width ? as_tube : as_solid;
}
