// SPDX-License-Identifier: Apache-2.0
// Loops that the compiler makes vector instructions of, one copy for each level of the x86-64 processors (System V ABI,
// "microarchitecture levels"); the processor that runs them takes its best. Asked by level, not by model: "arch=haswell"
// is true of one model only.
#pragma once

#if defined(__x86_64__) && defined(__clang__)
#define FOREST_CLONES [[gnu::target_clones("default", "avx2")]]
#elif defined(__x86_64__)
#define FOREST_CLONES [[gnu::target_clones("default", "arch=x86-64-v3", "arch=x86-64-v4")]]
#else
#define FOREST_CLONES
#endif

// Before a loop over a few lanes, known in number: it stays a loop until vectors are made of it.
#ifdef __clang__
#define FOREST_LANES
#else
#define FOREST_LANES _Pragma("GCC unroll 1")
#endif
