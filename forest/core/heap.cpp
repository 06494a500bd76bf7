// SPDX-License-Identifier: Apache-2.0
#include "forest/core/heap.h"

#include <cstdlib>

#ifdef __GLIBC__
#include <malloc.h>
#endif

namespace forest {

void keep_freed_memory() {
#ifdef __GLIBC__
  mallopt(M_TRIM_THRESHOLD, 64 << 20);
  mallopt(M_MMAP_THRESHOLD, 4 << 20);  // else it stays at 128 kB, since glibc adapts neither when one is set
#endif
}

}  // namespace forest
