// SPDX-License-Identifier: Apache-2.0
#include "graph/command/machine.hpp"

#include <sys/resource.h>
#include <unistd.h>

#include <cstdlib>
#include <fstream>
#include <sstream>
#include <string>

#include "rt/machine/identity.hpp"

namespace takt::command {
namespace {

/// Value of the first line `key : value` of a /proc file.
std::string proc_value(const char* file, const std::string& key) {
  std::ifstream in(file);
  for (std::string line; std::getline(in, line);) {
    if (line.rfind(key, 0) != 0) continue;
    const size_t colon = line.find(':');
    if (colon == std::string::npos) continue;
    const size_t start = line.find_first_not_of(" \t", colon + 1);
    return start == std::string::npos ? "" : line.substr(start);
  }
  return "";
}

int64_t ns_of(const timeval& t) { return int64_t{t.tv_sec} * 1'000'000'000 + int64_t{t.tv_usec} * 1'000; }

}  // namespace

nlohmann::ordered_json machine_facts() {
  const auto identity = machine::Identity::of(machine::SystemFacts());
  return {{"cpu", identity.cpu},
          {"cores", identity.cores},
          {"kernel", identity.kernel},
          {"memory", proc_value("/proc/meminfo", "MemTotal")}};
}

ProcessReading ProcessReading::now() {
  ProcessReading reading;
  rusage use{};
  getrusage(RUSAGE_SELF, &use);
  reading.cpu_ns = ns_of(use.ru_utime) + ns_of(use.ru_stime);
  reading.rss_mb = static_cast<double>(use.ru_maxrss) / 1024.0;
  // First line of /proc/stat: cpu user nice system idle iowait irq softirq steal ...
  std::ifstream stat("/proc/stat");
  std::string word;
  int64_t field = 0;
  stat >> word;
  for (int i = 0; i < 8 && stat >> field; ++i) reading.steal_ms = i == 7 ? field * 1000 / sysconf(_SC_CLK_TCK) : 0;
  return reading;
}

double proportional_memory_mb(int pid) {
  const std::string file = "/proc/" + std::to_string(pid) + "/smaps_rollup";
  return std::strtod(proc_value(file.c_str(), "Pss:").c_str(), nullptr) / 1024.0;
}

}  // namespace takt::command
