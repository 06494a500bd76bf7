// SPDX-License-Identifier: Apache-2.0
#include "forest/scene/lettering.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include "forest/core/shortened.h"

namespace forest::scene {
namespace {

// A sign's strokes, apart by spaces; of each point a digit for x, to the right, and a letter for y, down: capitals stand on
// m and reach up to a, small letters to e, and some hang down to q. A point twice is a dot.
struct Sign {
  std::string_view text, strokes;
};
constexpr Sign signs[] = {
    {"0", "2a5a7c7k5m2m0k0c2a"},
    {"1", "1c4a4m"},
    {"2", "0c2a5a7c7e0m7m"},
    {"3", "0b2a5a7c7d5f3f 5f7h7k5m2m0l"},
    {"4", "5m5a0i7i"},
    {"5", "7a1a0f2e5e7g7k5m2m0l"},
    {"6", "6a3a0d0k2m5m7k7h5f2f0h"},
    {"7", "0a7a3m"},
    {"8", "2f0d0c2a5a7c7d5f2f0h0k2m5m7k7h5f"},
    {"9", "1m4m7j7c5a2a0c0e2g5g7e"},
    {"A", "0m4a8m 1i7i"},
    {"B", "0f5f7h7k5m0m0a4a6c6d4f"},
    {"C", "7c5a2a0c0k2m5m7k"},
    {"D", "0a4a7d7j4m0m0a"},
    {"E", "6a0a0m6m 0f5f"},
    {"F", "6a0a0m 0f5f"},
    {"G", "7c5a2a0c0k2m5m7k7g4g"},
    {"H", "0a0m 7a7m 0f7f"},
    {"I", "0a0m"},
    {"J", "5a5k3m2m0k"},
    {"K", "0a0m 6a0h 2f6m"},
    {"L", "0a0m6m"},
    {"M", "0m0a4h8a8m"},
    {"N", "0m0a7m7a"},
    {"O", "3a5a8d8j5m3m0j0d3a"},
    {"P", "0m0a5a7c7e5g0g"},
    {"Q", "3a5a8d8j5m3m0j0d3a 5j8m"},
    {"R", "0m0a5a7c7e5g0g 4g7m"},
    {"S", "7c5a2a0c0d2f5f7h7k5m2m0k"},
    {"T", "0a8a 4a4m"},
    {"U", "0a0k2m5m7k7a"},
    {"V", "0a4m8a"},
    {"W", "0a2m4e6m8a"},
    {"X", "0a7m 7a0m"},
    {"Y", "0a4g8a 4g4m"},
    {"Z", "0a7a0m7m"},
    {"a", "1e4e5g5m 5i2i0j0l1m3m5k"},
    {"b", "0a0m 0g2e4e6g6k4m2m0k"},
    {"c", "5f4e2e0g0k2m4m5l"},
    {"d", "6a6m 6g4e2e0g0k2m4m6k"},
    {"e", "0i6i6g4e2e0g0k2m4m6l"},
    {"f", "4a3a2b2m 0e4e"},
    {"g", "6e6o4q2q0p 6g4e2e0g0k2m4m6k"},
    {"h", "0a0m 0g2e4e6g6m"},
    {"i", "0e0m 0b0b"},
    {"j", "2e2o1q0q 2b2b"},
    {"k", "0a0m 5e0j 2h5m"},
    {"l", "0a0m"},
    {"m", "0e0m 0g2e3e4g4m 4g6e7e8g8m"},
    {"n", "0e0m 0g2e4e6g6m"},
    {"o", "2e4e6g6k4m2m0k0g2e"},
    {"p", "0e0q 0g2e4e6g6k4m2m0k"},
    {"q", "6e6q 6g4e2e0g0k2m4m6k"},
    {"r", "0e0m 0g2e4e"},
    {"s", "5f4e1e0f0g1h4i5j5l4m1m0l"},
    {"t", "2b2k3m4m 0e4e"},
    {"u", "0e0k2m4m6k 6e6m"},
    {"v", "0e3m6e"},
    {"w", "0e2m4g6m8e"},
    {"x", "0e5m 5e0m"},
    {"y", "0e3m 6e2q0q"},
    {"z", "0e5e0m5m"},
    {"µ", "0e0q 0k2m4m6k 6e6m"},
    {"μ", "0e0q 0k2m4m6k 6e6m"},
    {".", "0m0m"},
    {",", "1m0o"},
    {":", "0f0f 0m0m"},
    {"-", "0h4h"},
    {"−", "0h6h"},
    {"–", "0h5h"},
    {"+", "0h6h 3e3k"},
    {"×", "0e5k 5e0k"},
    {"·", "0h0h"},
    {"*", "0f4j 4f0j 2e2k"},
    {"/", "0m5a"},
    {"=", "0f5f 0j5j"},
    {"<", "5e0h5k"},
    {">", "0e5h0k"},
    {"≤", "5d0g5j 0m5m"},
    {"≥", "0d5g0j 0m5m"},
    {"^", "0c2a4c"},
    {"_", "0n6n"},
    {"(", "2a0d0j2m"},
    {")", "0a2d2j0m"},
    {"[", "2a0a0m2m"},
    {"]", "0a2a2m0m"},
    {"%", "0m7a 1b1b 6l6l"},
    {"!", "0a0i 0m0m"},
    {"\"", "0a0d 3a3d"},
    {"#", "2b1l 5b4l 0e6e 0i6i"},
    {"$", "6d4c2c0d0e1f5h6i6j4k2k0j 3a3m"},
    {"&", "7g4m2m0k0i4e4c3a2a1b1d7m"},
    {";", "1f1f 1m0o"},
    {"?", "0c1a4a5c5d3g3i 3m3m"},
    {"@", "6i5k3k2i2g3e5e6g6i7k8j8e6b3b0e0j3m6m"},
    {"\\", "0a5m"},
    {"`", "0a2c"},
    {"{", "3a2a1c1f0g1h1k2m3m"},
    {"|", "0a0o"},
    {"}", "0a1a2c2f3g2h2k1m0m"},
    {"~", "0i1h2h4i5i6h"},
    {"…", "0m0m 3m3m 6m6m"},
    {"—", "0h8h"},
    {"’", "1a0c"},
    {"‘", "0a1c"},
    {"ß", "0m0c1a3a4b4d2f4g5h5k4m2m"},
    {"ø", "2e4e6g6k4m2m0k0g2e 0m6e"},
    {"Ø", "3a5a8d8j5m3m0j0d3a 1m7a"},
    {"æ", "1e3e4g4m 4i1i0j0l1m3m4k 4i8i8g7e5e4g 4k5m7m8l"},
    {"Æ", "0m3a8a 5a5m8m 2h5h 5f7f"},
    {"ı", "0e0m"},
    {"ł", "1a1m 0i2f"},
    {"Ł", "1a1m7m 0i3e"},
    {"α", "6e5k4m2m0k0g2e4e5g6m"},
    {"β", "0q0c1a3a4c4d3f1f 3f5h5k3m1m0l"},
    {"γ", "0e1e3j5e 3j3q"},
    {"δ", "4e1c1b2a4a 3e5f6h6k4m2m0k0h2e3e"},
    {"ε", "5f4e1e0f0g1h3h 1h0i0l1m4m5l"},
    {"ζ", "0a4a1d0g0k1m3m4n3p"},
    {"η", "0e0m 0g2e3e5g5q"},
    {"θ", "2a4a6d6j4m2m0j0d2a 0g6g"},
    {"κ", "0e0m 5e0i 2h5m"},
    {"λ", "0a1a5m 3g0m"},
    {"ν", "0e3m5e"},
    {"ξ", "4a1a0c1e3e 1e0g0k1m3m4n3p"},
    {"π", "0e7e 2e2m 5e5m"},
    {"ρ", "0q0g2e4e6g6k4m2m0k"},
    {"σ", "7e2e0g0k2m4m6k6g4e"},
    {"ς", "5f4e2e0g0k2m4n3p"},
    {"τ", "0e5e 2e2k3m4m"},
    {"υ", "0e0k2m3m5k5e"},
    {"φ", "4c4q 2e0g0k2m6m8k8g6e2e"},
    {"χ", "0e5q 5e0q"},
    {"ψ", "0e0i2k6k8i8e 4c4q"},
    {"ω", "1e0h0k1m3m4k4h 4k5m7m8k8h7e"},
    {"Γ", "0m0a6a"},
    {"Δ", "0m4a8m0m"},
    {"Θ", "3a5a8d8j5m3m0j0d3a 2g6g"},
    {"Λ", "0m4a8m"},
    {"Ξ", "0a6a 1g5g 0m6m"},
    {"Π", "0m0a7a7m"},
    {"Σ", "7a0a4g0m7m"},
    {"Φ", "4a4m 2c0e0i2k6k8i8e6c2c"},
    {"Ψ", "0a0e2h6h8e8a 4a4m"},
    {"Ω", "0m2m2k0h0d3a5a8d8h6k6m8m"},
    {"'", "0a0c"},
    {"°", "1a2a3b3c2d1d0c0b1a"},
    {"²", "0b1a2a3b3c0f3f"},
    {"³", "0a3a1c3d3e2f0f"},
};
// A letter with a mark above or below its middle.
struct Marked {
  std::string_view text, letter, mark;
};
constexpr Marked marked[] = {
    {"ä", "a", "¨"}, {"ë", "e", "¨"}, {"ï", "ı", "¨"}, {"ö", "o", "¨"}, {"ü", "u", "¨"}, {"ÿ", "y", "¨"},
    {"Ä", "A", "¨"}, {"Ë", "E", "¨"}, {"Ï", "I", "¨"}, {"Ö", "O", "¨"}, {"Ü", "U", "¨"}, {"á", "a", "´"},
    {"é", "e", "´"}, {"í", "ı", "´"}, {"ó", "o", "´"}, {"ú", "u", "´"}, {"ý", "y", "´"}, {"ć", "c", "´"},
    {"ń", "n", "´"}, {"ś", "s", "´"}, {"ź", "z", "´"}, {"Á", "A", "´"}, {"É", "E", "´"}, {"Í", "I", "´"},
    {"Ó", "O", "´"}, {"Ú", "U", "´"}, {"Ý", "Y", "´"}, {"Ś", "S", "´"}, {"à", "a", "`"}, {"è", "e", "`"},
    {"ì", "ı", "`"}, {"ò", "o", "`"}, {"ù", "u", "`"}, {"À", "A", "`"}, {"È", "E", "`"}, {"Ì", "I", "`"},
    {"Ò", "O", "`"}, {"Ù", "U", "`"}, {"â", "a", "^"}, {"ê", "e", "^"}, {"î", "ı", "^"}, {"ô", "o", "^"},
    {"û", "u", "^"}, {"Â", "A", "^"}, {"Ê", "E", "^"}, {"Î", "I", "^"}, {"Ô", "O", "^"}, {"Û", "U", "^"},
    {"ã", "a", "~"}, {"ñ", "n", "~"}, {"õ", "o", "~"}, {"Ã", "A", "~"}, {"Ñ", "N", "~"}, {"Õ", "O", "~"},
    {"å", "a", "°"}, {"Å", "A", "°"}, {"ů", "u", "°"}, {"č", "c", "ˇ"}, {"ě", "e", "ˇ"}, {"ř", "r", "ˇ"},
    {"š", "s", "ˇ"}, {"ž", "z", "ˇ"}, {"Č", "C", "ˇ"}, {"Ř", "R", "ˇ"}, {"Š", "S", "ˇ"}, {"Ž", "Z", "ˇ"},
    {"ç", "c", "¸"}, {"Ç", "C", "¸"}, {"ş", "s", "¸"}, {"Ş", "S", "¸"}, {"ą", "a", "¸"}, {"ę", "e", "¸"},
};
// Over a small letter, four parts wide; three parts higher over a capital.
constexpr Sign marks[] = {{"¨", "1c1c 3c3c"}, {"´", "3b1c"},   {"`", "1b3c"},       {"^", "1c2b3c"},
                          {"~", "0c1b3c4b"},  {"ˇ", "1b2c3b"}, {"°", "1b2a3b2c1b"}, {"¸", "2m3n2o1o"}};
constexpr std::string_view unknown = "0a6a6m0m0a";
constexpr float em = 12.f;                      // parts that a capital is high
constexpr float gap = 3.2f, space = 4.f;        // between signs; of a space besides
constexpr float pen = 1.45f, thinnest = 1.15f;  // a stroke's width: parts of em, and pixels at least

// The next sign of a text, which it loses.
std::string_view next(std::string_view& text) {
  std::size_t bytes = 1;
  while (bytes < text.size() && (static_cast<unsigned char>(text[bytes]) & 0xc0) == 0x80) ++bytes;
  const std::string_view sign = text.substr(0, bytes);
  text.remove_prefix(bytes);
  return sign;
}

std::string strokes_of(std::string_view sign) {
  if (const auto* both = std::ranges::find(marked, sign, &Marked::text); both != std::end(marked)) {
    std::string strokes = strokes_of(both->letter);
    char widest = '0';
    for (const char c : strokes)
      if (c >= '0' && c <= '9') widest = std::max(widest, c);
    const bool capital = strokes.find('a') != std::string::npos, below = both->mark == "¸";
    const int right = (widest - '0' - 4) / 2, up = capital && !below ? 3 : 0;
    strokes += ' ';
    const std::string_view mark = std::ranges::find(marks, both->mark, &Sign::text)->strokes;
    for (std::size_t i = 0; i < mark.size(); ++i)
      strokes += mark[i] == ' ' ? ' ' : char(mark[i] >= 'a' ? mark[i] - up : mark[i] + right);
    return strokes;
  }
  const auto* known = std::ranges::find(signs, sign, &Sign::text);
  return std::string(known == std::end(signs) ? unknown : known->strokes);
}

// Of a sign that begins at 0, in parts of em.
float advance(std::string_view sign) {
  if (sign == " ") return space + gap;
  float widest = 0.f;
  for (const char c : strokes_of(sign))
    if (c >= '0' && c <= '9') widest = std::max(widest, float(c - '0'));
  return widest + gap;
}

float distance(const Vec2& p, const Vec2& a, const Vec2& b) {
  const Vec2 way = b - a;
  const float length = way.squaredNorm();
  const float t = length > 0.f ? std::clamp((p - a).dot(way) / length, 0.f, 1.f) : 0.f;
  return (p - a - t * way).norm();
}

void blend(frame::Image& image, std::size_t x, std::size_t y, const Vec3& colour, float share) {
  std::uint8_t* pixel = &image.pixels[4 * (y * image.width + x)];
  const float before = float(pixel[3]) / 255.f, opacity = before + share * (1.f - before);
  if (!(opacity > 0.f)) return;
  const float own = share / opacity;  // of the colour: where the picture is clear it is all
  for (int c = 0; c < 3; ++c)
    pixel[c] = std::uint8_t(std::lround(float(pixel[c]) + own * (255.f * colour[c] - float(pixel[c]))));
  pixel[3] = std::uint8_t(std::lround(255.f * opacity));
}

// The whole pixels that a stretch touches, within [0, size).
std::pair<std::size_t, std::size_t> touched(float first, float last, std::uint32_t size) {
  const auto within = [&](float x) { return std::size_t(std::clamp(x, 0.f, float(size))); };
  return {within(std::floor(first)), within(std::ceil(last))};
}

}  // namespace

float Lettering::width(std::string_view text) const {
  float parts = 0.f;
  while (!text.empty()) parts += advance(next(text));
  return std::max(0.f, parts - gap) * height / em;
}

std::string Lettering::shortened(std::string text, float room) const {
  if (width(text) <= room) return text;
  constexpr std::size_t least = 3;
  std::size_t most = characters(text);
  std::string out = std::move(text);
  for (const std::string whole = out; most > least && width(out) > room;)
    out = forest::shortened(whole, --most);
  return out;
}

void Lettering::write(frame::Image& image, std::string_view text, float left, float base) const {
  const float part = height / em, radius = .5f * std::max(thinnest, pen * part);
  while (!text.empty()) {
    const std::string_view sign = next(text);
    if (sign != " ") {
      std::vector<std::pair<Vec2, Vec2>> lines;
      const std::string strokes = strokes_of(sign);
      for (std::size_t i = 0; i + 3 < strokes.size(); i += 2) {
        if (strokes[i] == ' ') ++i;
        if (strokes[i + 2] == ' ') continue;
        const auto point = [&](std::size_t at) {
          return Vec2(left + part * float(strokes[at] - '0'), base + part * float(strokes[at + 1] - 'm'));
        };
        lines.emplace_back(point(i), point(i + 2));
      }
      const auto [x0, x1] =
          touched(left - radius - 1.f, left + part * advance(sign) + radius + 1.f, image.width);
      const auto [y0, y1] =
          touched(base - 1.4f * height - radius - 1.f, base + part * 5.f + radius, image.height);
      for (std::size_t y = y0; y < y1; ++y)
        for (std::size_t x = x0; x < x1; ++x) {
          float nearest = INFINITY;
          for (const auto& [a, b] : lines)
            // A point as thin as a stroke would be overlooked.
            nearest = std::min(
                nearest, distance({float(x) + .5f, float(y) + .5f}, a, b) - (a == b ? .6f * radius : 0.f));
          if (const float share = std::clamp(radius + .5f - nearest, 0.f, 1.f); share > 0.f)
            blend(image, x, y, colour, share);
        }
    }
    left += part * advance(sign);
  }
}

void fill(frame::Image& image, const Box& box, const Vec3& colour, float opacity) {
  const auto [x0, x1] = touched(box.left, box.right, image.width);
  const auto [y0, y1] = touched(box.top, box.bottom, image.height);
  const auto share = [](std::size_t at, float first, float last) {
    return std::max(0.f, std::min(float(at + 1), last) - std::max(float(at), first));
  };
  for (std::size_t y = y0; y < y1; ++y)
    for (std::size_t x = x0; x < x1; ++x)
      blend(image, x, y, colour, opacity * share(x, box.left, box.right) * share(y, box.top, box.bottom));
}

}  // namespace forest::scene
