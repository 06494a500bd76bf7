// SPDX-License-Identifier: Apache-2.0
// Numbers as people read them, in the tables, sentences and reports on populations.
#pragma once

#include <string>

namespace forest::cli {

/// Four digits, with commas between thousands: "0.3674", "10,170"; whole numbers with all of theirs, since they may be counts.
/// Powers of ten only where there would be many noughts: below 0.0001 and from 10⁹ on. What is not known is "-".
std::string readable(double value);
/// "5.1–9.8", and "-5.1 to 9.8" where a dash would meet a sign.
std::string readable_range(double low, double high);
/// A number of an axis whose numbers are `step` apart: as many digits behind the point as the step has.
std::string readable_mark(double value, double step);

}  // namespace forest::cli
