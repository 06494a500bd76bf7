// SPDX-License-Identifier: Apache-2.0
// Views as people give them to the programs: a file, or the JSON itself.
#pragma once

#include <string>
#include <vector>

#include "forest/scene/view.h"

namespace forest {

/// As scene::parse_view: a view from a file, or from the text itself when it begins with '{'. Throws InputError.
scene::View read_view(const std::string& file_or_text, const Vec3& up, const scene::View* whole = nullptr);

/// Views one after the other, as the studio records them: one on each line of the file. Throws InputError with the line.
std::vector<scene::View> read_views(const std::string& file, const Vec3& up,
                                    const scene::View* whole = nullptr);

}  // namespace forest
