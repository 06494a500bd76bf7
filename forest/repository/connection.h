// SPDX-License-Identifier: Apache-2.0
// A SOCI session on a repository, and what can go wrong with one. The only file that knows which database it
// is; no public header includes it.
#pragma once

#include <string>

#include <soci/soci.h>

namespace forest::repository {

/// Opens `place`, which must be a repository this program can read; with `write` it is made when there is
/// none, so that whoever looks sees no file or a whole one. Throws InputError.
void connect(soci::session& sql, const std::string& place, bool write);

void begin_reading(
    soci::session& sql);  // what is read until the end of the transaction was there at one moment
void begin_writing(soci::session& sql);  // waits a minute for other writers

/// Inside a catch block: throws what is being handled again, errors of the database as InputError with a
/// sentence.
[[noreturn]] void rethrow(const std::string& place);

}  // namespace forest::repository
