// SPDX-License-Identifier: Apache-2.0
#include "graph/command/double_command.hpp"

#include <fmt/format.h>
#include <poll.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <csignal>
#include <cstdio>
#include <memory>
#include <thread>
#include <utility>

#include "graph/command/prepare.hpp"
#include "hal/doubles/in_world.hpp"
#include "hal/laser/lms200/lms200_double.hpp"
#include "hal/laser/lms400/lms400_double.hpp"
#include "hal/stream/pseudo_terminal.hpp"
#include "hal/stream/tcp_listener.hpp"
#include "rt/time/clock.hpp"

namespace takt::command {
namespace {

constexpr int kStep_ms = 1;

std::atomic<bool> stopped{false};

struct Surroundings {
  const DoubleOptions& options;
  sim::Simulation& world;
  const Clock& clock;
};

enum class Line : uint8_t { bytes, can };

struct DoubleKind {
  std::string_view name, doc;
  Line line;
  std::unique_ptr<DeviceDouble> (*make)(const Surroundings&);
};

std::unique_ptr<ByteStream> line_of(const DoubleOptions& options) {
  if (options.tcp) return std::make_unique<TcpListener>(*options.tcp);
  return std::make_unique<PseudoTerminal>(options.pty);
}

RangeSource ranges_in(const Surroundings& s) {
  Transform mount;
  mount.z = 0.25;
  return doubles::ranges_in(s.world, mount);
}

constexpr DoubleKind kDoubles[] = {
    {"head", "the camera head, on a CAN bus", Line::can,
     [](const Surroundings& s) -> std::unique_ptr<DeviceDouble> {
       return std::make_unique<head::HeadDouble>(s.options.can, s.clock, doubles::neck_in(s.world), s.options.seed);
     }},
    {"base", "the mobile base, on a CAN bus", Line::can,
     [](const Surroundings& s) -> std::unique_ptr<DeviceDouble> {
       return std::make_unique<base::BaseDouble>(s.options.can, s.clock, doubles::body_in(s.world), s.options.seed);
     }},
    {"lms200", "a SICK LMS 200, on a pseudo terminal, or a port of this machine", Line::bytes,
     [](const Surroundings& s) -> std::unique_ptr<DeviceDouble> {
       return std::make_unique<lms200::Lms200Double>(line_of(s.options), ranges_in(s), s.clock.now_ns());
     }},
    {"lms400", "a SICK LMS 400, on a port of this machine or a pseudo terminal", Line::bytes,
     [](const Surroundings& s) -> std::unique_ptr<DeviceDouble> {
       const uint32_t baud = s.options.tcp ? 0 : s.options.baud;
       return std::make_unique<lms400::Lms400Double>(line_of(s.options), ranges_in(s), baud, s.clock.now_ns());
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
    if (const auto how = misbehaviour_of(word, device.known())) return device.misbehave(*how);
    std::fprintf(stderr, "takt: `%s` is no order; known: %s\n", word.c_str(), names_of(device.known()).c_str());
  }
  std::string word_;
  bool ended_ = false;
};

int run_double(const DoubleOptions& options) {
  const auto* kind = std::find_if(std::begin(kDoubles), std::end(kDoubles),
                                  [&](const DoubleKind& known) { return known.name == options.device; });
  if (kind == std::end(kDoubles))
    return refuse(fmt::format("no double of `{}`; known: {}", options.device, device_names()), kBadInput);
  if (kind->line == Line::can && (options.can.empty() || !options.pty.empty() || options.tcp))
    return refuse("--can INTERFACE says where the device is to be found: vcan0, or unix:PATH where there is no CAN",
                  kBadInput);
  if (kind->line == Line::bytes && (options.pty.empty() != options.tcp.has_value() || !options.can.empty()))
    return refuse("--pty PATH or --tcp PORT says where the device is to be found", kBadInput);
  const auto file = options.world.empty() ? shipped("graph/worlds/lab.xml") : options.world;
  const auto world = sim::Simulation::load(options.device, file, "", options.seed);
  if (!world) return refuse(world.error().text(), kBadInput);
  const MonotonicClock clock;
  (*world)->begin(clock.now_ns());
  const auto device = kind->make({options, **world, clock});
  if (const auto plugged = device->plug_in(); !plugged)
    return refuse(plugged.error().text(), plugged.error().bad_input ? kBadInput : kDeviceOrSystem);
  for (const int signal : {SIGINT, SIGTERM}) std::signal(signal, [](int) { stopped = true; });
  std::printf("%s at %s\n", options.device.c_str(),
              options.tcp               ? fmt::format("127.0.0.1:{}", *options.tcp).c_str()
              : kind->line == Line::can ? options.can.c_str()
                                        : options.pty.c_str());
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
  command->add_option("--can", o.can,
                      "CAN interface of a head or a base, such as vcan0; unix:PATH where there is no CAN");
  command->add_option("--baud", o.baud, "of an lms400 on a serial line (default 115200)");
  command->add_option("--world", o.world, "what it sees (default graph/worlds/lab.xml)");
  command->add_option("--seed", o.seed, "of that world's noise (default 1)");
  command->callback([&] { exit_code = run_double(o); });
}

}  // namespace takt::command
