// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <cstdint>

#include "rt/state_archive.hpp"

namespace takt::load {

/// Keeps the calling thread computing until it has used `cpu_ns` more of CPU time, by its own CPU clock: so the work is
/// the same on every machine and under every preemption. Overshoots by at most one reading of that clock (about 1 us).
/// Allocates nothing.
void burn(int64_t cpu_ns);

/// Which jobs get stuck: the first job that comes `every_ns` after the last one that did (or after the first job of
/// all). Never, if every_ns is 0.
class Trouble {
 public:
  bool due(int64_t release_ns, int64_t every_ns);
  void remember(StateArchive& archive) { TAKT_STATE(archive, begun_, last_ns_); }

 private:
  bool begun_ = false;
  int64_t last_ns_ = 0;
};

}  // namespace takt::load
