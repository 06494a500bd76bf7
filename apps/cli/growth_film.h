// SPDX-License-Identifier: Apache-2.0
// How neurons grew, as a film: what 'grow --time-lapse' wrote of them, step after step, where each of them hangs when it is grown.
#pragma once

#include <filesystem>
#include <span>

#include "apps/cli/artist.h"

namespace forest::cli {

/// @param folders  with NAME-step000010.swc and so on for each neuron, and NAME.swc, as it became
/// Throws InputError where there are none.
FilmFigures film_growth(std::span<const std::filesystem::path> folders, const FilmPlan& plan, Drawer drawer,
                        const std::filesystem::path& out, Progress& progress);

}  // namespace forest::cli
