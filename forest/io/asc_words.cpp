// SPDX-License-Identifier: Apache-2.0
#include "forest/io/asc_words.h"

#include <algorithm>
#include <array>
#include <utility>

#include "forest/core/lower.h"
#include "forest/io/numbers.h"
#include "forest/io/words.h"

namespace forest::io {

std::string_view asc_comment(std::string_view text) {
  constexpr std::string_view around = " \t\v\f";
  text.remove_prefix(std::min(text.find_first_not_of("; \t\v\f"), text.size()));
  return text.substr(0, text.find_last_not_of(around) + 1);
}

bool names_soma(std::string_view name) {
  while (!name.empty() &&
         (is_digit(name.back()) || is_blank(name.back()) || name.back() == '_' || name.back() == '-'))
    name.remove_suffix(1);
  return same_word(name, "cellbody") || same_word(name, "cell body") || same_word(name, "soma");
}

SpineShape spine_shape(std::string_view text) {
  constexpr std::array<std::pair<std::string_view, SpineShape>, 5> shapes{
      {{"stubby", SpineShape::stubby},
       {"thin", SpineShape::thin},
       {"mushroom", SpineShape::mushroom},
       {"filopodi", SpineShape::filopodium},
       {"branched", SpineShape::branched}}};
  const std::string words = lower(text);
  for (const auto& [word, shape] : shapes)
    if (words.find(word) != words.npos) return shape;
  return SpineShape::unknown;
}

}  // namespace forest::io
