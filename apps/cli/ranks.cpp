// SPDX-License-Identifier: Apache-2.0
#include "apps/cli/ranks.h"

#include <cstdlib>
#include <dlfcn.h>
#include <filesystem>

#include <fmt/format.h>

#include "forest/core/error.h"

namespace forest::cli {
namespace {

class Alone final : public Ranks {
 public:
  int count() const override { return 1; }
  int own() const override { return 0; }
  void share(std::string&) override {}
  void give(std::string_view) override {}
  std::string take(int) override { return {}; }
  void end_all() override {}
};

}  // namespace

int started_ranks() {
  const char* const size = std::getenv("OMPI_COMM_WORLD_SIZE");
  return size ? std::max(1, std::atoi(size)) : 1;
}

std::unique_ptr<Ranks> join_ranks() {
  if (started_ranks() == 1) return std::make_unique<Alone>();
  std::error_code none;
  const auto library =
      std::filesystem::read_symlink("/proc/self/exe", none).parent_path() / "brainforest-mpi.so";
  // Open MPI loads parts of its own, which look for it among what all can see.
  void* const loaded = ::dlopen(library.c_str(), RTLD_NOW | RTLD_GLOBAL);
  void* const join = loaded ? ::dlsym(loaded, "forest_join_ranks") : nullptr;
  if (!join)
    throw Error(
        fmt::format("mpirun started {} programs, and this one was built without MPI ({}); install "
                    "libopenmpi-dev and build it again, or start it without mpirun",
                    started_ranks(), loaded ? library.string() : ::dlerror()));
  return std::unique_ptr<Ranks>(reinterpret_cast<Ranks* (*)()>(join)());
}

}  // namespace forest::cli
