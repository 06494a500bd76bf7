// SPDX-License-Identifier: Apache-2.0
// A benchmark of `brainforest bench` is one file bench_<name>.cpp and one row in bench.cpp. Each checks that its work was
// really done before it tells how fast it was; the figures and the machines they were measured on are in bench/README.md.
#pragma once

#include <span>

#include "apps/cli/verb.h"

namespace forest::cli {

struct Benchmark {
  const char* name;
  const char* summary;  // the question, in one line
  const char* example;
  Setup setup;  // as of a verb
};

std::span<const Benchmark> benchmarks();

}  // namespace forest::cli
