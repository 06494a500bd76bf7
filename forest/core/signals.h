// SPDX-License-Identifier: Apache-2.0
// What the system tells a program by signals, as sentences.
#pragma once

namespace forest {

/// For main(). A mapped file that becomes shorter while it is read, or whose disk fails (SIGBUS), ends the program with one sentence
/// on standard error and exit status 1. A file that may not grow (SIGXFSZ) ends nothing: writing it fails, as on a full disk.
/// @param program  before the sentence; at most 63 bytes of it
void say_signals(const char* program);

}  // namespace forest
