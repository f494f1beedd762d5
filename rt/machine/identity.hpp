// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <string>

#include "rt/machine/facts.hpp"

namespace takt::machine {

/// What tells one machine from another where times were measured: the processor, how many of it, the kernel.
struct Identity {
  std::string cpu;     ///< model as the kernel names it
  int cores = 0;       ///< online
  std::string kernel;  ///< release and version
  bool operator==(const Identity&) const = default;
  static Identity of(const Facts& facts);
};

}  // namespace takt::machine
