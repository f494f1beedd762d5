// SPDX-License-Identifier: Apache-2.0
#include "rt/machine/check_support.hpp"

#include <algorithm>

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

OrdinaryShare ordinary_share(const Facts& facts, int cpu) {
  const auto number = [&](const std::string& file) { return parse_number(facts.text(file).value_or("")); };
  if (parse_release(kernel_release(facts)).at_least(6, 12)) {
    const std::string folder = "/sys/kernel/debug/sched/fair_server/cpu" + std::to_string(cpu);
    const auto runtime = number(folder + "/runtime"), period = number(folder + "/period");
    if (runtime && period) return {*runtime, *period};
    return {50'000'000, 1'000'000'000, false};
  }
  const auto runtime = number("/proc/sys/kernel/sched_rt_runtime_us"),
             period = number("/proc/sys/kernel/sched_rt_period_us");
  if (!runtime || !period) return {50'000'000, 1'000'000'000, false};
  return {*runtime < 0 ? 0 : std::max<int64_t>(*period - *runtime, 0) * 1000, *period * 1000};
}

std::vector<Fix> grant_rights(const Facts& facts) {
  // Root without the right: a container that was started without it.
  if (facts.is_root()) return {{"shell", "docker run --cap-add SYS_NICE --cap-add IPC_LOCK --ulimit memlock=-1 ..."}};
  // In this order: a change of its group takes the capabilities from a file. Without the mode every user had them.
  const std::string program = facts.program();
  return {shell("sudo groupadd -f takt\nsudo usermod -aG takt " + facts.user() + "\nsudo chgrp takt " + program +
                "\nsudo chmod 0750 " + program + "\nsudo setcap cap_sys_nice,cap_ipc_lock+ep " + program),
          {"systemd unit (packaging/systemd)",
           "[Service]\nUser=takt\nAmbientCapabilities=CAP_SYS_NICE CAP_IPC_LOCK\nLimitMEMLOCK=infinity"}};
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
