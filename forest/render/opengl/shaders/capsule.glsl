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

// The scan lines lane, lane + lanes, … across the capsule's major axis.
void draw_capsule(Capsule c, int lane, int lanes) {
  // No pixel of it can be nearer than this.
  uint nearest = uint(depth_code(max(min(c.a.z - c.ra, c.b.z - c.rb), view.near))) << 12;
  vec2 p = to_pixel(c.a), q = to_pixel(c.b);
  float rp = 1.0 + 1.05 * view.focal * c.ra / max(lens(c.a.z - 0.5 * c.ra), lens(view.near));
  float rq = 1.0 + 1.05 * view.focal * c.rb / max(lens(c.b.z - 0.5 * c.rb), lens(view.near));
  bool steep = abs(q.y - p.y) > abs(q.x - p.x);
  if (steep) { p = p.yx; q = q.yx; }
  int limit_x = int(steep ? view.height : view.width), limit_y = int(steep ? view.width : view.height);
  int first = max(int(floor(min(p.x - rp, q.x - rq))), 0), last = min(int(ceil(max(p.x + rp, q.x + rq))), limit_x);
  float reach = max(rp, rq);

  vec3 axis = c.b - c.a;
  float len = length(axis), taper = c.ra - c.rb;
  bool nested = len <= abs(taper) + 1e-6;
  vec3 u = nested ? vec3(0.0) : axis / len;
  float s = nested ? 0.0 : taper / len, c2 = 1.0 - s * s, cosine = sqrt(c2);

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
    float w = max(mix(rp, rq, t0), mix(rp, rq, t1));
    int low = max(int(floor(min(y0, y1) - w)), 0), high = min(int(ceil(max(y0, y1) + w)), limit_y);
    for (int y = low; y < high; ++y) {
      int px = steep ? y : x, py = steep ? x : y;
      uint pixel = uint(py) * view.width + uint(px), seen = texelFetch(keys_seen, int(pixel)).x;
      if (seen < nearest) continue;
#ifdef FOREST_DOOR
      if (!open_at(pixel)) continue;
#endif
      vec2 beside = vec2(float(px) + 0.5 - view.centre_x, view.centre_y - float(py) - 0.5) / view.focal;
      vec3 ray = normalize(vec3(view.converge * beside, 1.0)), begin = vec3(view.parallel * beside, 0.0);
      vec3 to_a = c.a - begin;
      Hit hit = Hit(1e30, vec3(0.0));
      if (!nested) {
        float shift = dot(to_a, ray);
        vec3 o = shift * ray - to_a;
        float oy = dot(o, u), dy = dot(ray, u);
        float k0 = c.ra - s * oy, k1 = -s * dy;
        float A = c2 * (1.0 - dy * dy) - k1 * k1;
        float B = -c2 * oy * dy - k0 * k1;
        float C = c2 * (dot(o, o) - oy * oy) - k0 * k0;
        float root = B * B - A * C;
        if (root < 0.0) continue;  // beside the cone, within which both spheres lie
        if (A > 1e-9) {
          float local = (-B - sqrt(root)) / A, along = oy + local * dy;
          if (along >= s * c.ra && along <= len + s * c.rb && local + shift > 0.0) {
            hit.t = local + shift;
            vec3 across = o + local * ray - along * u;
            hit.normal = cosine * normalize(across) + s * u;
          }
        }
      }
      if (hit.t > 1e29) {
        meet_sphere(ray, to_a, c.ra, hit);
        meet_sphere(ray, c.b - begin, c.rb, hit);
      }
      if (hit.t > 1e29) continue;
      float z = max(hit.t * ray.z, view.near);
      float facing = dot(hit.normal, light());
      uint key = key_of(depth_code(z), payload_of(c.entry, 0.5 + 0.5 * facing, noise_at(px, py)));
      if (key < seen) atomicMin(keys[pixel], key);
    }
  }
}

// A thin capsule without a ray for every pixel: across the axis on screen, depth and shade follow a half circle. Its ends
// are cut along the scan line, a little beyond the joints, so that bends show no gap.
void draw_tube(Capsule c) {
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

  for (int x = first; x < last; ++x) {
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
