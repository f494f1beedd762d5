// SPDX-License-Identifier: Apache-2.0
#include "graph/command/double_command.hpp"

#include <fmt/format.h>
#include <poll.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <cmath>
#include <csignal>
#include <cstdio>
#include <memory>
#include <thread>
#include <utility>

#include "graph/command/prepare.hpp"
#include "hal/laser/lms200/lms200_double.hpp"
#include "hal/laser/lms400/lms400_double.hpp"
#include "hal/sim/sensors.hpp"
#include "hal/stream/pseudo_terminal.hpp"
#include "hal/stream/tcp_listener.hpp"
#include "rt/time/clock.hpp"

namespace takt::command {
namespace {

constexpr int kStep_ms = 1;

std::atomic<bool> stopped{false};

/// What a double needs besides its line.
struct Surroundings {
  const DoubleOptions& options;
  sim::Simulation& world;
  int64_t now_ns;
};

struct DoubleKind {
  std::string_view name, doc;
  std::unique_ptr<DeviceDouble> (*make)(const Surroundings&);
};

/// A scanner on the robot of the simulated world, which drives its path.
RangeSource source_in(const Surroundings& s) {
  return [&world = s.world, met = s.world.make_snapshot()](const Sweep& sweep, std::span<float> range_m) mutable {
    sim::LaserModel model;
    model.beams = static_cast<uint32_t>(range_m.size());
    model.fov_rad = sweep.step_rad * static_cast<double>(range_m.size() - 1);
    model.sweep_s = sweep.sweep_s;
    model.max_range_m = 80;
    model.sigma_m = 0.005;  // devices.md 1.9
    const double middle = sweep.first_angle_rad + model.fov_rad / 2;
    model.sensor_in_robot.z = 0.25;
    model.sensor_in_robot.qw = std::cos(middle / 2);
    model.sensor_in_robot.qz = std::sin(middle / 2);
    sim::scan(world, model, sweep.first_ns, range_m, met);
  };
}

std::unique_ptr<ByteStream> line_of(const DoubleOptions& options) {
  if (options.tcp) return std::make_unique<TcpListener>(*options.tcp);
  return std::make_unique<PseudoTerminal>(options.pty);
}

constexpr DoubleKind kDoubles[] = {
    {"lms200", "a SICK LMS 200, on a pseudo terminal",
     [](const Surroundings& s) -> std::unique_ptr<DeviceDouble> {
       return std::make_unique<lms200::Lms200Double>(line_of(s.options), source_in(s), s.now_ns);
     }},
    {"lms400", "a SICK LMS 400, on a port of this machine or a pseudo terminal",
     [](const Surroundings& s) -> std::unique_ptr<DeviceDouble> {
       const uint32_t baud = s.options.tcp ? 0 : s.options.baud;
       return std::make_unique<lms400::Lms400Double>(line_of(s.options), source_in(s), baud, s.now_ns);
     }},
};

std::string device_names() {
  std::string all;
  for (const DoubleKind& kind : kDoubles) all += fmt::format("{}{}", all.empty() ? "" : ", ", kind.name);
  return all;
}

/// Words on stdin, a line each; waits for them no longer than a step.
class Orders {
 public:
  void obey(DeviceDouble& device) {
    pollfd input{STDIN_FILENO, POLLIN, 0};
    if (ended_) return std::this_thread::sleep_for(std::chrono::milliseconds(kStep_ms));
    if (poll(&input, 1, kStep_ms) <= 0) return;
    std::array<char, 64> bytes;
    const ssize_t got = ::read(STDIN_FILENO, bytes.data(), bytes.size());
    if (got <= 0) ended_ = true;
    for (ssize_t i = 0; i < got; ++i) {
      const char byte = bytes[static_cast<size_t>(i)];
      if (byte != '\n') word_ += byte;
      else follow(std::exchange(word_, {}), device);
    }
  }

 private:
  static void follow(const std::string& word, DeviceDouble& device) {
    if (const auto misbehaviour = misbehaviour_of(word)) return device.misbehave(*misbehaviour);
    std::string known;
    for (const auto& [name, ignored] : kMisbehaviours) known += fmt::format("{}{}", known.empty() ? "" : ", ", name);
    std::fprintf(stderr, "takt: `%s` is no order; known: %s\n", word.c_str(), known.c_str());
  }
  std::string word_;
  bool ended_ = false;
};

int run_double(const DoubleOptions& options) {
  const auto* kind = std::find_if(std::begin(kDoubles), std::end(kDoubles),
                                  [&](const DoubleKind& known) { return known.name == options.device; });
  if (kind == std::end(kDoubles))
    return refuse(fmt::format("no double of `{}`; known: {}", options.device, device_names()), kBadInput);
  if (options.pty.empty() != options.tcp.has_value())
    return refuse("--pty PATH or --tcp PORT says where the device is to be found", kBadInput);
  const auto file = options.world.empty() ? shipped("graph/worlds/lab.xml") : options.world;
  const auto world = sim::Simulation::load(options.device, file, "", options.seed);
  if (!world) return refuse(world.error().text(), kBadInput);
  const MonotonicClock clock;
  const int64_t begin_ns = clock.now_ns();
  (*world)->begin(begin_ns);
  const auto device = kind->make({options, **world, begin_ns});
  if (const auto plugged = device->plug_in(); !plugged)
    return refuse(plugged.error().text(), plugged.error().bad_input ? kBadInput : kDeviceOrSystem);
  for (const int signal : {SIGINT, SIGTERM}) std::signal(signal, [](int) { stopped = true; });
  std::printf("%s at %s\n", options.device.c_str(),
              options.tcp ? fmt::format("127.0.0.1:{}", *options.tcp).c_str() : options.pty.c_str());
  std::fflush(stdout);
  for (Orders orders; !stopped;) {
    device->run_to(clock.now_ns());
    orders.obey(*device);
  }
  return kOk;
}

}  // namespace

void add_double(CLI::App& app, DoubleOptions& o, int& exit_code) {
  CLI::App* command = app.add_subcommand("double", "stands in for a device, at the other end of its line");
  command->add_option("device", o.device, device_names())->required();
  CLI::Option* pty =
      command->add_option("--pty", o.pty, "makes this path a terminal that drivers open as a serial port");
  command->add_option("--tcp", o.tcp, "port of this machine to be connected to")->excludes(pty);
  command->add_option("--baud", o.baud, "of an lms400 on a serial line (default 115200)");
  command->add_option("--world", o.world, "what it sees (default graph/worlds/lab.xml)");
  command->add_option("--seed", o.seed, "of that world's noise (default 1)");
  command->callback([&] { exit_code = run_double(o); });
}

}  // namespace takt::command
