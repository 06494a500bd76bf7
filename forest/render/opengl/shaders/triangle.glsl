// Triangles in homogeneous coordinates, in double precision: as render/cpu/triangles.cpp, where it is explained. The corners
// come as texels where segments do, the triangles' indices where items do, colours and presence where entries do.

struct Corner {
  vec3 at, normal;
  float openness, opacity;
  uint entry;
};

struct Facet {
  Corner p, q, r;
  ivec2 low, high;  // pixels, [low, high)
  bool seen;
};

Corner corner(uint place) {
  int vertex = int(texelFetch(items, int(place)).x);
  uvec4 at = texelFetch(segments, 2 * vertex), normal = texelFetch(segments, 2 * vertex + 1);
  Corner c;
  c.at = uintBitsToFloat(at.xyz);
  c.normal = uintBitsToFloat(normal.xyz);
  c.openness = float(at.w) / 255.0;
  uvec2 look = texelFetch(entries, vertex).xy;
  c.entry = look.x;
  c.opacity = float(view.opacity) * (float(look.y) / 255.0);
  if (view.instance != 0xffffffffu) {
    vec4 q = uintBitsToFloat(texelFetch(instances, int(2u * view.instance + 1u)));
    c.at = uintBitsToFloat(texelFetch(instances, int(2u * view.instance)).xyz) + turned(q, c.at);
    c.normal = turned(q, c.normal);
  }
  c.at = to_camera(c.at);
  c.normal = vec3(dot(c.normal, vec3(view.right_x, view.right_y, view.right_z)), dot(c.normal, vec3(view.up_x, view.up_y, view.up_z)),
                  dot(c.normal, vec3(view.forward_x, view.forward_y, view.forward_z)));
  return c;
}

void surround(vec3 p, vec3 q, inout vec2 low, inout vec2 high) {
  if (p.z >= view.near) {
    low = min(low, to_pixel(p));
    high = max(high, to_pixel(p));
  }
  if ((p.z < view.near) != (q.z < view.near)) {
    vec3 cut = vec3(mix(p.xy, q.xy, (view.near - p.z) / (q.z - p.z)), view.near);
    low = min(low, to_pixel(cut));
    high = max(high, to_pixel(cut));
  }
}

Facet fetch_facet(uint index) {
  Facet f;
  f.p = corner(3u * index);
  f.q = corner(3u * index + 1u);
  f.r = corner(3u * index + 2u);
  vec2 low = vec2(1e30), high = vec2(-1e30), size = vec2(view.width, view.height);
  surround(f.p.at, f.q.at, low, high);
  surround(f.q.at, f.r.at, low, high);
  surround(f.r.at, f.p.at, low, high);
  f.low = ivec2(clamp(ceil(low - 0.501), vec2(0.0), size));
  f.high = ivec2(clamp(floor(high + 0.501), vec2(0.0), size));
  f.seen = low.x <= high.x && f.low.x < f.high.x && f.low.y < f.high.y;
  return f;
}

dvec3 homogeneous(vec3 p) { return dvec3(p.xy, view.converge * p.z + view.parallel); }

// Its pixels within [low, high), by the threads of a square of so many by so many.
void draw_facet(Facet f, ivec2 low, ivec2 high, int lane, int edge) {
  dvec3 h0 = homogeneous(f.p.at), h1 = homogeneous(f.q.at), h2 = homogeneous(f.r.at);
  dvec3 n0 = cross(h1, h2), n1 = cross(h2, h0), n2 = cross(h0, h1);
  double volume = dot(h0, n0);
  if (volume == 0.0) return;
  bool front = volume > 0.0;
  if (!front) { n0 = -n0; n1 = -n1; n2 = -n2; }
  for (int y = low.y + lane / edge; y < high.y; y += edge) {
    double up = (double(view.centre_y) - double(y) - 0.5) / double(view.focal);
    dvec3 row = dvec3(n0.y * up + n0.z, n1.y * up + n1.z, n2.y * up + n2.z);
    for (int x = low.x + lane % edge; x < high.x; x += edge) {
      double right = (double(x) + 0.5 - double(view.centre_x)) / double(view.focal);
      dvec3 inside = dvec3(n0.x, n1.x, n2.x) * right + row;
      double sum = inside.x + inside.y + inside.z;
      if (inside.x < 0.0 || inside.y < 0.0 || inside.z < 0.0 || !(sum > 0.0)) continue;
      float a = float(inside.x / sum), b = float(inside.y / sum), d = 1.0 - a - b;
      float z = a * f.p.at.z + b * f.q.at.z + d * f.r.at.z;
      if (z < view.near) continue;
      uint pixel = uint(y) * view.width + uint(x);
      uint opacity = uint(a * f.p.opacity + b * f.q.opacity + d * f.r.opacity + 0.5);
      if (opacity < 255u && !forest_shows(opacity, forest_side_key(view.door, front, pixel), view.subframe)) continue;
      vec3 normal = a * f.p.normal + b * f.q.normal + d * f.r.normal;
      float facing = dot(normal, light()) / max(length(normal), 1e-9);
      float shade = (a * f.p.openness + b * f.q.openness + d * f.r.openness) * (0.5 + (front ? 0.5 : -0.5) * facing);
      float pick = noise_at(x + 37, y + 11);
      uint entry = pick < a ? f.p.entry : pick < a + b ? f.q.entry : f.r.entry;
      uint key = key_of(depth_code(z), payload_of(entry, shade, noise_at(x, y)));
      if (key < texelFetch(keys_seen, int(pixel)).x) atomicMin(keys[pixel], key);
    }
  }
}
