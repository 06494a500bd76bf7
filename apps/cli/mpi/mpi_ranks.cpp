// SPDX-License-Identifier: Apache-2.0
// Ranks over Open MPI: the only file that knows MPI (see ranks.h).
#include <chrono>
#include <climits>
#include <cstdint>
#include <mpi.h>
#include <thread>

#include "forest/core/error.h"

#include "apps/cli/ranks.h"

namespace forest::cli {
namespace {

/// Waits without a core of its own, which MPI's waiting calls take and others need for growing.
template <class Done>
void wait_for(Done&& done) {
  while (!done()) std::this_thread::sleep_for(std::chrono::microseconds(200));
}

int size_of(std::string_view bytes) {
  if (bytes.size() > INT_MAX)
    throw Error("more than 2 GiB would go from one program to another at once; grow smaller neurons");
  return int(bytes.size());
}

class MpiRanks final : public Ranks {
 public:
  MpiRanks() {
    int threads = 0;
    MPI_Init_thread(nullptr, nullptr, MPI_THREAD_SERIALIZED, &threads);
    MPI_Comm_size(MPI_COMM_WORLD, &count_);
    MPI_Comm_rank(MPI_COMM_WORLD, &own_);
    if (threads < MPI_THREAD_SERIALIZED)
      throw Error("this MPI serves programs of one thread only; install Open MPI as Debian has it");
  }
  ~MpiRanks() override { MPI_Finalize(); }

  int count() const override { return count_; }
  int own() const override { return own_; }

  void share(std::string& bytes) override {
    int size = first() ? size_of(bytes) : 0;
    shared(&size, 1, MPI_INT);
    bytes.resize(std::size_t(size));
    shared(bytes.data(), size, MPI_BYTE);
  }

  void give(std::string_view bytes) override {
    MPI_Request request = MPI_REQUEST_NULL;
    MPI_Issend(bytes.data(), size_of(bytes), MPI_BYTE, 0, 0, MPI_COMM_WORLD, &request);
    wait_for(request);
  }

  std::string take(int from) override {
    MPI_Message message = MPI_MESSAGE_NULL;
    MPI_Status status;
    cli::wait_for([&] {
      int there = 0;
      MPI_Improbe(from, 0, MPI_COMM_WORLD, &there, &message, &status);
      return there != 0;
    });
    int size = 0;
    MPI_Get_count(&status, MPI_BYTE, &size);
    std::string bytes(std::size_t(size), '\0');
    MPI_Mrecv(bytes.data(), size, MPI_BYTE, &message, &status);
    return bytes;
  }

  void end_all() override { MPI_Abort(MPI_COMM_WORLD, 1); }

 private:
  static void wait_for(MPI_Request& request) {
    cli::wait_for([&] {
      int done = 0;
      MPI_Test(&request, &done, MPI_STATUS_IGNORE);
      return done != 0;
    });
  }
  static void shared(void* data, int count, MPI_Datatype type) {
    MPI_Request request = MPI_REQUEST_NULL;
    MPI_Ibcast(data, count, type, 0, MPI_COMM_WORLD, &request);
    wait_for(request);
  }

  int count_ = 1, own_ = 0;
};

}  // namespace
}  // namespace forest::cli

extern "C" forest::cli::Ranks* forest_join_ranks() { return new forest::cli::MpiRanks; }
