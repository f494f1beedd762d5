// SPDX-License-Identifier: Apache-2.0
#include "graph/command/robot/capture_command.hpp"

#include <fmt/format.h>
#include <poll.h>
#include <time.h>

#include <array>
#include <cstdio>
#include <cstring>
#include <fstream>
#include <memory>
#include <span>
#include <utility>

#include "graph/run/support.hpp"
#include "hal/can/candump.hpp"
#include "hal/can/port.hpp"
#include "hal/laser/lms200/session.hpp"
#include "hal/laser/lms400/session.hpp"
#include "hal/laser/stream_laser.hpp"
#include "hal/stream/recorded_stream.hpp"
#include "hal/stream/serial_port.hpp"
#include "hal/stream/tcp_connection.hpp"

namespace takt::command {
namespace {

constexpr int kListen_ms = 10;

int64_t realtime_ns() {
  timespec t;
  clock_gettime(CLOCK_REALTIME, &t);
  return int64_t{t.tv_sec} * 1'000'000'000 + t.tv_nsec;
}

/// "(1700000000.123456) can0 190#E841B50BE6FB0E02"
std::string candump_line(const std::string& interface, const std::string& frame, int64_t realtime_ns) {
  return fmt::format("({}.{:06}) {} {}\n", realtime_ns / 1'000'000'000, realtime_ns / 1000 % 1'000'000, interface,
                     frame);
}

/// "25 frames (5 extended, 5 remote, 5 error, 5 FD)"
std::string frames_text(const std::array<uint64_t, can::kFrameSorts>& counts) {
  constexpr std::array<const char*, can::kFrameSorts> kNames{"", "extended", "remote", "error", "FD"};
  std::string special;
  uint64_t all = counts[0];
  for (size_t i = 1; i < counts.size(); ++i) {
    all += counts[i];
    if (counts[i] > 0) special += fmt::format("{}{} {}", special.empty() ? "" : ", ", counts[i], kNames[i]);
  }
  return fmt::format("{} frames{}", all, special.empty() ? "" : " (" + special + ")");
}

int failed(const std::string& what, const std::string& fix, int code) {
  fmt::print(stderr, "takt capture: {}\n  fix: {}\n", what, fix);
  return code;
}

/// The time of a capture.
class Span {
 public:
  explicit Span(double duration_s) : end_ns_(clock.now_ns() + static_cast<int64_t>(duration_s * 1e9)) {}
  bool over() const { return clock.now_ns() >= end_ns_ || StopOnSignal::asked(); }
  const MonotonicClock clock;

 private:
  StopOnSignal stop_;
  int64_t end_ns_;
};

int written(const CaptureOptions& options, std::ofstream& file, const std::string& what, bool gone) {
  file.close();
  fmt::print("{} in {}\n", what, options.file.string());
  if (!file) return failed(options.file.string() + " cannot be written", "make room for it", kDeviceOrSystem);
  return gone ? failed(options.device + " is gone", "plug it in again", kDeviceOrSystem) : kOk;
}

int capture_bus(const CaptureOptions& options, std::ofstream& file) {
  const std::string& interface = options.device;
  const Span span(options.duration_s);
  can::Port port(interface, span.clock);
  port.want_fd();
  if (const int error = port.open({}); error != 0)
    return failed(interface + ": " + std::strerror(error), can::advice(interface, error), kDeviceOrSystem);
  std::array<uint64_t, can::kFrameSorts> frames{};
  uint64_t strange = 0;
  bool gone = false;
  while (!gone && !span.over()) {
    const can::Reception reception = port.receive();
    if (reception.packet_bytes > 0) {
      const int64_t age_ns = span.clock.now_ns() - reception.stamp_ns;
      const auto frame = can::candump_text(std::span(reception.packet).first(reception.packet_bytes));
      if (frame) file << candump_line(interface, frame->text, realtime_ns() - age_ns);
      (frame ? frames[static_cast<size_t>(frame->sort)] : strange) += 1;
    } else if (reception.status == can::PortStatus::nothing || reception.status == can::PortStatus::down) {
      poll(nullptr, 0, 1);
    }
    gone = reception.status == can::PortStatus::gone;
  }
  if (port.overflows() > 0) fmt::print("{} frames came faster than they were taken and are lost\n", port.overflows());
  if (strange > 0) fmt::print("{} packets are no CAN frames (classic or FD) and are left out\n", strange);
  return written(options, file, frames_text(frames), gone);
}

int listen(const CaptureOptions& options, std::unique_ptr<ByteStream> line, std::ofstream& file) {
  const Span span(options.duration_s);
  RecordedStream recorded(std::move(line), file);
  if (const auto opened = recorded.open(); !opened)
    return failed(opened.error().what, opened.error().fix, kDeviceOrSystem);
  recorded.set_baud(options.baud);
  uint64_t bytes = 0;
  bool gone = false;
  while (!gone && !span.over()) {
    std::array<uint8_t, 4096> into;
    const auto got = recorded.read(into);
    gone = !got.has_value();
    bytes += got.value_or(0);
    pollfd arrived{recorded.descriptor(), POLLIN, 0};
    if (got == 0u) poll(&arrived, 1, kListen_ms);
  }
  return written(options, file, fmt::format("{} bytes", bytes), gone);
}

int capture_scanner(const CaptureOptions& options, std::unique_ptr<ByteStream> line, std::ofstream& file) {
  std::unique_ptr<LaserSession> session;
  if (options.scanner == "lms200") {
    lms200::SessionSettings settings;
    settings.baud = options.baud;
    session = std::make_unique<lms200::Session>(settings);
  } else if (options.scanner == "lms400") {
    lms400::SessionSettings settings;
    if (options.device.starts_with("/")) settings.baud = options.baud;
    session = std::make_unique<lms400::Session>(settings);
  } else {
    return failed("no scanner `" + options.scanner + "`", "use lms200 or lms400", kBadInput);
  }
  const Span span(options.duration_s);
  StreamLaser laser(options.device, std::make_unique<RecordedStream>(std::move(line), file), std::move(session), {},
                    span.clock);
  if (const auto opened = laser.open(); !opened)
    return failed(opened.error().what, opened.error().fix, kDeviceOrSystem);
  laser.start(span.clock.now_ns());
  while (!span.over()) poll(nullptr, 0, kListen_ms);
  const std::string trouble = laser.trouble();
  laser.stop();
  const SourceCounts counts = laser.counts();
  if (!trouble.empty()) fmt::print("{}: {}\n", options.scanner, trouble);
  return written(options, file,
                 fmt::format("{} bytes, {} scans ({} damaged)", int64_t{file.tellp()}, counts.received, counts.damaged),
                 trouble == "the line is gone");
}

}  // namespace

int capture_device(const CaptureOptions& options) {
  const std::string& device = options.device;
  if (device.starts_with("/dev/video"))
    return failed(device + " gives frames, not bytes",
                  "v4l2-ctl -d " + device + " --stream-mmap --stream-count=10 --stream-to=FILE", kBadInput);
  std::ofstream file(options.file, std::ios::binary);
  if (!file) return failed(options.file.string() + " cannot be written", "name another file", kBadInput);
  std::unique_ptr<ByteStream> line;
  if (device.starts_with("/")) line = std::make_unique<SerialPort>("capture", device);
  else if (!device.starts_with("unix:") && device.find(':') != std::string::npos)
    line = std::make_unique<TcpConnection>("capture", device);
  else return capture_bus(options, file);
  return options.scanner.empty() ? listen(options, std::move(line), file)
                                 : capture_scanner(options, std::move(line), file);
}

}  // namespace takt::command
