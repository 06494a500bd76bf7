// SPDX-License-Identifier: Apache-2.0
#include "forest/render/opengl/opengl_renderer.h"

#include <algorithm>
#include <array>
#include <bit>
#include <chrono>
#include <cmath>
#include <cstring>
#include <map>
#include <numeric>

#include <epoxy/gl.h>
#include <fmt/format.h>

#include "forest/core/error.h"
#include "forest/frame/constants.h"
#include "forest/render/opengl/shaders.h"

namespace forest::render {
namespace {

using frame::Constants;
using frame::Item;
using frame::Segment;

// What shaders wrote is read by others, as storage, as texels or as how many of them there are.
constexpr GLbitfield written_for_shaders =
    GL_SHADER_STORAGE_BARRIER_BIT | GL_TEXTURE_FETCH_BARRIER_BIT | GL_COMMAND_BARRIER_BIT;

std::string driver() {
  const auto* name =
      reinterpret_cast<const char*>(glGetString(GL_RENDERER));  // none when the context is gone
  return name ? name : "no longer there";
}

GLint limit(GLenum name) {
  GLint value = 0;
  glGetIntegerv(name, &value);
  return value;
}

std::size_t texel_size(GLenum format) {
  switch (format) {
    case GL_RGBA32UI:
    case GL_RGBA32F:
      return 16;
    case GL_RG32UI:
      return 8;
    case GL_RG8UI:
      return 2;
    case GL_R8UI:
      return 1;
    default:
      return 4;
  }
}

// A buffer on the device that grows and never shrinks; as texels it is what was uploaded last.
class Buffer {
 public:
  Buffer() { glCreateBuffers(1, &name_); }
  ~Buffer() {
    glDeleteTextures(1, &texels_);
    glDeleteBuffers(1, &name_);
  }
  Buffer(const Buffer&) = delete;
  Buffer& operator=(const Buffer&) = delete;

  void reserve(std::size_t bytes) {
    if (bytes <= size_) return;
    size_ = shown_ = bytes;
    texel_format_ = 0;
    glNamedBufferData(name_, GLsizeiptr(bytes), nullptr, GL_DYNAMIC_DRAW);
  }
  template <class T>
  void upload(std::span<const T> values) {
    constexpr std::size_t least = 16;
    reserve(std::max(values.size_bytes(), least));
    if (const std::size_t shown = values.empty() ? least : values.size_bytes(); shown != shown_)
      shown_ = shown, texel_format_ = 0;
    if (!values.empty()) glNamedBufferSubData(name_, 0, GLsizeiptr(values.size_bytes()), values.data());
  }
  void bind(GLuint slot) const { glBindBufferBase(GL_SHADER_STORAGE_BUFFER, slot, name_); }
  /// For reading as a texture of `format`, at a unit of shaders/common.glsl. Throws Error where the driver would read only
  /// the beginning, which it would not say.
  void bind_texels(GLuint unit, GLenum format) {
    const std::size_t most = std::size_t(limit(GL_MAX_TEXTURE_BUFFER_SIZE));
    if (shown_ > most * texel_size(format))
      throw Error(fmt::format(
          "this forest or picture is too large for the graphics driver ({}), which reads {} bytes of "
          "a list of {}; take a smaller picture, or --renderer cpu",
          driver(), most * texel_size(format), shown_));
    if (!texels_) glCreateTextures(GL_TEXTURE_BUFFER, 1, &texels_);
    if (texel_format_ != format) glTextureBufferRange(texels_, format, name_, 0, GLsizeiptr(shown_));
    texel_format_ = format;
    glBindTextureUnit(unit, texels_);
  }
  GLuint name() const { return name_; }

 private:
  GLuint name_ = 0, texels_ = 0;
  GLenum texel_format_ = 0;
  std::size_t size_ = 0, shown_ = 0;  // bytes
};

// Memory of the processor that the device copies into. Reading its own buffers makes drivers move them, or wait for more than
// what is asked for.
class Returned {
 public:
  Returned() = default;
  ~Returned() { glDeleteBuffers(1, &name_); }
  Returned(const Returned&) = delete;
  Returned& operator=(const Returned&) = delete;

  /// The first `count` values of what shaders wrote there, once they have; until it is asked again.
  template <class T>
  std::span<const T> read(const Buffer& from, std::size_t count) {
    const std::size_t bytes = count * sizeof(T);
    if (!bytes) return {};
    if (bytes > size_) reserve(bytes);
    if (!at_) return {};
    glMemoryBarrier(GL_BUFFER_UPDATE_BARRIER_BIT);
    glCopyNamedBufferSubData(from.name(), name_, 0, 0, GLsizeiptr(bytes));
    glMemoryBarrier(GL_CLIENT_MAPPED_BUFFER_BARRIER_BIT);
    const GLsync done = glFenceSync(GL_SYNC_GPU_COMMANDS_COMPLETE, 0);
    while (glClientWaitSync(done, GL_SYNC_FLUSH_COMMANDS_BIT, 1'000'000'000) == GL_TIMEOUT_EXPIRED) {
    }
    glDeleteSync(done);
    return {static_cast<const T*>(at_), count};
  }

 private:
  void reserve(std::size_t bytes) {
    constexpr GLbitfield access = GL_MAP_READ_BIT | GL_MAP_PERSISTENT_BIT | GL_MAP_COHERENT_BIT;
    glDeleteBuffers(1, &name_);
    glCreateBuffers(1, &name_);
    glNamedBufferStorage(name_, GLsizeiptr(bytes), nullptr, access | GL_CLIENT_STORAGE_BIT);
    at_ = glMapNamedBufferRange(name_, 0, GLsizeiptr(bytes), access);
    size_ = at_ ? bytes : 0;
  }

  GLuint name_ = 0;
  const void* at_ = nullptr;
  std::size_t size_ = 0;
};

class Program {
 public:
  Program(const char* title, const char* body, const char* before, const std::string& definitions) {
    const GLuint shader = glCreateShader(GL_COMPUTE_SHADER);
    const char* texts[] = {
        "#version 450 core\n", definitions.c_str(), shaders::layout, shaders::common, before, body};
    glShaderSource(shader, 6, texts, nullptr);
    glCompileShader(shader);
    name_ = glCreateProgram();
    glAttachShader(name_, shader);
    glLinkProgram(name_);
    glDeleteShader(shader);
    GLint good = 0;
    glGetProgramiv(name_, GL_LINK_STATUS, &good);
    if (good) return;
    char log[4096] = "";
    glGetShaderInfoLog(shader, sizeof log, nullptr, log);
    if (!log[0]) glGetProgramInfoLog(name_, sizeof log, nullptr, log);
    throw Error(
        fmt::format("the shader '{}' was not accepted by this OpenGL driver ({}): {}", title, driver(), log));
  }
  ~Program() { glDeleteProgram(name_); }
  Program(const Program&) = delete;
  Program& operator=(const Program&) = delete;

  void use() const { glUseProgram(name_); }

 private:
  GLuint name_ = 0;
};

enum Kind { capsule_list, dot_list, line_list, list_count };

// What draws lists: by single threads, and by workgroups what those leave to them.
struct Drawing {
  explicit Drawing(const std::string& definitions)
      : dots("dots", shaders::dots, "", definitions),
        lines("lines", shaders::lines, "", definitions),
        long_lines("long_lines", shaders::long_lines, "", definitions),
        capsules("capsules", shaders::capsules, shaders::capsule, definitions),
        close_ups("close_ups", shaders::close_ups, shaders::capsule, definitions) {}
  Program dots, lines, long_lines, capsules, close_ups;

  const std::array<const Program*, list_count> alone{&capsules, &dots, &lines},
      shared{&close_ups, nullptr, &long_lines};
};

// What draws surfaces.
struct Facing {
  explicit Facing(const std::string& definitions)
      : triangles("triangles", shaders::triangles, shaders::triangle, definitions),
        close_ups("triangle_close_ups", shaders::triangle_close_ups, shaders::triangle, definitions) {}
  Program triangles, close_ups;
};

// How work is cut for a device. A card's threads are many, and all wait for the slowest; each dispatch costs it some
// microseconds. Mesa's processor draws the sooner the less is prepared twice and the more is found hidden.
struct Habits {
  int alone_steps, alone_area;  // of a segment, and of the rectangle around it: pixels that one thread draws
  int square;                   // pixels along an edge of what a workgroup draws, at least
  std::uint32_t
      first_band;  // segments, at least: bands of fewer are drawn together, and each holds twice the last

  bool ask_together;  // threads of a workgroup, for places in a queue

  std::string definitions() const {
    return fmt::format(
        "#define FOREST_ALONE_STEPS {}.0\n#define FOREST_ALONE_AREA {}\n#define FOREST_SQUARE {}\n"
        "#define FOREST_ASK_TOGETHER {}\n",
        alone_steps, alone_area, square, int(ask_together));
  }
};
constexpr Habits of_processors{1 << 20, 300, 1 << 15, 0, false}, of_cards{32, 64, 32, 1u << 15, true};

// The parts of a surface that stay.
struct SurfaceBuffers {
  Buffer vertices, triangles;
  bool used = true;  // in this picture

  void upload(const frame::Surface& s) {
    std::vector<frame::Vertex> corners(s.positions.size());
    for (std::size_t i = 0; i < corners.size(); ++i) {
      const Vec3 &p = s.positions[i], &n = s.normals[i];
      corners[i] = {p.x(), p.y(), p.z(), s.openness.empty() ? 255u : s.openness[i], n.x(), n.y(), n.z(), 0};
    }
    vertices.upload(std::span<const frame::Vertex>(corners));
    triangles.upload(s.triangles);
  }
};

// Throws Error when what was drawn since the last time cannot be relied on.
void check_driver() {
  // A card that was reset, taken out or put to sleep draws nothing from then on, and says so here alone.
  if (glGetGraphicsResetStatus() != GL_NO_ERROR)
    throw Error(
        "the graphics card was reset by its driver and has lost the forest; start again, or draw on the "
        "processor with --renderer cpu");
  if (const GLenum error = glGetError())
    throw Error(
        error == GL_OUT_OF_MEMORY
            ? fmt::format(
                  "the graphics driver ({}) has too little memory for this forest and picture; take a "
                  "smaller picture, or --renderer cpu",
                  driver())
            : fmt::format(
                  "the graphics driver ({}) reports error 0x{:x} after drawing; install a newer one, or "
                  "draw on the processor with --renderer cpu",
                  driver(), error));
}

double milliseconds_since(std::chrono::steady_clock::time_point start) {
  return std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - start).count();
}

}  // namespace

struct OpenGLRenderer::Device {
  struct List {
    Kind kind;
    std::uint32_t flags = 0;
    Buffer items{}, entries{};
    std::uint32_t count = 0;
    std::vector<std::uint32_t> segments{};  // before each item, and in all
  };
  using ListSet = std::array<List, list_count>;
  // What the lists of a kind that are drawn share: which segments are not hidden, and which of them a workgroup draws.
  struct Work {
    Buffer queue, large_queue, uniforms;
  };
  static constexpr std::uint32_t large_capacity = 1u << 18;  // parts of segments

  explicit Device(const Habits& of_it) : habits(of_it) {}

  const Habits& habits;
  const std::string definitions = habits.definitions();
  Drawing opaque{definitions};
  std::unique_ptr<Drawing> transparent;  // made when something is
  const Drawing* drawing = &opaque;
  std::unique_ptr<Facing> facing;                  // made when there are surfaces
  std::map<std::uint64_t, SurfaceBuffers> meshes;  // by version
  SurfaceBuffers passing;                          // of a surface without one
  Buffer mesh_looks;
  std::vector<std::uint8_t> looks;  // of every vertex: palette entry, presence
  Program clear{"clear", shaders::clear, "", definitions}, cull{"cull", shaders::cull, "", definitions},
      tile{"tiles", shaders::tiles, "", definitions}, resolve{"resolve", shaders::resolve, "", definitions},
      covered{"covered", shaders::covered, "", definitions};
  Buffer segments, instances, owners, states, palette, overlay_segments, ball_segments, uniforms, keys, sums,
      image, rows, tiles, depths;
  std::array<Work, list_count> work;
  Returned returned;
  ListSet lists{{{capsule_list}, {dot_list}, {line_list}}}, rest{{{capsule_list}, {dot_list}, {line_list}}};
  List overlays{capsule_list, FOREST_OVERLAY}, balls{dot_list, FOREST_OVERLAY | FOREST_BALLS};
  frame::DepthMap seen;
  frame::Geometry geometry;
  Constants constants{};
  std::uint32_t width = 0, height = 0;
  GLuint texture = 0, framebuffer = 0;
  std::uint32_t texture_width = 0, texture_height = 0;

  static void set(List& list, std::span<const Item> items, std::span<const std::uint8_t> entries = {},
                  std::uint32_t flags = 0) {
    list.items.upload(items);
    list.entries.upload(entries);
    list.flags =
        (list.flags & (FOREST_OVERLAY | FOREST_BALLS)) | (entries.empty() ? 0 : FOREST_ENTRIES | flags);
    list.count = std::uint32_t(items.size());
    list.segments.resize(items.size() + 1);
    std::transform_inclusive_scan(items.begin(), items.end(), list.segments.begin() + 1, std::plus(),
                                  [](const Item& item) { return std::uint32_t(std::popcount(item.drawn)); });
  }

  void upload(ListSet& to, const frame::Lists& from) {
    set(to[capsule_list], from.capsules, from.entries.capsules);
    set(to[dot_list], from.dots, from.entries.dots, FOREST_SINGLE);
    set(to[line_list], from.lines, from.entries.lines);
  }

  void upload(const frame::Frame& f) {
    const auto upload_marks = [](const auto& things, Buffer& to, List& list) {
      std::vector<Segment> marks;
      std::vector<Item> items;
      for (const auto& thing : things) marks.push_back(frame::segment_of(thing));
      for (std::size_t i = 0; i < marks.size(); i += frame::cluster_size)
        items.push_back({0, std::uint32_t(i), frame::first_segments(marks.size() - i), 0, 0, 0, 0,
                         INFINITY});  // never culled as a whole
      to.upload(std::span<const Segment>(marks));
      set(list, items);
    };
    upload_marks(f.overlays, overlay_segments, overlays);
    upload_marks(f.balls, ball_segments, balls);
    upload(lists, f);

    states.upload(f.states);
    if (frame::transparent(f)) {
      if (!transparent) transparent = std::make_unique<Drawing>("#define FOREST_DOOR\n" + definitions);
      drawing = transparent.get();
    } else {
      drawing = &opaque;
    }
    std::array<float, 4 * std::tuple_size_v<frame::Palette>> colours{};
    for (std::size_t i = 0; i < f.palette.size(); ++i) {
      Vec3::Map(&colours[4 * i]) = f.palette[i];
      colours[4 * i + 3] = f.opacities[i];
    }
    palette.upload(std::span<const float>(colours));
  }

  void prepare(const frame::Frame& f) {
    width = f.width, height = f.height;
    const std::size_t pixels = std::size_t(width) * height;
    keys.reserve(pixels * 4);
    image.reserve(pixels * 4);
    sums.reserve(f.subframes > 1 ? pixels * 16 : 16);
    tiles.reserve((pixels / 32 + width + height + 64) * 4);
    depths.reserve((pixels / 32 + width + height + 64) * 4);
    instances.bind_texels(1, GL_RGBA32UI);
    owners.bind_texels(10, GL_RG32UI);
    keys.bind_texels(3, GL_R32UI);
    states.bind_texels(4, GL_RGBA8UI);
    palette.bind_texels(5, GL_RGBA32F);
    tiles.bind_texels(8, GL_R32UI);
    keys.bind(0);
    sums.bind(1);
    image.bind(2);
    tiles.bind(5);
    depths.bind(6);
  }

  void set_constants(Buffer& to) {
    to.upload(std::span<const Constants>(&constants, 1));
    glBindBufferBase(GL_UNIFORM_BUFFER, 0, to.name());
  }

  static void empty(Buffer& queue, std::size_t numbers) {
    constexpr std::uint32_t nothing[4] = {0, 1, 1, 0};
    queue.reserve(sizeof nothing + 4 * std::max<std::size_t>(numbers, 1));
    glNamedBufferSubData(queue.name(), 0, sizeof nothing, nothing);
  }

  void bind(List& list) {
    Work& w = work[list.kind];
    w.queue.bind(3);
    w.large_queue.bind(4);
    w.queue.bind_texels(6, GL_R32UI);
    w.large_queue.bind_texels(7, GL_R32UI);
    list.items.bind_texels(2, GL_RGBA32UI);
    list.entries.bind_texels(9, GL_R8UI);
    Buffer& in_world = list.flags & FOREST_BALLS ? ball_segments : overlay_segments;
    (list.flags & FOREST_OVERLAY ? in_world : segments).bind_texels(0, GL_RGBA32UI);
    glBindBufferBase(GL_UNIFORM_BUFFER, 0, w.uniforms.name());
  }

  // Items [first, last) of a list.
  struct Part {
    List& list;
    std::uint32_t first, last;
  };

  // Draws what earlier bands do not hide of these parts, of a kind each: together, as none waits for another.
  void draw(std::span<const Part> parts, bool first_band) {
    glMemoryBarrier(GL_BUFFER_UPDATE_BARRIER_BIT | written_for_shaders);
    const auto each = [&](auto&& run) {
      for (const Part& part : parts)
        if (part.first < part.last) {
          bind(part.list);
          run(part);
        }
    };
    for (const Part& part : parts) {
      if (part.first >= part.last) continue;
      Work& w = work[part.list.kind];
      empty(w.queue, part.list.segments[part.last] - part.list.segments[part.first]);
      empty(w.large_queue, drawing->shared[part.list.kind] ? 2 * std::size_t(large_capacity) : 0);
      constants.first_item = part.first;
      constants.item_count = part.last - part.first;
      constants.flags = part.list.flags | (first_band ? FOREST_FIRST_BAND : 0);
      set_constants(w.uniforms);
    }
    cull.use();
    each([](const Part& part) { dispatch((part.last - part.first + 63) / 64); });
    glMemoryBarrier(written_for_shaders);
    each([&](const Part& part) { run(*drawing->alone[part.list.kind], work[part.list.kind].queue); });
    glMemoryBarrier(written_for_shaders);
    each([&](const Part& part) {
      if (const Program* shared = drawing->shared[part.list.kind])
        run(*shared, work[part.list.kind].large_queue);
    });
  }

  // As group_index() in common.glsl counts them: a card need not take more than 65,535 in a row.
  static void dispatch(std::uint32_t groups) {
    glDispatchCompute(std::min(groups, 32768u), (groups + 32767) / 32768, 1);
  }

  static void run(const Program& program, const Buffer& groups) {
    program.use();
    glBindBuffer(GL_DISPATCH_INDIRECT_BUFFER, groups.name());
    glDispatchComputeIndirect(0);
  }

  void draw_surfaces(const frame::Frame& f) {
    if (!facing) facing = std::make_unique<Facing>(definitions);
    Buffer& large_queue = work[capsule_list].large_queue;
    empty(large_queue, 2 * std::size_t(large_capacity));
    large_queue.bind(4);
    large_queue.bind_texels(7, GL_R32UI);
    for (std::size_t k = 0; k < f.surfaces.size(); ++k) {
      const frame::Surface& surface = f.surfaces[k];
      if (surface.triangles.empty() || surface.opacity == 0) continue;
      SurfaceBuffers* mesh = &passing;
      if (surface.version == 0) {
        passing.upload(surface);
      } else {
        const auto [known, added] = meshes.try_emplace(surface.version);
        mesh = &known->second;
        if (added) mesh->upload(surface);
        mesh->used = true;
      }
      looks.resize(2 * surface.entries.size());
      for (std::size_t i = 0; i < surface.entries.size(); ++i)
        looks[2 * i] = surface.entries[i],
                  looks[2 * i + 1] = surface.presence.empty() ? std::uint8_t(255) : surface.presence[i];
      mesh_looks.upload(std::span<const std::uint8_t>(looks));
      glMemoryBarrier(GL_BUFFER_UPDATE_BARRIER_BIT | written_for_shaders);
      empty(large_queue, 0);
      constants.item_count = std::uint32_t(surface.triangles.size());
      constants.instance = surface.instance, constants.opacity = surface.opacity;
      constants.door = frame::forest_surface_key(frame::door_number(f.surfaces, k), surface.instance);
      set_constants(uniforms);
      mesh->vertices.bind_texels(0, GL_RGBA32UI);
      mesh->triangles.bind_texels(2, GL_R32UI);
      mesh_looks.bind_texels(9, GL_RG8UI);
      facing->triangles.use();
      const std::uint32_t groups = (constants.item_count + FOREST_GROUP - 1) / FOREST_GROUP;
      dispatch(groups);
      glMemoryBarrier(written_for_shaders);
      run(facing->close_ups, large_queue);
    }
  }

  void find_tiles() {
    glMemoryBarrier(written_for_shaders);
    set_constants(uniforms);
    tile.use();
    constexpr std::uint32_t side = FOREST_TILE * FOREST_TILE;
    glDispatchCompute((width + side - 1) / side, (height + side - 1) / side, 1);
    glMemoryBarrier(written_for_shaders);
  }

  // @param first_band  nothing is drawn yet
  void draw_bands(ListSet& set, std::span<const frame::Band> bands, bool first_band) {
    const frame::Band whole{set[dot_list].count, set[line_list].count, set[capsule_list].count};
    if (bands.empty()) bands = std::span(&whole, 1);
    const auto segments_in = [&](Kind kind, std::uint32_t first, std::uint32_t last) {
      return set[kind].segments[last] - set[kind].segments[first];
    };
    frame::Band from;
    bool first = true;
    std::uint32_t enough = first_band ? habits.first_band : 4 * habits.first_band;
    for (const frame::Band& to : bands) {
      const std::uint32_t count = segments_in(capsule_list, from.capsules, to.capsules) +
                                  segments_in(dot_list, from.dots, to.dots) +
                                  segments_in(line_list, from.lines, to.lines);
      if (count < enough && &to != &bands.back()) continue;
      if (!first) find_tiles();
      const std::array<Part, list_count> parts{{{set[capsule_list], from.capsules, to.capsules},
                                                {set[dot_list], from.dots, to.dots},
                                                {set[line_list], from.lines, to.lines}}};
      draw(parts, first && first_band);
      first = false;
      enough *= 2;
      from = to;
    }
  }

  void draw_subframe(const frame::Frame& f) {
    if (!f.surfaces.empty()) {  // they hide much
      draw_surfaces(f);
      find_tiles();
    }
    draw_bands(lists, f.bands, f.surfaces.empty());
    for (std::uint32_t round = 0; f.rest; ++round) {
      find_tiles();
      read_depths();
      const frame::Lists more = f.rest(seen, round);
      if (more.empty()) break;
      frame::check(more, geometry);
      upload(rest, more);
      draw_bands(rest, more.bands, false);
    }
    const std::array<Part, 2> marks{{{balls, 0, balls.count}, {overlays, 0, overlays.count}}};
    draw(marks, true);
    glMemoryBarrier(written_for_shaders);
  }

  void read_depths() {
    seen.width = (width + FOREST_TILE - 1) / FOREST_TILE,
    seen.height = (height + FOREST_TILE - 1) / FOREST_TILE;
    const auto from = returned.read<float>(depths, std::size_t(seen.width) * seen.height);
    seen.depths.assign(from.begin(), from.end());
  }

  void draw_texture() {
    if (!texture || texture_width != width || texture_height != height) {
      glDeleteTextures(1, &texture);
      glCreateTextures(GL_TEXTURE_2D, 1, &texture);
      glTextureStorage2D(texture, 1, GL_RGBA8, GLsizei(width), GLsizei(height));
      if (!framebuffer) glCreateFramebuffers(1, &framebuffer);
      glNamedFramebufferTexture(framebuffer, GL_COLOR_ATTACHMENT0, texture, 0);
      texture_width = width, texture_height = height;
    }
    glMemoryBarrier(GL_PIXEL_BUFFER_BARRIER_BIT);
    glBindBuffer(GL_PIXEL_UNPACK_BUFFER, image.name());
    glPixelStorei(GL_UNPACK_ALIGNMENT, 4);
    glTextureSubImage2D(texture, 0, 0, 0, GLsizei(width), GLsizei(height), GL_RGBA, GL_UNSIGNED_BYTE,
                        nullptr);
    glBindBuffer(GL_PIXEL_UNPACK_BUFFER, 0);
  }
};

OpenGLRenderer::OpenGLRenderer(Habit habit) {
  if (epoxy_gl_version() < 45)
    throw Error(fmt::format(
        "OpenGL 4.5 is needed for its compute shaders and this driver ({}) has {}.{}; install a newer one "
        "(libgl1-mesa-dri has one for every computer)",
        driver(), epoxy_gl_version() / 10, epoxy_gl_version() % 10));
  if (habit == Habit::of_driver) habit = on_processor() ? Habit::of_processors : Habit::of_cards;
  device_ = std::make_unique<Device>(habit == Habit::of_cards ? of_cards : of_processors);
}

OpenGLRenderer::~OpenGLRenderer() {
  glDeleteTextures(1, &device_->texture);
  glDeleteFramebuffers(1, &device_->framebuffer);
}

std::string OpenGLRenderer::name() const { return driver(); }

bool OpenGLRenderer::on_processor() const {
  const std::string name = driver();
  return std::ranges::any_of(std::array{"llvmpipe", "softpipe", "swrast", "SWR"},
                             [&](const char* word) { return name.find(word) != name.npos; });
}

void OpenGLRenderer::load(const frame::Geometry& geometry) {
  device_->geometry = geometry;
  device_->segments.upload(geometry.segments);
  device_->instances.upload(geometry.instances);
  device_->owners.upload(geometry.owners);
}

frame::Timing OpenGLRenderer::draw(const frame::Frame& f) {
  Device& d = *device_;
  frame::check(f, d.geometry);
  d.upload(f);
  d.prepare(f);
  for (auto& [version, mesh] : d.meshes) mesh.used = false;
  d.seen = {};
  frame::Timing timing;
  const std::uint32_t last = std::min(f.last_subframe, f.subframes);
  for (std::uint32_t subframe = f.first_subframe; subframe < last; ++subframe) {
    auto start = std::chrono::steady_clock::now();
    d.constants = frame::constants_of(f, subframe);
    d.set_constants(d.uniforms);
    d.clear.use();
    glDispatchCompute((f.width + 63) / 64, f.height, 1);
    glMemoryBarrier(written_for_shaders);
    d.draw_subframe(f);
    glFinish();
    timing.draw += milliseconds_since(start);
    start = std::chrono::steady_clock::now();
    d.set_constants(d.uniforms);
    d.resolve.use();
    glDispatchCompute((f.width + 63) / 64, f.height, 1);
    glMemoryBarrier(GL_SHADER_STORAGE_BARRIER_BIT | GL_BUFFER_UPDATE_BARRIER_BIT);
    glFinish();
    timing.resolve += milliseconds_since(start);
  }
  std::erase_if(d.meshes, [](const auto& known) { return !known.second.used; });
  check_driver();
  return timing;
}

frame::Image OpenGLRenderer::read() {
  Device& d = *device_;
  frame::Image image{d.width, d.height, {}, covered()};
  const auto pixels = d.returned.read<std::uint8_t>(d.image, std::size_t(d.width) * d.height * 4);
  image.pixels.assign(pixels.begin(), pixels.end());
  check_driver();
  for (std::size_t i = 3; i < image.pixels.size(); i += 4) image.pixels[i] = 255;
  return image;
}

double OpenGLRenderer::covered() {
  Device& d = *device_;
  d.rows.reserve(std::max<std::size_t>(16, d.height * std::size_t(4)));
  d.rows.bind(1);
  d.image.bind(2);
  d.set_constants(d.uniforms);
  d.covered.use();
  glDispatchCompute(d.height, 1, 1);
  const auto rows = d.returned.read<std::uint32_t>(d.rows, d.height);
  check_driver();
  return std::accumulate(rows.begin(), rows.end(), 0.) / 255. /
         double(std::max(1u, d.width) * std::size_t(std::max(1u, d.height)));
}

const frame::DepthMap& OpenGLRenderer::seen() const { return device_->seen; }

void OpenGLRenderer::show(unsigned target) {
  Device& d = *device_;
  if (!d.width) return;
  d.draw_texture();
  const GLint w = GLint(d.width), h = GLint(d.height);
  glBlitNamedFramebuffer(d.framebuffer, target, 0, 0, w, h, 0, h, w, 0, GL_COLOR_BUFFER_BIT, GL_NEAREST);
}

}  // namespace forest::render
