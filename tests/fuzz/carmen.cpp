// SPDX-License-Identifier: Apache-2.0
// Any text to the reader of CARMEN logs: as many ranges as beams, finite, and times that never fall.
#include <algorithm>
#include <cmath>

#include "hal/replay/carmen_log.hpp"
#include "tests/fuzz/memory_file.hpp"

using namespace takt;
using takt::fuzz::require;

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  const fuzz::MemoryFile file(data, size);
  const auto log = replay::load_carmen_log("laser", file.path());
  if (!log) {
    require(log.error().what.starts_with(file.path().string()) && !log.error().fix.empty());
    return 0;
  }
  require(log->range_m.size() == log->scans.size() * log->beams);
  require(std::all_of(log->range_m.begin(), log->range_m.end(), [](float range) { return !std::isnan(range); }));
  const auto earlier = [](const auto& a, const auto& b) { return a.time_ns < b.time_ns; };
  require(std::is_sorted(log->scans.begin(), log->scans.end(), earlier));
  require(std::is_sorted(log->odometry.begin(), log->odometry.end(), earlier));
  return 0;
}
