// SPDX-License-Identifier: Apache-2.0
// Lines that the kernel makes: what they carry, and how they end.
#include <doctest/doctest.h>
#include <poll.h>

#include <functional>

#include "hal/stream/pseudo_terminal.hpp"
#include "hal/stream/serial_port.hpp"
#include "hal/stream/tcp_connection.hpp"
#include "hal/stream/tcp_listener.hpp"
#include "tests/hex.hpp"
#include "tests/temporary_folder.hpp"

using namespace takt;
using namespace takt::test;

namespace {

/// The kernel needs a moment, if only a short one.
bool soon(const std::function<bool()>& true_now) {
  for (int tries = 0; tries < 10'000; ++tries) {
    if (true_now()) return true;
    poll(nullptr, 0, 1);
  }
  return false;
}

std::vector<uint8_t> receive(ByteStream& stream, size_t count) {
  std::vector<uint8_t> all;
  soon([&] {
    uint8_t bytes[256];
    if (const auto got = stream.read(bytes)) all.insert(all.end(), bytes, bytes + *got);
    return all.size() >= count;
  });
  return all;
}

bool lost(ByteStream& stream) {
  return soon([&] {
    uint8_t bytes[256];
    return !stream.read(bytes).has_value();
  });
}

std::vector<uint8_t> every_byte() {
  std::vector<uint8_t> all;
  for (int byte = 0; byte < 256; ++byte) all.push_back(static_cast<uint8_t>(byte));
  return all;
}

}  // namespace

TEST_CASE("a terminal carries every byte both ways, knows the rate, and shows that its plug was pulled") {
  const TemporaryFolder folder;
  PseudoTerminal far(folder.path / "line");
  SerialPort near("laser", folder.path / "line");
  REQUIRE(far.open().has_value());
  CHECK(far.write(every_byte()) == 256);  // before anybody has opened it: does not come back as an echo
  uint8_t byte;
  CHECK(far.read({&byte, 1}) == 0);
  REQUIRE(near.open().has_value());
  CHECK(near.baud() == 9600);
  for (const uint32_t baud : {500000u, 38400u}) {
    near.set_baud(baud);
    CHECK(near.baud() == baud);
    CHECK(far.baud() == baud);
  }
  CHECK(near.write(every_byte()) == 256);
  CHECK(receive(far, 256) == every_byte());
  near.set_baud(38400);  // and forgets what came before
  CHECK(near.read({&byte, 1}) == 0);
  CHECK(far.write(every_byte()) == 256);
  CHECK(receive(near, 256) == every_byte());

  SerialPort second("other", folder.path / "line");
  const auto busy = second.open();
  REQUIRE_FALSE(busy);
  CHECK(busy.error().text().find("fuser") != std::string::npos);
  CHECK_FALSE(busy.error().bad_input);

  far.close();
  CHECK(lost(near));
  CHECK_FALSE(near.open().has_value());
  REQUIRE(far.open().has_value());
  REQUIRE(near.open().has_value());
  CHECK(far.write(every_byte()) == 256);
  CHECK(receive(near, 256) == every_byte());
}

TEST_CASE("serial lines that cannot be opened say what to do") {
  const TemporaryFolder folder;
  SerialPort absent("laser", folder.path / "none");
  const auto none = absent.open();
  REQUIRE_FALSE(none);
  CHECK(none.error().text().find("laser: " + (folder.path / "none").string()) == 0);
  CHECK(none.error().fix.find("by-id") != std::string::npos);
  SerialPort file("laser", folder.write("file", "text"));
  const auto no_terminal = file.open();
  REQUIRE_FALSE(no_terminal);
  CHECK(no_terminal.error().fix.find("name a serial line") != std::string::npos);
  PseudoTerminal taken(folder.path / "file");
  CHECK_FALSE(taken.open().has_value());
}

TEST_CASE("a connection carries bytes both ways, and shows its end on either side") {
  TcpListener far(0);
  REQUIRE(far.open().has_value());
  const std::string address = "127.0.0.1:" + std::to_string(far.port());
  TcpConnection near("laser", address);
  REQUIRE(near.open().has_value());
  CHECK(near.write(every_byte()) == 256);
  CHECK(receive(far, 256) == every_byte());
  CHECK(far.write(every_byte()) == 256);
  CHECK(receive(near, 256) == every_byte());
  // A client that comes back takes the place of the one before.
  TcpConnection again("laser", address);
  REQUIRE(again.open().has_value());
  CHECK(again.write(every_byte()) == 256);
  CHECK(receive(far, 256) == every_byte());
  CHECK(lost(near));
  far.close();
  CHECK(lost(again));
  const auto refused = again.open();
  REQUIRE_FALSE(refused);
  CHECK_FALSE(refused.error().bad_input);
}

TEST_CASE("addresses are numbers") {
  for (const char* wrong :
       {"", "laser:2111", "192.168.0.1", "192.168.0.1:", ":2111", "300.1.1.1:5", "192.168.0.1:port"}) {
    TcpConnection connection("laser", wrong);
    const auto opened = connection.open();
    REQUIRE_FALSE(opened);
    CHECK(opened.error().bad_input);
    CHECK(opened.error().text().find("192.168.0.1:2111") != std::string::npos);
  }
}
