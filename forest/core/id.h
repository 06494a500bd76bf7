// SPDX-License-Identifier: Apache-2.0
// Ids that cannot be mistaken for one another: `using SectionId = Id<struct SectionTag>;`.
#pragma once

#include <compare>
#include <cstddef>
#include <cstdint>

namespace forest {

template <class Tag>
class Id {
 public:
  constexpr Id() = default;  // none
  constexpr explicit Id(std::size_t value) : value_(static_cast<std::uint32_t>(value)) {}

  constexpr bool valid() const { return value_ != none; }
  constexpr std::uint32_t value() const { return value_; }
  constexpr auto operator<=>(const Id&) const = default;

 private:
  static constexpr std::uint32_t none = 0xffffffffu;
  std::uint32_t value_ = none;
};

}  // namespace forest
