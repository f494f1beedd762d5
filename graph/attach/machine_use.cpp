// SPDX-License-Identifier: Apache-2.0
#include "graph/attach/machine_use.hpp"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <fstream>
#include <sstream>
#include <string>
#include <utility>

namespace takt::attach {
namespace {

/// User and system time of a process, in ticks; 0: it is gone.
int64_t cpu_ticks(int pid) {
  std::ifstream stat(fmt::format("/proc/{}/stat", pid));
  std::string text;
  std::getline(stat, text);
  const size_t name_end = text.rfind(')');
  if (name_end == std::string::npos) return 0;
  std::istringstream fields(text.substr(name_end + 2));
  std::string skipped;
  for (int i = 0; i < 11; ++i) fields >> skipped;
  int64_t user = 0, system = 0;
  fields >> user >> system;
  return user + system;
}

struct Pages {
  int64_t own = 0, shared = 0;
};

Pages pages_of(int pid) {
  std::ifstream statm(fmt::format("/proc/{}/statm", pid));
  int64_t all = 0, resident = 0, shared = 0;
  statm >> all >> resident >> shared;
  return {std::max<int64_t>(resident - shared, 0), shared};
}

int64_t stolen_ms() {
  std::ifstream stat("/proc/stat");
  std::string cpu;
  int64_t ticks = 0;
  stat >> cpu;
  for (int i = 0; i < 8; ++i) stat >> ticks;  // the eighth is steal
  return ticks * 1000 / sysconf(_SC_CLK_TCK);
}

}  // namespace

MachineUse::Use MachineUse::look(const std::vector<int>& pids, int64_t now_ns) {
  const double page_mb = static_cast<double>(sysconf(_SC_PAGESIZE)) / 1e6;
  const double seconds = looked_ns_ > 0 ? static_cast<double>(now_ns - looked_ns_) / 1e9 : 0.0;
  const auto cores = [&](int64_t ticks) {
    return static_cast<double>(std::max<int64_t>(ticks, 0)) / static_cast<double>(sysconf(_SC_CLK_TCK)) / seconds;
  };
  std::map<int, int64_t> ticks;
  int64_t used = 0, own = 0, shared = 0;
  Use use;
  for (const int pid : pids) {
    const int64_t now = ticks[pid] = cpu_ticks(pid);
    const Pages pages = pages_of(pid);
    own += pages.own;
    shared = std::max(shared, pages.shared);
    use.processes.push_back({std::nullopt, static_cast<double>(pages.own) * page_mb});
    const auto before = cpu_ticks_.find(pid);
    if (before == cpu_ticks_.end()) continue;
    used += now - before->second;
    if (seconds > 0) use.processes.back().cpu = cores(now - before->second);
  }
  const int64_t stalled_ms = stolen_ms();
  if (stalled_before_ms_ < 0) stalled_before_ms_ = stalled_ms;
  if (seconds > 0) use.cpu = cores(used);
  use.memory_mb = static_cast<double>(own + shared) * page_mb;
  use.host_stall_ms = stalled_ms - stalled_before_ms_;
  cpu_ticks_ = std::move(ticks);
  looked_ns_ = now_ns;
  return use;
}

}  // namespace takt::attach
