// SPDX-License-Identifier: Apache-2.0
#include "forest/io/asc_own.h"

#include <array>
#include <cmath>
#include <limits>
#include <string>

#include "forest/io/asc_words.h"
#include "forest/io/numbers.h"

namespace forest::io {

bool AscOwn::take(std::string_view comment, std::size_t soma_points) {
  const std::string_view key = comment.substr(0, comment.find(' '));
  const std::string numbers = std::string(comment.substr(key.size())) + '\n';
  const char* p = numbers.data();
  std::array<double, 7> v{};
  std::size_t count = 0;
  for (;;) {
    while (is_blank(*p)) ++p;
    float real = 0.f;
    std::int64_t whole = 0;
    bool exponent = false;
    if (const char* q = p; read_integer(q, whole) && count < v.size() && !(whole == 0 && *p == '-'))
      p = q, v[count++] = double(whole);
    else if (count < v.size() && read_real(p, real, exponent) && std::isfinite(real))
      v[count++] = double(real);
    else
      break;
  }
  const auto f = [&](std::size_t i) { return float(v[i]); };
  const auto whole = [&](std::size_t i, double low, double high) {
    return v[i] == std::floor(v[i]) && v[i] >= low && v[i] <= high;
  };
  bool good = *p == '\n';
  constexpr double most = std::numeric_limits<std::int32_t>::max();
  if (key == asc_sphere_key) {
    good = good && count == 4 && v[3] >= 0. && soma.empty();
    soma = {{f(0), f(1), f(2), f(3)}};
    soma_parents.clear();
  } else if (key == asc_cylinder_key) {
    good = good && count == 5 && v[3] >= 0. && whole(4, -1., most);
    if (soma.empty()) soma_parents.clear();
    soma.push_back({f(0), f(1), f(2), f(3)});
    if (good) soma_parents.push_back(std::int32_t(v[4]));
  } else if (key == asc_section_key) {
    good = good && count == 3 && whole(0, 0., 7.) && v[0] != 1. && whole(1, -most, most) &&
           whole(2, -1., double(soma_points) - 1.);
    if (good) section = {SectionKind(int(v[0])), std::int32_t(v[1]), std::int32_t(v[2])};
  } else if (key == asc_spine_key) {
    good = good && count == 7 && whole(6, 0., double(SpineShape::branched));
    if (good) spine = Spine{{}, f(0), Vec3(f(1), f(2), f(3)), f(4), f(5), static_cast<SpineShape>(int(v[6]))};
  } else {
    return true;
  }
  return good;
}

std::optional<Soma> AscOwn::whole_soma() const {
  bool good = soma.size() == 1 ? soma_parents.empty() : soma_parents.size() == soma.size();
  for (std::size_t i = 0; i < soma_parents.size(); ++i)
    good =
        good && (i == 0 ? soma_parents[i] == -1 : soma_parents[i] >= 0 && soma_parents[i] < std::int32_t(i));
  if (!good) return std::nullopt;
  return Soma{.kind = soma_parents.empty() ? SomaKind::sphere : SomaKind::cylinders,
              .points = soma,
              .parents = soma_parents,
              .contour_starts = {}};
}

}  // namespace forest::io
