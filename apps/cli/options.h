// SPDX-License-Identifier: Apache-2.0
// Options that several verbs have, checked and explained alike. A wrong value is bad usage: exit status 2.
#pragma once

#include <cstdint>
#include <string>

namespace CLI {
class App;
class Option;
}  // namespace CLI

namespace forest::cli {

class Console;

/// --json and --threads.
void add_common(CLI::App& command, Console& console);

/// --seed, any whole number of 64 bits.
/// @param help  what is the same with the same seed
void add_seed(CLI::App& command, std::uint64_t& seed, const char* help);

/// --size, WIDTHxHEIGHT (parse_size, artist.h).
/// @param even  both must be, as in films
void add_size(CLI::App& command, std::string& size, bool even = false);

/// --force, for verbs that refuse to replace files (Overwrites, files.h).
void add_force(CLI::App& command, bool& force);

/// --budget, of pictures that follow one another (scene::Budget).
void add_budget(CLI::App& command, double& milliseconds);

/// An option for a whole number in a range, with its default.
void add_whole(CLI::App& command, const char* name, std::uint32_t& value, const char* help, std::uint64_t low,
               std::uint64_t high);

/// An option's value must be a whole number in this range. Said in one short sentence, and never rounded or cut to fit.
void must_be_whole(CLI::Option& option, std::uint64_t low, std::uint64_t high);
/// The same for any number; what is not a number is refused too.
void must_be_within(CLI::Option& option, double low, double high);

}  // namespace forest::cli
