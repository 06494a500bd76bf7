// SPDX-License-Identifier: Apache-2.0
#include "forest/render/cpu/splat.h"

#include <algorithm>
#include <array>
#include <atomic>
#include <cmath>
#include <utility>
#include <vector>

#include "forest/core/clones.h"
#include "forest/core/parallel.h"
#include "forest/render/cpu/primitives.h"

namespace forest::render::cpu {
namespace {

constexpr std::size_t items_a_chunk = 64, balls_a_chunk = 4096;
constexpr std::uint32_t number_bits = 13;  // of a thing's number within its chunk
static_assert(items_a_chunk * run <= 1u << number_bits && balls_a_chunk <= 1u << number_bits);
constexpr float look_every = 1.f;  // times a square's pixels are drawn; between, what they hide is found out

// Which thing of which chunk: a number, above it the kind, above that the chunk.
enum class What : std::uint32_t { solid, dot, stroke };
constexpr std::uint32_t what_bits = 2;
constexpr std::size_t chunks_at_once = std::size_t(1) << (32 - number_bits - what_bits);

// What some items, that follow one another, give to be drawn.
struct Chunk {
  std::vector<Solid> solids;
  std::vector<Dot> dots;
  std::vector<Stroke> strokes;
  struct Range {  // of squares
    std::int16_t left, top, right, bottom;
  };
  std::vector<Range> ranges_of_solids, ranges_of_dots, ranges_of_strokes;

  void clear() {
    solids.clear(), dots.clear(), strokes.clear();
    ranges_of_solids.clear(), ranges_of_dots.clear(), ranges_of_strokes.clear();
  }
  // Calls take(range, code) for everything, the codes without the chunk's number.
  void each(auto&& take) const {
    const auto all = [&](const std::vector<Range>& ranges, What what) {
      std::uint32_t code = std::uint32_t(what) << number_bits;
      for (const Range& range : ranges) take(range, code++);
    };
    all(ranges_of_solids, What::solid), all(ranges_of_dots, What::dot), all(ranges_of_strokes, What::stroke);
  }
};

// Calls take(thing) for that of a code.
[[gnu::always_inline]] inline void with(const Chunk* chunks, std::uint32_t code, auto&& take) {
  const Chunk& chunk = chunks[code >> (number_bits + what_bits)];
  const std::size_t number = code & ((1u << number_bits) - 1);
  const auto what = What(code >> number_bits & ((1u << what_bits) - 1));
  if (what == What::stroke) return take(chunk.strokes[number]);
  if (what == What::solid) return take(chunk.solids[number]);
  take(chunk.dots[number]);
}

}  // namespace

// Things sorted into the squares that they touch.
class Splatter::Sorted {
 public:
  // Calls gather(i, chunk) for every chunk, which it fills.
  void sort(const Canvas& canvas, std::size_t chunks, auto&& gather) {
    if (chunks_.size() < chunks) chunks_.resize(chunks);
    const std::size_t squares = canvas.squares();
    const auto wide = std::size_t(canvas.squares_wide());
    places_.assign(chunks * squares, 0);
    const auto each_square = [&](const Chunk::Range& r, auto&& take) {
      for (std::int32_t y = r.top; y <= r.bottom; ++y)
        for (std::int32_t x = r.left; x <= r.right; ++x) take(std::size_t(y) * wide + std::size_t(x));
    };
    parallel_for(chunks, 1, [&](std::size_t c) {
      chunks_[c].clear();
      gather(c, chunks_[c]);
      chunks_[c].each([&](const Chunk::Range& range, std::uint32_t) {
        each_square(range, [&](std::size_t square) { ++places_[c * squares + square]; });
      });
    });
    starts_.resize(squares + 1);
    std::uint32_t all = 0;
    for (std::size_t square = 0; square < squares; ++square) {
      starts_[square] = all;
      for (std::size_t c = 0; c < chunks; ++c) {
        const std::uint32_t here = places_[c * squares + square];
        places_[c * squares + square] = all;
        all += here;
      }
    }
    starts_[squares] = all;
    if (things_.size() < all) things_.resize(all);
    parallel_for(chunks, 1, [&](std::size_t c) {
      chunks_[c].each([&](const Chunk::Range& range, std::uint32_t code) {
        each_square(range, [&](std::size_t square) {
          things_[places_[c * squares + square]++] = std::uint32_t(c) << (number_bits + what_bits) | code;
        });
      });
    });
  }

  std::span<const std::uint32_t> of(std::size_t square) const {
    return std::span(things_).subspan(starts_[square], starts_[square + 1] - starts_[square]);
  }
  const Chunk* chunks() const { return chunks_.data(); }

 private:
  std::vector<Chunk> chunks_;
  std::vector<std::uint32_t>
      places_;  // of each chunk in each square: how many things, then where the next one goes
  std::vector<std::uint32_t> starts_, things_;
};

namespace {

// Where an item is seen at most, and the code of its nearest depth; the whole picture when the eye is within or near it.
struct Extent {
  Box box{-INFINITY, -INFINITY, INFINITY, INFINITY};
  float nearest_code = 0.f;

  Extent(const Picture& picture, const frame::Item& item) {
    const frame::Constants& c = picture.constants;
    const Vec3 centre = picture.to_camera * (Vec3(item.x, item.y, item.z) - picture.eye);
    const float nearest = centre.z() - item.radius;
    if (!(nearest > c.near)) return;
    const float scale = c.focal / lens(c, centre.z());
    const float reach =
        c.focal * item.radius * (c.parallel + c.converge * centre.norm() / (centre.z() * nearest)) + 2.f;
    const float x = c.centre_x + scale * centre.x(), y = c.centre_y - scale * centre.y();
    box = {x - reach, y - reach, x + reach, y + reach};
    nearest_code = depth_code(nearest);
  }
};

// Items lie in the order of depth, their segments anywhere.
constexpr std::size_t ahead = 3, things_ahead = 6;
void prefetch(const frame::Geometry& geometry, const frame::Item& item) {
  const auto* at = reinterpret_cast<const char*>(&geometry.segments[item.first_segment]);
  for (std::size_t i = 0; i < 8; i += 2) __builtin_prefetch(at + i * sizeof(frame::Segment));
  if (!geometry.straw(item)) __builtin_prefetch(&geometry.instances[item.instance]);
}

// Brings things to the picture, but for what is hidden already.
class Gatherer {
 public:
  Gatherer(const Picture& picture, const Canvas& canvas)
      : picture_(picture),
        canvas_(canvas),
        whole_{0, 0, canvas.width(), canvas.height()},
        crop_(picture.constants, picture.spread) {}

  enum class Kind { capsules, dots, lines };
  // Returns how many of the segments are to be drawn.
  std::uint64_t add(const frame::Item& item, const std::uint8_t* entries, Kind kind, Chunk& chunk) {
    const frame::Constants& c = picture_.constants;
    if (const Extent e(picture_, item); !item.drawn || hidden(e.box, e.nearest_code)) return 0;
    const auto [turn, at] = picture_.standing(item);
    load(picture_, item, entries, r_);
    if (kind == Kind::dots) return add_beads(item, turn, at, chunk);
    const bool straws = picture_.geometry.straw(item);
    place(c, turn, at, straws ? 0.f : c.least_radius, r_);
    if (kind == Kind::capsules) return add_near(chunk);
    if (straws) lengthen(c, r_);
    if (lines_hidden(thinnest_of(c, straws))) return 0;
    prepare_lines(c, straws, picture_.spread, r_);
    for (std::size_t i = 0; i < r_.count; ++i)
      if (r_.opacity[i]) look_at_line(i);
    return add_lines(chunk);
  }
  void add(const frame::Overlay& overlay, Chunk& chunk) {
    load(overlay, picture_, r_);
    place(picture_.constants, picture_.to_camera, picture_.to_camera * -picture_.eye, 0.f, r_);
    add_near(chunk);
  }
  void add(const frame::Ball& ball, std::uint32_t number, Chunk& chunk) const {
    const Vec3 at = picture_.to_camera * (ball.centre - picture_.eye);
    if (ball.opacity == 0 || !(at.z() > picture_.constants.near)) return;
    put(Dot(picture_.constants, ball, at, number), chunk.dots, chunk.ranges_of_dots);
  }

 private:
  const Picture& picture_;
  const Canvas& canvas_;
  Square whole_;
  Crop crop_;
  Run r_{};
  std::array<std::uint8_t, run> lines_;  // numbers of those of its segments that are seen as lines
  std::size_t line_count_ = 0;

  bool hidden(const Box& b, float nearest_code) const {
    return canvas_.hidden(whole_, b.left, b.top, b.right, b.bottom, nearest_code);
  }
  // Whether all lines of a run that is placed are hidden together; they are looked at one by one later. With more than one sample a line
  // may stand for many, and be any width.
  bool lines_hidden(float thinnest) const {
    if (picture_.constants.subframes > 1) return false;
    Box b{INFINITY, INFINITY, -INFINITY, -INFINITY};
    float nearest = INFINITY, widest = 0.f;
    for (std::size_t i = 0; i < r_.count; ++i) {
      if (r_.width[i] < 0.f) continue;
      b = {smaller(b.left, smaller(r_.px[i], r_.qx[i])), smaller(b.top, smaller(r_.py[i], r_.qy[i])),
           larger(b.right, larger(r_.px[i], r_.qx[i])), larger(b.bottom, larger(r_.py[i], r_.qy[i]))};
      nearest = smaller(nearest, smaller(r_.code_a[i], r_.code_b[i])), widest = larger(widest, r_.width[i]);
    }
    const float reach = .5f * (larger(thinnest, 1.4143f * widest) + 1.f) + picture_.spread;
    return hidden({b.left - reach, b.top - reach, b.right + reach, b.bottom + reach}, nearest);
  }
  Tiles tiles_of_line(std::size_t i) const {
    return {r_.tile_left[i], r_.tile_top[i], r_.tile_right[i], r_.tile_bottom[i]};
  }
  // Adds make() to a list and to the squares, where there are any.
  static bool place_in(const Square& s, auto& list, std::vector<Chunk::Range>& ranges, auto&& make) {
    if (s.left > s.right || s.top > s.bottom) return false;
    list.push_back(make());
    ranges.push_back(
        {std::int16_t(s.left), std::int16_t(s.top), std::int16_t(s.right), std::int16_t(s.bottom)});
    return true;
  }
  template <class Thing>
  bool put(const Thing& thing, std::vector<Thing>& list, std::vector<Chunk::Range>& ranges) const {
    const Box box = thing.box(picture_.spread);
    return !hidden(box, thing.nearest_code()) &&
           place_in(canvas_.touched(box.left, box.top, box.right, box.bottom), list, ranges,
                    [&] { return thing; });
  }
  // Of lines, it is found out which can be seen, and then these are lit and added.
  void look_at_line(std::size_t i) {
    if (r_.line_width[i] > 0.f && !canvas_.hidden(tiles_of_line(i), r_.nearest[i]))
      lines_[line_count_++] = std::uint8_t(i);
  }
  std::uint64_t add_lines(Chunk& chunk) {
    const std::span<const std::uint8_t> lines(lines_.data(), std::exchange(line_count_, 0));
    if (!lines.empty()) light(picture_.constants, picture_.light, r_);
    std::uint64_t added = 0;
    for (const std::size_t i : lines)
      added += place_in(canvas_.touched(tiles_of_line(i)), chunk.strokes, chunk.ranges_of_strokes,
                        [&] { return Stroke(r_, i); });
    return added;
  }
  // Of near ones, what is less than that wide at both ends is a line.
  static constexpr float thin = .75f;
  std::uint64_t add_near(Chunk& chunk) {
    const frame::Constants& c = picture_.constants;
    const float margin = margin_of(picture_.spread);
    surround(c, margin, r_);
    bool any_thin = false;
    for (std::size_t i = 0; i < r_.count; ++i) any_thin |= r_.width[i] >= 0.f && r_.widest[i] < thin;
    std::uint64_t added = 0;
    for (std::size_t i = 0; i < r_.count; ++i) {
      if (r_.opacity[i] == 0 || r_.width[i] < 0.f || r_.widest[i] < thin) continue;
      if (!hidden({r_.left[i], r_.top[i], r_.right[i], r_.bottom[i]}, r_.front[i]) && trim(c, crop_, r_, i))
        added += put(Solid(r_, i), chunk.solids, chunk.ranges_of_solids);
    }
    if (!any_thin) return added;
    prepare_lines(c, false, picture_.spread, r_);
    for (std::size_t i = 0; i < r_.count; ++i)
      if (r_.opacity[i] && r_.width[i] >= 0.f && r_.widest[i] < thin) look_at_line(i);
    return added + add_lines(chunk);
  }
  // The one segment of a dot.
  std::uint64_t add_beads(const frame::Item& item, const Mat3& turn, const Vec3& at, Chunk& chunk) {
    const frame::Constants& c = picture_.constants;
    const float depth = picture_.to_camera.row(2).dot(Vec3(item.x, item.y, item.z) - picture_.eye);
    const float pixels_a_unit = c.focal / lens(c, std::max(depth, c.near));
    if (!picture_.geometry.straw(item))
      for (float* radius : {&r_.ra[0], &r_.rb[0]})
        *radius = std::max(*radius, c.least_radius / pixels_a_unit);
    const Beads beads(r_, pixels_a_unit);
    const float of_item =
        frame::forest_dot_rank(item.instance, (r_.entry[0] & 7) == 1 ? 0u : item.first_segment);
    bool any = false;
    for (std::uint32_t k = 0; k < beads.count; ++k) {
      beads.put(k, r_);
      place(c, turn, at, 0.f, r_);
      const float rank = fraction(of_item + float(k) * .3819660f + golden * float(c.subframe));
      if (r_.opacity[0] && r_.width[0] >= 0.f) any |= put(Dot(c, r_, rank), chunk.dots, chunk.ranges_of_dots);
    }
    return any;
  }
};

// How many pixels it covers.
[[gnu::always_inline]] inline float pixels_of(const Box& b, const Square& s) {
  const float wide = smaller(b.right, float(s.right)) - larger(b.left, float(s.left)),
              high = smaller(b.bottom, float(s.bottom)) - larger(b.top, float(s.top));
  return larger(wide, 1.f) * larger(high, 1.f);
}

template <int S>
[[gnu::always_inline]] inline void draw_square(const Picture& picture, const Samples<S>& samples,
                                               const Chunk* chunks, std::span<const std::uint32_t> things,
                                               const Square& square, Canvas& canvas) {
  Window<S> window(canvas, square);
  Rows<S> rows(samples);
  const float area = float((square.right - square.left) * (square.bottom - square.top));
  float drawn = 0.f;
  const auto hidden = [&](const auto& t) __attribute__((always_inline)) {
    if constexpr (std::is_same_v<decltype(t), const Stroke&>) {
      return window.hidden(Tiles{t.left, t.top, t.right, t.bottom}, t.nearest);
    } else {
      const Box b = t.box(picture.spread);
      return window.hidden(b.left, b.top, b.right, b.bottom, t.nearest_code());
    }
  };
  for (std::size_t n = 0; n < things.size(); ++n) {
    if (n + things_ahead < things.size())
      with(
          chunks, things[n + things_ahead], [](const auto& t) __attribute__((always_inline)) {
            __builtin_prefetch(&t);
            __builtin_prefetch(reinterpret_cast<const char*>(&t) + sizeof t - 1);
          });
    with(
        chunks, things[n], [&](const auto& t) __attribute__((always_inline)) {
          if (hidden(t)) return;
          if (t.opacity != 255) {
            Door<S> door(window, samples, picture.constants.subframes, t.opacity, t.key);
            if (!door.shut()) draw<S>(picture, samples, t, door);
          } else if constexpr (std::is_same_v<decltype(t), const Stroke&>) {
            rows.add(t, window);
          } else {
            draw<S>(picture, samples, t, window);
            drawn += pixels_of(t.box(picture.spread), square);
          }
        });
    if (drawn + float(rows.count()) > look_every * area)
      rows.draw(window), rows.forget(), canvas.look(square), drawn = 0.f;
  }
  rows.draw(window);
}

// One square's part of a picture.
struct Job {
  const Picture& picture;
  const Chunk* chunks;
  std::span<const std::uint32_t> things;
  Square square;
  Canvas& canvas;
};

// A copy for each number of samples, and of each for the kinds of processors.
FOREST_CLONES void draw_1(const Job& j, const Samples<1>& samples) {
  draw_square<1>(j.picture, samples, j.chunks, j.things, j.square, j.canvas);
}
FOREST_CLONES void draw_4(const Job& j, const Samples<4>& samples) {
  draw_square<4>(j.picture, samples, j.chunks, j.things, j.square, j.canvas);
}
FOREST_CLONES void draw_16(const Job& j, const Samples<16>& samples) {
  draw_square<16>(j.picture, samples, j.chunks, j.things, j.square, j.canvas);
}

void draw_squares(const Picture& picture, const Splatter::Sorted& sorted, Canvas& canvas) {
  const frame::Constants& c = picture.constants;
  const auto each = [&](auto draw, const auto& samples) {
    parallel_for(canvas.squares(), 1, [&](std::size_t n) {
      const Job job{picture, sorted.chunks(), sorted.of(n), canvas.square(n), canvas};
      if (job.things.empty()) return;
      draw(job, samples);
      canvas.look(job.square);
    });
  };
  switch (canvas.samples()) {
    case 1:
      return each(draw_1, Samples<1>(c.subframe, c.subframes));
    case 4:
      return each(draw_4, Samples<4>(c.subframe, c.subframes));
    default:
      return each(draw_16, Samples<16>(c.subframe, c.subframes));
  }
}

// Calls gather(i, chunk) for every chunk, which it fills, and draws them.
void draw_chunks(const Picture& picture, Splatter::Sorted& sorted, Canvas& canvas, std::size_t chunks,
                 auto&& gather) {
  for (std::size_t first = 0; first < chunks; first += chunks_at_once) {
    sorted.sort(canvas, std::min(chunks_at_once, chunks - first),
                [&](std::size_t n, Chunk& chunk) { gather(first + n, chunk); });
    draw_squares(picture, sorted, canvas);
  }
}

}  // namespace

Splatter::Splatter() : sorted_(std::make_unique<Sorted>()) {}
Splatter::~Splatter() = default;

std::uint64_t Splatter::draw(const Picture& picture, const frame::Lists& lists, Canvas& canvas, bool clear,
                             std::span<std::uint8_t> reached) {
  if (clear) parallel_for(canvas.squares(), 1, [&](std::size_t n) { canvas.clear(canvas.square(n)); });
  using Kind = Gatherer::Kind;
  const std::array<std::span<const frame::Item>, 3> items{lists.capsules, lists.dots, lists.lines};
  const std::array<std::span<const std::uint8_t>, 3> entries{lists.entries.capsules, lists.entries.dots,
                                                             lists.entries.lines};
  const frame::Band whole{std::uint32_t(lists.dots.size()), std::uint32_t(lists.lines.size()),
                          std::uint32_t(lists.capsules.size())};
  std::atomic<std::uint64_t> drawn = 0;
  std::array<std::size_t, 3> begin{};
  for (const frame::Band& band : lists.bands.empty() ? std::span(&whole, 1) : lists.bands) {
    const std::array<std::size_t, 3> end{band.capsules, band.dots, band.lines};
    // Chunks of one kind each.
    struct Piece {
      Kind kind;
      std::size_t begin, end;
    };
    std::vector<Piece> pieces;
    for (std::size_t kind = 0; kind < 3; ++kind)
      for (std::size_t i = begin[kind]; i < end[kind]; i += items_a_chunk)
        pieces.push_back({Kind(kind), i, std::min(i + items_a_chunk, end[kind])});
    begin = end;
    draw_chunks(picture, *sorted_, canvas, pieces.size(), [&](std::size_t n, Chunk& chunk) {
      const Piece& piece = pieces[n];
      const auto kind = std::size_t(piece.kind);
      const std::span<const frame::Item> list = items[kind];
      const std::size_t each = piece.kind == Kind::dots ? 1 : run;
      Gatherer gatherer(picture, canvas);
      std::uint64_t added = 0;
      for (std::size_t i = piece.begin; i < piece.end; ++i) {
        if (i + ahead < piece.end) prefetch(picture.geometry, list[i + ahead]);
        const std::uint64_t of_item = gatherer.add(
            list[i], entries[kind].empty() ? nullptr : &entries[kind][i * each], piece.kind, chunk);
        if (!of_item) continue;
        added += of_item;
        if (!picture.geometry.straw(list[i]))
          std::atomic_ref(reached[list[i].instance]).store(1, std::memory_order_relaxed);
      }
      drawn += added;
    });
  }
  return drawn;
}

void Splatter::draw(const Picture& picture, std::span<const frame::Overlay> overlays, Canvas& canvas) {
  const std::size_t chunks = (overlays.size() + items_a_chunk - 1) / items_a_chunk;
  draw_chunks(picture, *sorted_, canvas, chunks, [&](std::size_t n, Chunk& chunk) {
    Gatherer gatherer(picture, canvas);
    for (const frame::Overlay& o :
         overlays.subspan(n * items_a_chunk, std::min(items_a_chunk, overlays.size() - n * items_a_chunk)))
      gatherer.add(o, chunk);
  });
}

void Splatter::draw(const Picture& picture, std::span<const frame::Ball> balls, Canvas& canvas) {
  const std::size_t chunks = (balls.size() + balls_a_chunk - 1) / balls_a_chunk;
  draw_chunks(picture, *sorted_, canvas, chunks, [&](std::size_t n, Chunk& chunk) {
    const Gatherer gatherer(picture, canvas);
    for (std::size_t i = n * balls_a_chunk; i < std::min(balls.size(), (n + 1) * balls_a_chunk); ++i)
      gatherer.add(balls[i], std::uint32_t(i), chunk);
  });
}

}  // namespace forest::render::cpu
