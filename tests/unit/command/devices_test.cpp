// SPDX-License-Identifier: Apache-2.0
// `takt devices` and `takt capture`.
#include <doctest/doctest.h>

#include <array>
#include <fstream>
#include <iterator>
#include <regex>
#include <span>
#include <thread>
#include <vector>

#include "graph/command/capture_command.hpp"
#include "graph/command/devices_command.hpp"
#include "graph/run/run.hpp"
#include "hal/can/station.hpp"
#include "hal/head/head_messages.hpp"
#include "hal/stream/tcp_listener.hpp"
#include "tests/temporary_folder.hpp"

using namespace takt;
using namespace takt::command;

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
  const std::regex expected(R"(\(\d+\.\d{6}\) unix:\S+ 190#[0-9A-F]{16}\n\(\d+\.\d{6}\) unix:\S+ 20000040#0{16}\n)"
                            R"(\(\d+\.\d{6}\) unix:\S+ 710#05\n)");
  CHECK_MESSAGE(std::regex_match(text, expected), text);
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
