// SPDX-License-Identifier: Apache-2.0
#include "graph/command/devices_command.hpp"

#include <fmt/format.h>
#include <time.h>

#include <algorithm>
#include <cstdio>
#include <cstring>
#include <fstream>
#include <nlohmann/json.hpp>

#include "graph/command/run_support.hpp"
#include "hal/can/port.hpp"
#include "hal/discovery/discovery.hpp"

namespace takt::command {
namespace {

int64_t realtime_ns() {
  timespec t;
  clock_gettime(CLOCK_REALTIME, &t);
  return int64_t{t.tv_sec} * 1'000'000'000 + t.tv_nsec;
}

/// "(1700000000.123456) can0 190#E841B50BE6FB0E02"
std::string candump_line(const std::string& interface, const can::Frame& frame, int64_t realtime_ns) {
  std::string line = fmt::format("({}.{:06}) {} {:0{}X}#", realtime_ns / 1'000'000'000, realtime_ns / 1000 % 1'000'000,
                                 interface, frame.id, (frame.id & can::kErrorFlag) != 0 ? 8 : 3);
  for (size_t i = 0; i < frame.length; ++i) line += fmt::format("{:02X}", frame.data[i]);
  return line + "\n";
}

int failed(const std::string& what, const std::string& fix, int code) {
  fmt::print(stderr, "takt capture: {}\n  fix: {}\n", what, fix);
  return code;
}

}  // namespace

int list_devices(bool json, const std::filesystem::path& root) {
  const auto all = discovery::discover(root);
  if (json) {
    auto list = nlohmann::ordered_json::array();
    for (const auto& found : all)
      list.push_back({{"where", found.where}, {"description", found.description}, {"line", found.line}});
    fmt::print("{}\n", list.dump(2));
    return kOk;
  }
  if (all.empty()) fmt::print("nothing that a driver of Takt fits is plugged in\n");
  size_t where = 0, description = 0;
  for (const auto& found : all) {
    where = std::max(where, found.where.size());
    description = std::max(description, found.description.size());
  }
  for (const auto& found : all)
    fmt::print("{:{}}  {:{}}  {}\n", found.where, where, found.description, description, found.line);
  return kOk;
}

int capture_device(const CaptureOptions& options) {
  const std::string& interface = options.device;
  if (interface.starts_with("/dev/"))
    return failed(interface + " is no CAN interface", "name one, such as can0: takt devices", kBadInput);
  std::ofstream file(options.file);
  if (!file) return failed(options.file.string() + " cannot be written", "name another file", kBadInput);
  const MonotonicClock clock;
  can::Port port(interface, clock);
  if (const int error = port.open({}); error != 0)
    return failed(interface + ": " + std::strerror(error), can::advice(interface, error), kDeviceOrSystem);
  const StopOnSignal stop;
  const int64_t end_ns = clock.now_ns() + static_cast<int64_t>(options.duration_s * 1e9);
  uint64_t frames = 0;
  bool gone = false;
  while (!gone && clock.now_ns() < end_ns && !StopOnSignal::asked()) {
    const can::Reception reception = port.receive();
    if (reception.status == can::PortStatus::ok) {
      const int64_t age_ns = clock.now_ns() - reception.stamp_ns;
      file << candump_line(interface, reception.frame, realtime_ns() - age_ns);
      ++frames;
    } else if (reception.status == can::PortStatus::nothing || reception.status == can::PortStatus::down) {
      const timespec shortly{0, 1'000'000};
      nanosleep(&shortly, nullptr);
    }
    gone = reception.status == can::PortStatus::gone;
  }
  file.close();
  fmt::print("{} frames in {}\n", frames, options.file.string());
  if (!file) return failed(options.file.string() + " cannot be written", "make room for it", kDeviceOrSystem);
  if (port.overflows() > 0) fmt::print("{} frames came faster than they were taken and are lost\n", port.overflows());
  return gone ? failed(interface + " is gone", "plug it in again", kDeviceOrSystem) : kOk;
}

}  // namespace takt::command
