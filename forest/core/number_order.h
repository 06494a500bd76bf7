// SPDX-License-Identifier: Apache-2.0
// Names in the order of the numbers in them, as s2 before s10.
//
// Names of one series differ in one number, with what is alike around it, in small letters or in large ones:
//
//     slice_007.png     b_-19.5.png     z0,25mm.tif
//           ───           ─────          ────
//
// It may have a sign, where no letter or digit stands before it, and decimals, behind a point or a comma. 1.9 and 1.10 may be decimals or two
// numbers each: where that makes another order, they are what has even steps. Names that differ in more than one number go by each of
// these, from the left, without signs or decimals.
#pragma once

#include <cstddef>
#include <filesystem>
#include <optional>
#include <span>
#include <vector>

namespace forest {

struct NumberedFile {
  std::filesystem::path file;
  std::optional<double>
      number;  // in which its name differs from the others, or the last in it; nothing: has none
};

/// By their names, without folders and extensions.
/// @throws Error when two have the same number, or may follow one another either way
std::vector<NumberedFile> in_number_order(std::span<const std::filesystem::path> files);

}  // namespace forest
