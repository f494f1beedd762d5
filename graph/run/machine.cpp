// SPDX-License-Identifier: Apache-2.0
#include "graph/run/machine.hpp"

#include <fcntl.h>
#include <sys/resource.h>
#include <unistd.h>

#include <array>
#include <string>

#include "graph/check/machine_figures.hpp"
#include "rt/machine/identity.hpp"
#include "rt/machine/parse.hpp"

namespace takt::command {
namespace {

/// Of the first line `key : value` of a file of /proc; "" if there is none.
std::string proc_value(const std::string& file, const char* key) {
  return machine::line_value(machine::SystemFacts().text(file).value_or(""), key);
}

int64_t ns_of(const timeval& t) { return int64_t{t.tv_sec} * 1'000'000'000 + int64_t{t.tv_usec} * 1'000; }

}  // namespace

nlohmann::ordered_json machine_facts() {
  auto facts = graph::identity_json(machine::Identity::of(machine::SystemFacts()));
  facts["memory"] = proc_value("/proc/meminfo", "MemTotal");
  return facts;
}

int64_t stolen_ns() {
  static const int file = open("/proc/stat", O_RDONLY | O_CLOEXEC);
  static const int64_t tick_ns = 1'000'000'000 / sysconf(_SC_CLK_TCK);
  std::array<char, 256> line{};  // the first one is the sum
  const ssize_t size = file < 0 ? -1 : pread(file, line.data(), line.size(), 0);
  const auto times = machine::parse_cpu_times({line.data(), size > 0 ? static_cast<size_t>(size) : 0});
  return times ? times->steal * tick_ns : 0;
}

ProcessReading ProcessReading::now() {
  ProcessReading reading;
  rusage use{};
  getrusage(RUSAGE_SELF, &use);
  reading.cpu_ns = ns_of(use.ru_utime) + ns_of(use.ru_stime);
  reading.rss_mb = static_cast<double>(use.ru_maxrss) / 1024.0;
  reading.steal_ms = stolen_ns() / 1'000'000;
  return reading;
}

double proportional_memory_mb(int pid) {
  const std::string kilobytes = proc_value("/proc/" + std::to_string(pid) + "/smaps_rollup", "Pss");
  return static_cast<double>(machine::parse_number(kilobytes).value_or(0)) / 1024.0;
}

}  // namespace takt::command
