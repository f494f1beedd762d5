// SPDX-License-Identifier: Apache-2.0
#include "graph/check/machine_file.hpp"

#include <fmt/format.h>
#include <sched.h>
#include <sys/utsname.h>

#include <algorithm>
#include <cstdlib>
#include <ctime>
#include <fstream>
#include <iterator>
#include <nlohmann/json.hpp>
#include <sstream>

namespace takt::graph {
namespace {

using nlohmann::json;

std::string text_of(const std::filesystem::path& file) {
  std::ifstream in(file);
  return {std::istreambuf_iterator<char>(in), {}};
}

std::string first_line(const std::filesystem::path& file) {
  const std::string text = text_of(file);
  return text.substr(0, text.find('\n'));
}

/// "0-2,5" -> 0 1 2 5.
std::vector<int> cpu_list(const std::string& text) {
  std::vector<int> cpus;
  std::istringstream in(text);
  for (std::string part; std::getline(in, part, ',');) {
    const size_t dash = part.find('-');
    const int first = std::atoi(part.c_str());
    const int last = dash == std::string::npos ? first : std::atoi(part.c_str() + dash + 1);
    for (int cpu = first; !part.empty() && cpu <= last; ++cpu) cpus.push_back(cpu);
  }
  return cpus;
}

MachineName name_of_this() {
  MachineName name;
  std::istringstream in(text_of("/proc/cpuinfo"));
  for (std::string line; std::getline(in, line);) {
    if (line.rfind("model name", 0) != 0) continue;
    name.cpu = line.substr(std::min(line.find(": ") + 2, line.size()));
    break;
  }
  if (name.cpu.empty()) name.cpu = "unknown";
  utsname system{};
  uname(&system);
  name.kernel = std::string(system.release) + " " + system.version;
  name.cores = static_cast<int>(cpu_list(first_line("/sys/devices/system/cpu/online")).size());
  return name;
}

/// CPUs of the cpuset of this process if no other shares them and it is a scheduling domain of its own: SCHED_DEADLINE
/// is admitted within it (cgroup v2: a partition; v1: cpu_exclusive below a parent that does not balance).
std::vector<int> exclusive_cpus() {
  std::istringstream groups(text_of("/proc/self/cgroup"));
  for (std::string line; std::getline(groups, line);) {
    const bool v2 = line.rfind("0::", 0) == 0, v1 = line.find(":cpuset:") != std::string::npos;
    const std::string path = line.substr(line.rfind(':') + 1);
    if (path == "/") continue;
    const std::filesystem::path folder = (v1 ? "/sys/fs/cgroup/cpuset" : "/sys/fs/cgroup") + path;
    const std::string partition = first_line(folder / "cpuset.cpus.partition");
    if (v2 && (partition == "root" || partition == "isolated"))
      return cpu_list(first_line(folder / "cpuset.cpus.effective"));
    if (v1 && first_line(folder / "cpuset.cpu_exclusive") == "1" &&
        first_line(folder.parent_path() / "cpuset.sched_load_balance") == "0")
      return cpu_list(first_line(folder / "cpuset.cpus"));
  }
  return {};
}

/// Microseconds of the file as ns; `ns` stays if the key is missing.
void read_us(const json& root, const char* key, int64_t& ns) {
  if (!root.contains(key)) return;
  const double us = root.at(key).get<double>();
  if (!(us >= 0 && us < 1e9)) throw std::invalid_argument(fmt::format("`{}` is {}", key, us));
  ns = static_cast<int64_t>(us * 1e3);
}

MachineName read_figures(const json& root, analysis::Overheads& o) {
  read_us(root, "release_us", o.release_ns);
  read_us(root, "switch_us", o.switch_ns);
  read_us(root, "publish_us", o.publish_ns);
  read_us(root, "take_us", o.take_ns);
  read_us(root, "per_mb_us", o.per_mb_ns);
  read_us(root, "enforcement_us", o.enforcement_ns);
  read_us(root, "tick_us", o.tick_ns);
  o.deadline_bandwidth = root.value("deadline_bandwidth", o.deadline_bandwidth);
  const json& machine = root.at("machine");
  return {machine.at("cpu").get<std::string>(), machine.at("kernel").get<std::string>(),
          machine.at("cores").get<int>()};
}

}  // namespace

std::filesystem::path machine_file() {
  const auto set = [](const char* name) {
    const char* value = std::getenv(name);
    return std::filesystem::path(value != nullptr ? value : "");
  };
  if (const auto file = set("TAKT_MACHINE"); !file.empty()) return file;
  if (const auto cache = set("XDG_CACHE_HOME"); !cache.empty()) return cache / "takt/machine.json";
  return set("HOME") / ".cache/takt/machine.json";
}

CheckMachine read_machine_file(const std::filesystem::path& file, const MachineName& here,
                               const analysis::Overheads& assumed) {
  CheckMachine machine;
  machine.overheads = assumed;
  machine.overheads_from = "overheads assumed, not measured here; `takt doctor --measure` finds them";
  std::error_code error;
  if (!std::filesystem::is_regular_file(file, error)) return machine;
  try {
    const json root = json::parse(text_of(file));
    analysis::Overheads found = assumed;
    const MachineName where = read_figures(root, found);
    machine.overheads = found;
    machine.measured = true;
    const json when = root.value("measured_at", json());
    machine.overheads_from =
        fmt::format("overheads measured{}", when.is_string() ? " " + when.get<std::string>() : std::string());
    if (where != here)
      machine.warnings.push_back(
          fmt::format("{}: its overheads were measured on another machine ({}, {} cores, Linux {}; this is {}, {} "
                      "cores, Linux {}); "
                      "call `takt doctor --measure` here",
                      file.string(), where.cpu, where.cores, where.kernel, here.cpu, here.cores, here.kernel));
  } catch (const std::exception& problem) {
    machine.warnings.push_back(
        fmt::format("{}: no overheads can be read from it ({}); call `takt doctor --measure` again", file.string(),
                    problem.what()));
  }
  return machine;
}

analysis::Overheads assumed_overheads(size_t cores) {
  analysis::Overheads o;
  o.release_ns = 100'000;
  o.switch_ns = 5'000;
  o.publish_ns = o.take_ns = 2'000;
  timespec tick{};
  o.tick_ns = clock_getres(CLOCK_MONOTONIC_COARSE, &tick) == 0 ? tick.tv_nsec : 4'000'000;
  o.enforcement_ns = o.tick_ns;
  const double runtime = std::atof(first_line("/proc/sys/kernel/sched_rt_runtime_us").c_str());
  const double period = std::atof(first_line("/proc/sys/kernel/sched_rt_period_us").c_str());
  double share = runtime > 0 && period > 0 ? runtime / period : 1;
  utsname system{};
  int major = 0, minor = 0;
  uname(&system);
  std::sscanf(system.release, "%d.%d", &major, &minor);
  if (major > 6 || (major == 6 && minor >= 12)) share -= 0.05;
  o.deadline_bandwidth = share * static_cast<double>(cores);
  return o;
}

CheckMachine this_machine() {
  const std::vector<int> online = cpu_list(first_line("/sys/devices/system/cpu/online"));
  CheckMachine machine =
      read_machine_file(machine_file(), name_of_this(), assumed_overheads(std::max<size_t>(online.size(), 1)));
  machine.online = online;
  machine.exclusive = exclusive_cpus();
  return machine;
}

}  // namespace takt::graph
