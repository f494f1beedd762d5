// SPDX-License-Identifier: Apache-2.0
#include "graph/command/robot/double_command.hpp"

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

#include "graph/cli/file_option.hpp"
#include "graph/run/prepare.hpp"
#include "hal/camera/loopback_double.hpp"
#include "hal/doubles/in_world.hpp"
#include "hal/laser/lms200/lms200_double.hpp"
#include "hal/laser/lms400/lms400_double.hpp"
#include "hal/stream/pseudo_terminal.hpp"
#include "hal/stream/tcp_listener.hpp"
#include "rt/msg/geometry.hpp"
#include "rt/time/clock.hpp"

namespace takt::command {
namespace {

constexpr int kStep_ms = 1;

std::atomic<bool> stopped{false};

struct Surroundings {
  const DoubleOptions& options;
  sim::Simulation& world;
  const Clock& clock;
  StereoRig rig;  ///< of a camera
};

enum class Line : uint8_t { bytes, can, video };

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

/// As a Bumblebee: two bytes a pixel, colours through a mosaic.
v4l2::LoopbackDouble::Settings camera_of(const Surroundings& s) {
  v4l2::LoopbackDouble::Settings camera{s.options.video, {}, Rate{std::llround(s.options.rate_hz * 1000), 1000}};
  camera.layout.width = s.rig.width;
  camera.layout.height = s.rig.height;
  if (s.rig.channels == 3) camera.layout.mosaic = v4l2::Mosaic::rggb;
  return camera;
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
    {"camera", "a stereo camera, behind v4l2loopback", Line::video,
     [](const Surroundings& s) -> std::unique_ptr<DeviceDouble> {
       const auto camera = camera_of(s);
       return std::make_unique<v4l2::LoopbackDouble>(camera, doubles::frames_in(s.world, s.rig, camera.layout));
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
  const bool bytes = !options.pty.empty() || options.tcp, can = !options.can.empty(), video = !options.video.empty();
  if (kind->line == Line::can && (!can || bytes || video))
    return refuse("--can INTERFACE says where the device is to be found: vcan0, or unix:PATH where there is no CAN",
                  kBadInput);
  if (kind->line == Line::bytes && (!bytes || can || video))
    return refuse("--pty PATH or --tcp PORT says where the device is to be found", kBadInput);
  if (kind->line == Line::video && (!video || bytes || can))
    return refuse("--video PATH says where the device is to be found: /dev/video0 of v4l2loopback", kBadInput);
  StereoRig rig;
  if (kind->line == Line::video) {
    const auto loaded = load_rig(options.device, options.rig.empty() ? shipped("graph/rigs/xb3.yaml") : options.rig);
    if (!loaded) return refuse(loaded.error().text(), kBadInput);
    rig = *loaded;
  }
  const auto file = options.world.empty() ? shipped("graph/worlds/lab.xml") : options.world;
  const auto world = sim::Simulation::load(options.device, file, "", options.seed);
  if (!world) return refuse(world.error().text(), kBadInput);
  const MonotonicClock clock;
  (*world)->begin(clock.now_ns());
  const auto device = kind->make({options, **world, clock, rig});
  if (const auto plugged = device->plug_in(); !plugged)
    return refuse(plugged.error().text(), plugged.error().bad_input ? kBadInput : kDeviceOrSystem);
  for (const int signal : {SIGINT, SIGTERM, SIGHUP}) std::signal(signal, [](int) { stopped = true; });
  device->run_to(clock.now_ns());  // a camera can be opened once it has given a frame
  std::printf("%s at %s\n", options.device.c_str(),
              options.tcp ? fmt::format("127.0.0.1:{}", *options.tcp).c_str()
              : can       ? options.can.c_str()
              : video     ? options.video.c_str()
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
  command->add_option("--video", o.video, "device file of v4l2loopback that a camera's frames are written to");
  reads_file(command->add_option("--rig", o.rig, "lens, size and mount of a camera (default graph/rigs/xb3.yaml)"));
  command->add_option("--rate", o.rate_hz, "frames of a camera per second (default 15)")
      ->check(CLI::Range(0.01, 200.0));
  command->add_option("--baud", o.baud, "of an lms400 on a serial line (default 115200)");
  reads_file(command->add_option("--world", o.world, "what it sees (default graph/worlds/lab.xml)"));
  command->add_option("--seed", o.seed, "of that world's noise (default 1)");
  command->footer(
      "Example: takt double lms200 --pty /tmp/lms200\n"
      "Example: takt double base --can vcan0\n"
      "A driver opens it as the device itself. Words on the standard input break it.");
  command->callback([&] { exit_code = run_double(o); });
}

}  // namespace takt::command
