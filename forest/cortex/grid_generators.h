// SPDX-License-Identifier: Apache-2.0
// The generators behind the table in grid.h; each file that defines some says where they come from.
#pragma once

#include "forest/cortex/grid.h"

namespace forest::cortex {

// grid_algebraic.cpp
Grid transfinite(Grid grid, const GridOptions& options);
Grid tricubic(Grid grid, const GridOptions& options);
// grid_elliptic.cpp
Grid winslow(Grid grid, const GridOptions& options);
// grid_variational.cpp
Grid length(Grid grid, const GridOptions& options);
Grid area_orthogonality(Grid grid, const GridOptions& options);
Grid liao(Grid grid, const GridOptions& options);
Grid foldover_free(Grid grid, const GridOptions& options);

}  // namespace forest::cortex
