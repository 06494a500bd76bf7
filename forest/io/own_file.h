// SPDX-License-Identifier: Apache-2.0
// The first line of a text file that this program wrote, by which it is read to the letter. The file of a neuron without any
// point says so there: one that was cut off behind its header is not taken for it.
#pragma once

#include <string>
#include <string_view>

#include "forest/morphology/morphology.h"

namespace forest::io {

struct OwnFile {
  bool ours = false, without_points = false;
};

inline constexpr std::string_view without_points_words = ", without points";

inline OwnFile own_file(std::string_view line, std::string_view marker) {
  if (!line.starts_with(marker)) return {};
  const std::string_view rest = line.substr(marker.size());
  return {rest.empty() || rest == without_points_words, rest == without_points_words};
}

inline std::string own_line(std::string_view marker, const Morphology& m) {
  const bool nothing = m.sections().empty() && m.soma().kind == SomaKind::none;
  return std::string(marker) + std::string(nothing ? without_points_words : "");
}

}  // namespace forest::io
