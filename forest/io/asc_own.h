// SPDX-License-Identifier: Apache-2.0
// Comments by which write_asc says what ASC has no word for (asc_words.h), as they are read: what they say is of the outline, the
// branch or the spine they stand in.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string_view>
#include <vector>

#include "forest/morphology/morphology.h"

namespace forest::io {

struct AscOwn {
  struct Section {
    SectionKind kind;
    std::int32_t tag, soma_point;
  };

  std::vector<Point> soma;
  std::vector<std::int32_t> soma_parents;  // of cylinders; empty: a sphere
  std::optional<Section> section;
  std::optional<Spine> spine;

  /// Takes what a comment says; another's says nothing. False when it does not hold the numbers it should.
  /// @param soma_points  that a section may begin at
  bool take(std::string_view comment, std::size_t soma_points);

  /// The soma of all comments in an outline; none when they describe none.
  std::optional<Soma> whole_soma() const;
};

}  // namespace forest::io
