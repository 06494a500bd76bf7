// SPDX-License-Identifier: Apache-2.0
// Annotations as comments, for programs that compute with a cell and leave what is said of it to people.
#pragma once

#include <string>
#include <string_view>

#include "forest/morphology/morphology.h"

namespace forest::io {

/// A line each, after `mark`: at most 500 printable ASCII characters.
std::string comment_lines(const Annotations& annotations, std::string_view mark);

}  // namespace forest::io
