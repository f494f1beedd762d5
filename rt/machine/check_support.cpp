// SPDX-License-Identifier: Apache-2.0
#include "rt/machine/check_support.hpp"

#include "rt/machine/parse.hpp"

namespace takt::machine {

std::string kernel_release(const Facts& facts) {
  return trimmed(facts.text("/proc/sys/kernel/osrelease").value_or(""));
}

std::string kernel_config(const Facts& facts) {
  if (auto packed = facts.text("/proc/config.gz"); packed && !packed->empty()) return *packed;
  return facts.text("/boot/config-" + kernel_release(facts)).value_or("");
}

std::vector<int> online_cpus(const Facts& facts) {
  return parse_cpu_list(facts.text("/sys/devices/system/cpu/online").value_or(""));
}

std::vector<Fix> grant_rights(const Facts& facts) {
  // Root without the right: a container that was started without it.
  if (facts.is_root()) return {{"shell", "docker run --cap-add SYS_NICE --cap-add IPC_LOCK --ulimit memlock=-1 ..."}};
  return {shell("sudo setcap cap_sys_nice,cap_ipc_lock+ep " + facts.program()),
          {"systemd unit", "[Service]\nAmbientCapabilities=CAP_SYS_NICE CAP_IPC_LOCK\nLimitMEMLOCK=infinity"}};
}

Fix limits_line(const Facts& facts, const std::string& item) {
  return {"/etc/security/limits.d/takt.conf, then log in anew",
          (facts.is_root() ? std::string("USER") : facts.user()) + " - " + item};
}

Fix boot(const std::string& options) { return {"kernel command line", options}; }
Fix shell(const std::string& command) { return {"shell", command}; }

void not_answered(Finding& finding) {
  finding.status = Status::unknown;
  finding.found = "the trial gave no answer in time";
}

}  // namespace takt::machine
