// SPDX-License-Identifier: Apache-2.0
// Programs that mpirun started together (Open MPI), or this one alone. Only mpi_ranks.cpp knows MPI: it is a library of its
// own, loaded when mpirun started us, so that the program as such starts without it.
#pragma once

#include <memory>
#include <string>
#include <string_view>

namespace forest::cli {

/// One thread at a time may call it.
class Ranks {
 public:
  virtual ~Ranks() = default;

  virtual int count() const = 0;
  virtual int own() const = 0;  // from 0, which is called the first
  bool first() const { return own() == 0; }

  /// What the first has is what all have then. All must call it.
  virtual void share(std::string& bytes) = 0;
  /// To the first; returns when it has it.
  virtual void give(std::string_view bytes) = 0;
  /// What rank `from` gives, in its order. For the first alone.
  virtual std::string take(int from) = 0;
  /// Ends all programs with status 1. Does not return where there are others.
  virtual void end_all() = 0;
};

/// How many programs mpirun started; 1 without it.
int started_ranks();

/// Joins the others. Throws Error when there are some and the program was built without MPI: all would do the same.
std::unique_ptr<Ranks> join_ranks();

}  // namespace forest::cli
