// SPDX-License-Identifier: Apache-2.0
#include "graph/check/check_machine.hpp"

#include <fmt/format.h>

#include <ctime>

#include "graph/check/machine_figures.hpp"
#include "hal/settings/json.hpp"
#include "rt/machine/check_support.hpp"
#include "rt/machine/checks.hpp"
#include "rt/machine/parse.hpp"

namespace takt::graph {
namespace {

using nlohmann::json;

/// CPUs of the cpuset of this process if no other shares them and it is a scheduling domain of its own: SCHED_DEADLINE
/// is admitted within it (cgroup v2: a partition; v1: exclusive below a parent that does not balance).
std::vector<int> exclusive_cpus(const machine::Facts& facts) {
  const std::string groups = facts.text("/proc/self/cgroup").value_or(""),
                    mounts = facts.text("/proc/self/mounts").value_or("");
  const auto value = [&](const std::string& file) { return machine::trimmed(facts.text(file).value_or("")); };
  for (const char* controller : {"", "cpuset"}) {
    const auto path = machine::cgroup_path(groups, controller), mount = machine::cgroup_mount(mounts, controller);
    if (!path || !mount || *path == "/") continue;
    const std::string folder = *mount + *path, above = folder.substr(0, folder.rfind('/'));
    const std::string partition = value(folder + "/cpuset.cpus.partition");
    if (partition == "root" || partition == "isolated")
      return machine::parse_cpu_list(value(folder + "/cpuset.cpus.effective"));
    if (value(folder + "/cpuset.cpu_exclusive") == "1" && value(above + "/cpuset.sched_load_balance") == "0")
      return machine::parse_cpu_list(value(folder + "/cpuset.cpus"));
  }
  return {};
}

void read_file(const json& root, const std::filesystem::path& file, CheckMachine& found) {
  const MeasuredMachine measured = read_measured_machine(root);  // whole or not at all
  const machine::Identity &where = measured.machine, &here = found.identity;
  found.worst = worst_overheads(measured, found.overheads, kWorstMargin);
  found.overheads = overheads_of(measured.figures, found.overheads);
  found.measured = true;
  found.overheads_from = "overheads measured";
  if (!measured.measured_at.empty()) found.overheads_from += " " + measured.measured_at;
  if (where == here) return;
  found.warnings.push_back(fmt::format(
      "{}: its overheads were measured on another machine ({}, {} cores, Linux {}; this is {}, {} cores, Linux "
      "{}); call `takt doctor --measure` here",
      file.string(), where.cpu, where.cores, where.kernel, here.cpu, here.cores, here.kernel));
}

/// What a system call of any process takes then delays a job, and no analysis charges it.
std::string not_preemptible(const machine::Facts& facts) {
  const machine::Preemption found = machine::preemption_of(facts);
  if (found.preempts()) return "";
  return fmt::format(
      "the kernel does not preempt a thread within a system call (preemption {}, {}): a job waits for that, and it is "
      "not charged; `takt doctor` says how to change it",
      found.model, found.source);
}

}  // namespace

std::string_view to_string(OverheadBasis basis) {
  switch (basis) {
    case OverheadBasis::assumed: return "assumed";
    case OverheadBasis::p99: return "p99";
    case OverheadBasis::worst: return "worst";
  }
  return "";
}

analysis::Overheads assumed_overheads(const machine::Facts& facts) {
  analysis::Overheads o;
  o.release_ns = 100'000;
  o.switch_ns = 5'000;
  o.publish_ns = o.take_ns = 2'000;
  o.look_ns = 20'000;
  timespec tick{};
  o.tick_ns = clock_getres(CLOCK_MONOTONIC_COARSE, &tick) == 0 ? tick.tv_nsec : 4'000'000;
  o.enforcement_ns = o.demotion_ns = o.tick_ns;
  for (const int cpu : machine::online_cpus(facts)) {
    const machine::OrdinaryShare share = machine::ordinary_share(facts, cpu);
    if (share.runtime_ns <= o.ordinary_runtime_ns) continue;
    o.ordinary_runtime_ns = share.runtime_ns;
    o.ordinary_period_ns = share.period_ns;
  }
  const auto setting = [&](const char* name) {
    return static_cast<double>(
        machine::parse_number(facts.text(std::string("/proc/sys/kernel/") + name).value_or("")).value_or(0));
  };
  const double runtime = setting("sched_rt_runtime_us"), period = setting("sched_rt_period_us");
  double share = runtime > 0 && period > 0 ? runtime / period : 1;
  if (machine::parse_release(machine::kernel_release(facts)).at_least(6, 12)) share -= 0.05;
  o.deadline_bandwidth = share * static_cast<double>(machine::online_cpus(facts).size());
  return o;
}

CheckMachine check_machine(const machine::Facts& facts, const std::filesystem::path& file) {
  CheckMachine found;
  found.overheads = assumed_overheads(facts);
  found.overheads_from = "overheads assumed, not measured here; `takt doctor --measure` finds them";
  found.online = machine::online_cpus(facts);
  found.exclusive = exclusive_cpus(facts);
  found.identity = machine::Identity::of(facts);
  found.not_preemptible = not_preemptible(facts);
  const auto text = file.empty() ? std::nullopt : facts.text(file.string());
  if (!text) return found;
  try {
    read_file(json::parse(*text), file, found);
  } catch (const std::exception& problem) {
    found.warnings.push_back(
        fmt::format("{}: no overheads can be read from it ({}); call `takt doctor --measure` again", file.string(),
                    problem.what()));
  }
  return found;
}

}  // namespace takt::graph
