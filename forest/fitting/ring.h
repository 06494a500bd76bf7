// SPDX-License-Identifier: Apache-2.0
// Few neurons of a model should be a fair sample of all that it grows. Neurons that are grown one after the other take cards evenly
// from around a ring (`dealt`, docs/lsystem/notation.md); here the traced neurons are laid into such a ring, each beside those that
// the neurons grown of it are most like. A systematic sample along a short tour is spread evenly in all dimensions (Dickson & Tillé
// 2016, Environmental and Ecological Statistics 23:473).
#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include "forest/fitting/mixing.h"
#include "forest/fitting/traced.h"

namespace forest::fitting {

/// The numbers of the neurons around the ring.
/// @param mixed  of each neuron of `traced`, of whom the neuron grown of it is made
std::vector<std::size_t> ring(const Traced& traced, std::span<const Mixed> mixed);

/// A short closed tour through points, rows of the same length: always on to the nearest, then without crossings (2-opt; Croes
/// 1958, Operations Research 6:791). Begins at the first; the same for the same points.
std::vector<std::size_t> tour(const std::vector<std::vector<double>>& points);

}  // namespace forest::fitting
