// SPDX-License-Identifier: Apache-2.0
#include "rt/machine/identity.hpp"

#include "rt/machine/check_support.hpp"
#include "rt/machine/parse.hpp"

namespace takt::machine {

Identity Identity::of(const Facts& facts) {
  Identity identity;
  // ARM kernels name no model; the device tree of the board does, ended by a 0.
  identity.cpu = line_value(facts.text("/proc/cpuinfo").value_or(""), "model name");
  if (identity.cpu.empty()) identity.cpu = facts.text("/proc/device-tree/model").value_or("").c_str();
  if (identity.cpu.empty()) identity.cpu = "unknown";
  identity.cores = static_cast<int>(online_cpus(facts).size());
  identity.kernel = kernel_release(facts) + " " + trimmed(facts.text("/proc/sys/kernel/version").value_or(""));
  return identity;
}

}  // namespace takt::machine
