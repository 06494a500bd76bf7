// SPDX-License-Identifier: Apache-2.0
// The memory of a program that makes and drops many things of some hundred kilobytes.
#pragma once

namespace forest {

/// Freed memory up to 64 MB stays with the program. By default glibc gives the end of the heap back whenever 128 kB of it are
/// free, and asks for it again a moment later, page by page: a third of the time that measuring neurons takes on a
/// virtual machine. What is larger than 4 MB still goes back at once. To be called once, before anything else; other C
/// libraries are left as they are.
void keep_freed_memory();

}  // namespace forest
