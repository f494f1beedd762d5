// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cstdio>
#include <set>

#include "rt/machine/check_support.hpp"
#include "rt/machine/checks.hpp"
#include "rt/machine/parse.hpp"

namespace takt::machine {
namespace {

/// Whether the CPUs of this process are a scheduling domain of their own, which SCHED_DEADLINE asks for where they are
/// not all there are.
bool exclusive(const Facts& facts) {
  const std::string mounts = facts.text("/proc/self/mounts").value_or("");
  const std::string groups = facts.text("/proc/self/cgroup").value_or("");
  const auto v1 = cgroup_mount(mounts, "cpuset"), v2 = cgroup_mount(mounts, "");
  const auto v1_path = cgroup_path(groups, "cpuset"), v2_path = cgroup_path(groups, "");
  if (v1 && v1_path)
    return trimmed(facts.text(*v1 + *v1_path + "/cpuset.cpu_exclusive").value_or("")) == "1" &&
           trimmed(facts.text(*v1 + "/cpuset.sched_load_balance").value_or("")) == "0";
  if (!v2 || !v2_path) return false;
  const std::string partition = trimmed(facts.text(*v2 + *v2_path + "/cpuset.cpus.partition").value_or(""));
  return partition == "root" || partition == "isolated";
}

}  // namespace

Finding check_cpusets(const Facts& facts) {
  Finding f{"cores", "cpusets", Need::advice, Status::ok, "", ""};
  f.meaning = "policy `deadline` needs all of them, or an exclusive cpuset";
  const auto allowed = facts.allowed_cpus(), online = online_cpus(facts);
  const auto isolated = parse_cpu_list(facts.text("/sys/devices/system/cpu/isolated").value_or(""));
  if (allowed.empty() || online.empty()) {
    f.status = Status::unknown;
    f.found = "the kernel does not say which CPUs this process may use";
    return f;
  }
  f.found = "CPUs " + cpu_list_text(allowed) + " of " + cpu_list_text(online);
  if (!isolated.empty()) f.found += ", isolated: " + cpu_list_text(isolated);
  const bool all = std::includes(allowed.begin(), allowed.end(), online.begin(), online.end());
  if (all) return f;
  if (exclusive(facts)) {
    f.found += ", exclusive";
    return f;
  }
  f.status = Status::warn;
  f.found += ", not exclusive";
  f.fixes = {shell("taskset -pc " + cpu_list_text(online) + " $$"),
             {"shell, an exclusive cpuset (cgroup v2)",
              "cd /sys/fs/cgroup && echo +cpuset | sudo tee cgroup.subtree_control\n"
              "sudo mkdir -p takt\necho " +
                  cpu_list_text(allowed) +
                  " | sudo tee takt/cpuset.cpus\necho root | sudo tee takt/cpuset.cpus.partition\n"
                  "echo $$ | sudo tee takt/cgroup.procs"}};
  return f;
}

Finding check_irq_affinity(const Facts& facts) {
  Finding f{"cores", "irq_affinity", Need::advice, Status::unknown, "", ""};
  f.meaning = "an interrupt on a job's core delays it by what the handler takes";
  const auto online = online_cpus(facts);
  std::set<int> busy;
  size_t interrupts = 0;
  for (const std::string& number : facts.list("/proc/irq")) {
    const auto cpus = facts.text("/proc/irq/" + number + "/smp_affinity_list");
    if (!cpus || !parse_number(number)) continue;
    ++interrupts;
    for (const int cpu : parse_cpu_list(*cpus)) busy.insert(cpu);
  }
  if (interrupts == 0 || online.empty()) {
    f.found = "/proc/irq cannot be read";
    return f;
  }
  std::vector<int> quiet;
  for (const int cpu : online)
    if (!busy.contains(cpu)) quiet.push_back(cpu);
  f.status = quiet.empty() && online.size() > 1 ? Status::warn : Status::ok;
  f.found =
      std::to_string(interrupts) + " interrupts; CPUs without any: " + (quiet.empty() ? "none" : cpu_list_text(quiet));
  if (f.status == Status::warn)
    f.fixes = {shell("for f in /proc/irq/*/smp_affinity_list; do echo 0 | sudo tee $f; done"), boot("irqaffinity=0")};
  return f;
}

Finding check_host_stall(const Facts& facts) {
  constexpr double kMuch = 0.001;
  Finding f{"cores", "host_stall", Need::advice, Status::unknown, "", ""};
  f.meaning = "what a hypervisor took: misses then are no scheduler's fault";
  const auto times = parse_cpu_times(facts.text("/proc/stat").value_or(""));
  if (!times || times->total <= 0) {
    f.found = "/proc/stat cannot be read";
    return f;
  }
  const double share = static_cast<double>(times->steal) / static_cast<double>(times->total);
  char text[96];
  std::snprintf(text, sizeof text, "%.2f %% stolen since the start (%lld of %lld ticks)", share * 100,
                static_cast<long long>(times->steal), static_cast<long long>(times->total));
  f.found = text;
  f.status = share > kMuch ? Status::warn : Status::ok;
  if (f.status == Status::warn)
    f.fixes = {{"hypervisor", "pin each virtual CPU to a core of its own, without overcommitment"}};
  return f;
}

}  // namespace takt::machine
