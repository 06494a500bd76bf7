// SPDX-License-Identifier: Apache-2.0
// What a program says to a person beside its results, where it may well be that nobody listens.
#pragma once

#include <string_view>

namespace forest {

/// For main(), before anything is opened. Where the program was started without standard input, output or error (2>&-), the
/// next file or socket would get their number, and what is said would go into it; this keeps the number for nothing, so that
/// reading and writing there fail.
void keep_standard_streams();

/// To standard error, at once. What cannot be written there (a full disk, nobody there) is lost: the work goes on.
void tell(std::string_view text);

}  // namespace forest
