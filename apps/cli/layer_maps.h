// SPDX-License-Identifier: Apache-2.0
// Measured layers on the command line: one file of thicknesses for each layer, from the pia inwards.
#pragma once

#include <cstddef>
#include <filesystem>
#include <string>
#include <vector>

namespace forest::cli {

/// Of each layer a value for each of `vertices`. FreeSurfer's average surfaces are icosahedra of which the coarser ones have the first
/// vertices of the finer ones: a map of fsaverage (163,842 values) is also one of fsaverage5 (10,242).
/// Throws InputError for a file of another number of values, and for one below 0.
std::vector<std::vector<float>> read_layer_maps(const std::vector<std::filesystem::path>& files,
                                                std::size_t vertices);

/// A sentence where the numbers in their names run against their order; else empty.
std::string doubt_of_order(const std::vector<std::filesystem::path>& files);

}  // namespace forest::cli
