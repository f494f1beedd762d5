// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cerrno>
#include <cstdio>
#include <cstring>

#include "rt/machine/check_support.hpp"
#include "rt/machine/checks.hpp"
#include "rt/machine/parse.hpp"

namespace takt::machine {
namespace {

std::string microseconds_as_ms(int64_t us) {
  return us % 1000 == 0 ? std::to_string(us / 1000) + " ms" : std::to_string(us) + " us";
}

bool may_use_all(const Facts& facts) {
  const auto allowed = facts.allowed_cpus();
  for (const int cpu : online_cpus(facts))
    if (std::find(allowed.begin(), allowed.end(), cpu) == allowed.end()) return false;
  return true;
}

/// Folder and limit of the real-time group of this process under cgroup v1; nothing if there is none.
struct GroupShare {
  std::string folder;
  int64_t runtime_us = 0, period_us = 0;
};
std::optional<GroupShare> group_share(const Facts& facts) {
  const auto path = cgroup_path(facts.text("/proc/self/cgroup").value_or(""), "cpu");
  const auto mount = cgroup_mount(facts.text("/proc/self/mounts").value_or(""), "cpu");
  if (!path || !mount) return std::nullopt;
  GroupShare share;
  share.folder = *mount + (*path == "/" ? "" : *path);
  const auto runtime = parse_number(facts.text(share.folder + "/cpu.rt_runtime_us").value_or(""));
  const auto period = parse_number(facts.text(share.folder + "/cpu.rt_period_us").value_or(""));
  if (!runtime || !period) return std::nullopt;
  share.runtime_us = *runtime;
  share.period_us = *period;
  return share;
}

bool group_scheduling(const Facts& facts) {
  return kernel_option(kernel_config(facts), "RT_GROUP_SCHED") == "y" &&
         boot_option(facts.text("/proc/cmdline").value_or(""), "rt_group_sched") != "0";
}

void was_granted(Finding& f, const PolicyTrial& trial, const std::string& what) {
  f.status = trial.verified ? Status::ok : Status::warn;
  f.found = std::string("granted, ") + (trial.verified ? "read back: " : "but read back otherwise: ") + what;
}

}  // namespace

Finding check_sched_deadline(const Facts& facts, const PolicyTrial& trial) {
  Finding f{"policies", "sched_deadline", Need::deadline, Status::lacks, "", ""};
  f.meaning = "policy `deadline`: the kernel reserves and enforces each lane's budget";
  if (!trial.answered) return not_answered(f), f;
  if (trial.error == 0) {
    was_granted(f, trial,
                microseconds_as_ms(trial.runtime_ns / 1000) + " every " + microseconds_as_ms(trial.period_ns / 1000));
    return f;
  }
  f.found = std::string("refused: ") + std::strerror(trial.error);
  f.meaning = "schedules that ask for it fall back to `cooperative`";
  if (trial.error == EBUSY) {
    f.found += " (others hold the reservations, or kernel.sched_rt_runtime_us leaves none)";
    f.fixes = {shell("sudo sysctl kernel.sched_rt_runtime_us=950000")};
  } else if (trial.error == EPERM && !may_use_all(facts)) {
    f.found += " (only CPUs " + cpu_list_text(facts.allowed_cpus()) + " of " + cpu_list_text(online_cpus(facts)) +
               " may be used, and not as an exclusive cpuset)";
    f.fixes = {shell("taskset -c " + cpu_list_text(online_cpus(facts)) + " takt ...")};
  } else if (trial.error == EPERM) {
    f.fixes = grant_rights(facts);
  } else {
    f.fixes = {{"kernel", "3.14 or newer"}};
  }
  return f;
}

Finding check_deadline_bandwidth(const BandwidthTrial& trial) {
  constexpr double kLittle = 0.1;  // cores
  Finding f{"policies", "deadline_bandwidth", Need::advice, Status::unknown, "", ""};
  f.meaning = "cores that a run under policy `deadline` may reserve now";
  if (!trial.answered) return not_answered(f), f;
  if (!trial.granted) {
    f.found = "SCHED_DEADLINE is refused";
    return f;
  }
  char text[96];
  std::snprintf(text, sizeof text, "%.3f of %.3f cores free", trial.free, trial.limit);
  f.found = text;
  if (trial.holders[0] != 0) f.found += std::string("; held by ") + trial.holders.data();
  f.status = trial.free < kLittle || trial.lost > 0 ? Status::warn : Status::ok;
  if (trial.lost > 0) {
    std::snprintf(text, sizeof text, "; %.3f lost: no living thread holds them", trial.lost);
    f.found += text;
    f.fixes = {shell(trial.recount.data())};
  }
  return f;
}

Finding check_sched_fifo(const Facts& facts, const PolicyTrial& trial) {
  Finding f{"policies", "sched_fifo", Need::fixed, Status::lacks, "", ""};
  f.meaning = "policy `fixed`: shorter deadlines preempt longer ones";
  if (!trial.answered) return not_answered(f), f;
  if (trial.error == 0) {
    was_granted(f, trial, "priority " + std::to_string(trial.priority));
    return f;
  }
  f.found = std::string("refused: ") + std::strerror(trial.error);
  f.meaning = "schedules that ask for it fall back to `cooperative`";
  const auto share = group_share(facts);
  if (share && share->runtime_us == 0) {
    f.found += " (the cgroup of this process has no real-time share: " + share->folder + ")";
    f.fixes = {shell("echo 100000 | sudo tee " + share->folder + "/cpu.rt_runtime_us")};
  } else {
    f.fixes = grant_rights(facts);
    f.fixes.push_back(limits_line(facts, "rtprio 99"));
  }
  return f;
}

Finding check_rt_runtime(const Facts& facts) {
  Finding f{"policies", "rt_runtime", Need::advice, Status::unknown, "", ""};
  f.meaning = "share of the CPUs that all reservations together may ask for";
  const auto runtime = parse_number(facts.text("/proc/sys/kernel/sched_rt_runtime_us").value_or(""));
  const auto period = parse_number(facts.text("/proc/sys/kernel/sched_rt_period_us").value_or(""));
  if (!runtime || !period || *period <= 0) {
    f.found = "/proc/sys/kernel/sched_rt_runtime_us cannot be read";
    return f;
  }
  if (*runtime < 0) {
    f.status = Status::warn;
    f.found = "no limit";
    f.meaning = "nothing is limited: an endless loop under `fixed` hangs a CPU";
  } else {
    f.found = microseconds_as_ms(*runtime) + " of " + microseconds_as_ms(*period);
    f.status = *runtime == 0 ? Status::lacks : *runtime * 10 >= *period * 9 ? Status::ok : Status::warn;
    if (*runtime == 0) f.need = Need::deadline;
  }
  if (f.status != Status::ok)
    f.fixes = {shell("sudo sysctl kernel.sched_rt_runtime_us=950000"),
               {"/etc/sysctl.d/takt.conf", "kernel.sched_rt_runtime_us = 950000"}};
  return f;
}

Finding check_cgroup_rt(const Facts& facts) {
  Finding f{"policies", "cgroup_rt", Need::fixed, Status::ok, "", ""};
  f.meaning = "what the control group of this process may spend on policy `fixed`";
  if (const auto share = group_share(facts)) {
    f.found =
        microseconds_as_ms(share->runtime_us) + " of " + microseconds_as_ms(share->period_us) + " in " + share->folder;
    if (share->runtime_us >= 0 && share->runtime_us * 2 < share->period_us) {
      f.status = share->runtime_us == 0 ? Status::lacks : Status::warn;
      f.fixes = {
          shell("echo 950000 | sudo tee " + share->folder + "/cpu.rt_runtime_us"),
          shell("echo $$ | sudo tee " + cgroup_mount(facts.text("/proc/self/mounts").value_or(""), "cpu").value_or("") +
                "/cgroup.procs")};
    }
    return f;
  }
  const auto unified = cgroup_path(facts.text("/proc/self/cgroup").value_or(""), "");
  f.found = "no limit per group";
  if (unified && *unified != "/" && group_scheduling(facts)) {
    f.status = Status::warn;
    f.found = "cgroup v2 with RT_GROUP_SCHED, in " + *unified;
    f.meaning = "this kernel gives SCHED_FIFO to the root group only";
    f.fixes = {boot("rt_group_sched=0")};
  }
  return f;
}

Finding check_fair_server(const Facts& facts) {
  Finding f{"policies", "fair_server", Need::advice, Status::unknown, "", ""};
  f.meaning = "policy `fixed`: a busy CPU gives others so much, and jobs wait so long";
  if (!parse_release(kernel_release(facts)).at_least(6, 12)) {
    f.status = Status::ok;
    f.found = "none before Linux 6.12: rt_runtime throttles instead";
    return f;
  }
  const OrdinaryShare share = ordinary_share(facts, 0);
  if (!share.known) {
    f.found = "Linux " + kernel_release(facts) + " has one; debugfs is not readable, its default is 50 ms of 1000 ms";
    f.fixes = {shell("sudo mount -t debugfs debugfs /sys/kernel/debug")};
    return f;
  }
  f.status = share.runtime_ns == 0 ? Status::ok : Status::warn;
  f.found =
      microseconds_as_ms(share.runtime_ns / 1000) + " of " + microseconds_as_ms(share.period_ns / 1000) + " on cpu0";
  if (share.runtime_ns > 0)
    f.fixes = {shell("for f in /sys/kernel/debug/sched/fair_server/cpu*/runtime; do echo 0 | sudo tee $f; done")};
  return f;
}

}  // namespace takt::machine
