// SPDX-License-Identifier: Apache-2.0
// What reading and writing of neurons in HDF5 (h5.h) have in common: names, and annotations that hold rows of numbers.
#pragma once

#include <array>
#include <charconv>
#include <cstddef>
#include <cstdint>
#include <numbers>
#include <string_view>

#include "forest/morphology/morphology.h"

namespace forest::io::h5 {

inline constexpr std::int64_t soma_type = 1;
inline constexpr std::string_view own_group = "brain_forest", family_key = "cell_family",
                                  comment_key = "comment", perimeters_key = "perimeters",
                                  mitochondrion_key = "mitochondrion";
enum Family : std::int64_t { neuron, glia, spine };
inline constexpr std::array<std::string_view, 3> family_names{"neuron", "glia", "spine"};

// What is known of organelles row by row, one annotation a row: the columns, separated by blanks.
struct Column {
  std::string_view name;
  bool whole;
};
struct OrganelleTable {
  std::string_view group;  // and key of the annotations
  std::array<Column, 4> columns;
  std::size_t count;
};
inline constexpr std::array<OrganelleTable, 2> organelle_tables{{
    {"endoplasmic_reticulum",
     {{{"section_index", true}, {"volume", false}, {"surface_area", false}, {"filament_count", true}}},
     4},
    {"postsynaptic_density", {{{"section_id", true}, {"segment_id", true}, {"offset", false}, {}}}, 3},
}};

/// Numbers separated by single blanks; false at anything else.
class Numbers {
 public:
  explicit Numbers(std::string_view text) : at_(text.data()), end_(text.data() + text.size()) {}
  template <class T>
  bool next(T& value) {
    if (!first_ && (at_ == end_ || *at_++ != ' ')) return false;
    first_ = false;
    const auto [stop, error] = std::from_chars(at_, end_, value);
    at_ = stop;
    return error == std::errc();
  }
  bool at_end() const { return at_ == end_; }

 private:
  const char *at_, *end_;
  bool first_ = true;
};

inline float perimeter_of(const Point& p) { return 2.f * std::numbers::pi_v<float> * p.radius; }

}  // namespace forest::io::h5
