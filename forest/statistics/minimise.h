// SPDX-License-Identifier: Apache-2.0
// The least value of a function of few variables, without derivatives: Nelder & Mead 1965, with one restart.
#pragma once

#include <functional>
#include <span>
#include <vector>

namespace forest::statistics {

/// @param cost   not finite: as high as can be
/// @param begin  where to begin, and how far to step along each variable first
std::vector<double> minimise(const std::function<double(std::span<const double>)>& cost,
                             std::vector<double> begin, const std::vector<double>& steps);

}  // namespace forest::statistics
