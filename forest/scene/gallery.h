// SPDX-License-Identifier: Apache-2.0
// Traced neurons beside one another, none of them planted anywhere: how they are hung, and looked at.
#pragma once

#include <span>
#include <string>
#include <vector>

#include "forest/scene/forest.h"
#include "forest/scene/view.h"

namespace forest::scene {

/// The neurons in rows from the top left, at one scale and as they were traced, x to the right and y upwards. The somata of a row lie
/// at one height. As many rows as leave them largest in a picture.
/// @param aspect  width of that picture over its height
Forest gallery(std::span<const Morphology> neurons, std::vector<std::string> names, float aspect);
/// The same in two steps: where each soma is then, and neurons hung there, as the same ones are before they are grown.
std::vector<Vec3> places_in_gallery(std::span<const Morphology> neurons, float aspect);
Forest hung(std::span<const Morphology> neurons, std::vector<std::string> names,
            std::span<const Vec3> places);
/// Whether a forest was made so.
bool is_gallery(const Forest& forest);

/// From the front along parallel rays, so that all have one scale; coloured by kind.
View view_of_gallery(const Forest& gallery, float aspect, std::span<const frame::State> states = {});
/// All around them, at a distance from which they stay in the picture: the last view is the first.
std::vector<View> around_gallery(const Forest& gallery, float aspect,
                                 std::span<const frame::State> states = {});

/// The name of each below it, where there are several and it has room.
void paint_names(frame::Image& image, const Forest& gallery, const View& view);

}  // namespace forest::scene
