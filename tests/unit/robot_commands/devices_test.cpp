// SPDX-License-Identifier: Apache-2.0
// `takt devices` and `takt capture`.
#include <doctest/doctest.h>

#include <array>
#include <fstream>
#include <iterator>
#include <span>
#include <string>
#include <string_view>
#include <thread>
#include <vector>

#include "graph/command/robot/capture_command.hpp"
#include "graph/command/robot/devices_command.hpp"
#include "graph/run/run.hpp"
#include "hal/can/station.hpp"
#include "hal/head/head_messages.hpp"
#include "hal/stream/tcp_listener.hpp"
#include "tests/temporary_folder.hpp"

using namespace takt;
using namespace takt::command;

namespace {

bool only(std::string_view characters, std::string_view text) {
  return !text.empty() && text.find_first_not_of(characters) == std::string_view::npos;
}

/// FRAME of "(SECONDS.MICROSECONDS) unix:SOCKET FRAME"; empty: the line is another one.
std::string_view frame_of(std::string_view line) {
  constexpr std::string_view kDigits = "0123456789", kInterface = ") unix:";
  const size_t point = line.find('.');
  if (point == std::string_view::npos || line[0] != '(' || !only(kDigits, line.substr(1, point - 1))) return {};
  line.remove_prefix(point + 1);
  if (line.find_first_not_of(kDigits) != 6 || !line.substr(6).starts_with(kInterface)) return {};
  line.remove_prefix(6 + kInterface.size());
  const size_t blank = line.find_first_of(" \t\v\f\r");
  return blank == std::string_view::npos || blank == 0 || line[blank] != ' ' ? "" : line.substr(blank + 1);
}

/// A status of the head, whatever it says, then the two frames behind it.
bool are_the_three(std::string_view text) {
  std::vector<std::string_view> frames;
  for (size_t end; (end = text.find('\n')) != std::string_view::npos; text.remove_prefix(end + 1))
    frames.push_back(frame_of(text.substr(0, end)));
  return text.empty() && frames.size() == 3 && frames[0].size() == 20 && frames[0].starts_with("190#") &&
         only("0123456789ABCDEF", frames[0].substr(4)) && frames[1] == "20000040#0000000000000000" &&
         frames[2] == "710#05";
}

}  // namespace

TEST_CASE("devices: nothing there is no error") {
  const test::TemporaryFolder root;
  CHECK(list_devices(false, root.path) == kOk);
  CHECK(list_devices(true, root.path) == kOk);
}

TEST_CASE("capture: what is on the bus stands in the file, frame by frame, until the bus goes") {
  const test::TemporaryFolder folder;
  const std::string interface = "unix:" + (folder.path / "can").string();
  const MonotonicClock clock;
  can::Station head(interface, clock, head::messages(), can::Sender::device);
  REQUIRE(head.open() == 0);
  // The far end of the socket is there before anybody captures: the connection waits in its queue.
  std::thread device([&] {
    const can::Frame status = head.make(head::kPosStatus, std::array<double, head::PosStatus::count>{4});
    while (!head.send(status)) head.next();  // until somebody listens
    head.send({can::kErrorFlag | 0x40, 8, {}});
    head.send({0x710, 1, {5}});
    head.close();
  });
  CHECK(capture_device({interface, folder.path / "log", 60}) == kDeviceOrSystem);  // gone before the time was over
  device.join();
  std::ifstream file(folder.path / "log");
  const std::string text{std::istreambuf_iterator<char>(file), {}};
  CHECK_MESSAGE(are_the_three(text), text);
}

TEST_CASE("capture: bytes of a connection stand in the file as they came, until it goes") {
  const test::TemporaryFolder folder;
  TcpListener device(uint16_t{0});
  REQUIRE(device.open().has_value());
  std::vector<uint8_t> said(10'000);
  for (size_t i = 0; i < said.size(); ++i) said[i] = static_cast<uint8_t>(i * 7 + i / 256);
  std::thread scanner([&] {
    std::array<uint8_t, 1> heard;
    for (std::span<const uint8_t> rest = said; !rest.empty();) {
      device.read(heard);  // lets somebody in; nothing is taken before
      rest = rest.subspan(device.write(rest).value_or(0));
    }
    device.close();
  });
  const std::string address = "127.0.0.1:" + std::to_string(device.port());
  CHECK(capture_device({address, folder.path / "log", 60}) == kDeviceOrSystem);  // gone before the time was over
  scanner.join();
  std::ifstream file(folder.path / "log", std::ios::binary);
  CHECK(std::vector<uint8_t>{std::istreambuf_iterator<char>(file), {}} == said);
}

TEST_CASE("capture: what cannot be captured is told") {
  const test::TemporaryFolder folder;
  CHECK(capture_device({"/dev/video0", folder.path / "log", 1}) == kBadInput);
  CHECK(capture_device({"/dev/none", folder.path / "log", 1}) == kDeviceOrSystem);
  CHECK(capture_device({"/dev/none", folder.path / "log", 1, "lms500"}) == kBadInput);
  CHECK(capture_device({"/dev/none", folder.path / "log", 1, "lms200"}) == kDeviceOrSystem);
  CHECK(capture_device({"can99", folder.path / "none" / "log", 1}) == kBadInput);
  CHECK(capture_device({"can99", folder.path / "log", 1}) == kDeviceOrSystem);
}
