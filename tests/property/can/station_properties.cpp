// SPDX-License-Identifier: Apache-2.0
#include <doctest/doctest.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

#include <random>

#include "hal/base/base_messages.hpp"
#include "hal/base/can_base.hpp"
#include "hal/head/can_head.hpp"
#include "tests/property_scale.hpp"
#include "tests/temporary_folder.hpp"

using namespace takt;
using namespace takt::can;

namespace {

/// The far end of a Unix socket, free to send any bytes.
class RawPeer {
 public:
  explicit RawPeer(const std::string& path) : listener_(::socket(AF_UNIX, SOCK_SEQPACKET | SOCK_NONBLOCK, 0)) {
    sockaddr_un address{};
    address.sun_family = AF_UNIX;
    std::copy(path.begin(), path.end(), address.sun_path);
    REQUIRE(bind(listener_, reinterpret_cast<const sockaddr*>(&address), sizeof(address)) == 0);
    REQUIRE(listen(listener_, 1) == 0);
  }
  ~RawPeer() {
    ::close(peer_);
    ::close(listener_);
  }
  void accept() {
    peer_ = ::accept(listener_, nullptr, nullptr);
    REQUIRE(peer_ >= 0);
  }
  void send(std::span<const uint8_t> bytes) { ::send(peer_, bytes.data(), bytes.size(), MSG_DONTWAIT | MSG_NOSIGNAL); }
  void drain() {
    std::array<uint8_t, 64> bytes;
    while (recv(peer_, bytes.data(), bytes.size(), MSG_DONTWAIT) > 0) {
    }
  }

 private:
  int listener_, peer_ = -1;
};

template <class Check>
void for_all_messages(Check check) {
  for (const Message& message : head::messages()) check(message);
  for (const Message& message : base::messages()) check(message);
}

/// Whatever bytes arrive, a read ends, and says something.
template <class Driver>
void check_any_bytes(Driver& driver, RawPeer& peer, std::span<const Message> table, VirtualClock& clock,
                     uint64_t seed) {
  REQUIRE(driver.open().has_value());
  peer.accept();
  REQUIRE(driver.start(clock.now_ns()).has_value());
  std::mt19937 random(seed);
  for (int round = 0; round < test::rounds(400); ++round) {
    for (int k = 0; k < 20; ++k) {
      const Message& message = table[random() % table.size()];
      WireFrame wire{};
      for (uint8_t& byte : wire) byte = static_cast<uint8_t>(random());
      // From noise to frames that are nearly right: known identifiers, right lengths, right CRCs.
      const uint32_t likeness = random() % 4;
      if (likeness > 0) {
        Frame frame{message.id, static_cast<uint8_t>(likeness > 1 ? message.length : random() % 9), {}};
        for (size_t i = 0; i < frame.length; ++i) frame.data[i] = wire[8 + i];
        if (likeness == 3 && message.is_protected)
          EndToEndSender(static_cast<uint8_t>(random() % 15)).protect(message, frame);
        wire = to_wire(frame);
      }
      peer.send(std::span(wire).first(random() % 16 == 0 ? 1 + random() % wire.size() : wire.size()));
    }
    clock.advance_to(clock.now_ns() + 20'000'000);
    driver.command(0.1, -0.1, clock.now_ns());
    const auto reading = driver.read(clock.now_ns(), INT64_MAX);
    CHECK(reading.status != ReadStatus::end_of_data);
    if (reading.status == ReadStatus::disconnected) driver.restart(clock.now_ns());
    peer.drain();
  }
  CHECK(driver.station().counters().damaged >= test::at_scale(1000));
  CHECK(driver.station().counters().accepted >= test::at_scale(100));
}

}  // namespace

TEST_CASE("property: what is encoded is decoded to the last bit, whatever else stands in the frame") {
  std::mt19937_64 random(test::seed(1));
  for_all_messages([&](const Message& message) {
    for (int round = 0; round < test::rounds(300); ++round) {
      Frame frame{message.id, message.length, {}};
      for (size_t i = 0; i < frame.length; ++i) frame.data[i] = static_cast<uint8_t>(random());
      std::array<double, kMostSignals> values{}, again{};
      if (!decode(message, frame, values)) continue;
      const Frame encoded = encode(message, values);
      REQUIRE(decode(message, encoded, again));
      CHECK_MESSAGE(again == values, std::string(message.name));
      // Only reserved bits, the CRC and the counter may differ; encoding once more changes nothing.
      CHECK(encode(message, again) == encoded);
    }
  });
}

TEST_CASE("property: no bytes end a driver of the head or the base, or hold it up") {
  for (uint32_t seed = 1; seed <= 3; ++seed) {
    test::TemporaryFolder folder;
    VirtualClock clock(1'000'000'000);
    const std::string path = (folder.path / "can").string();
    RawPeer peer(path);
    if (seed % 2 == 0) {
      base::CanBase driver("base", {.interface = "unix:" + path}, clock);
      check_any_bytes(driver, peer, base::messages(), clock, test::seed(seed));
    } else {
      head::CanHead driver("head", {.interface = "unix:" + path}, clock);
      check_any_bytes(driver, peer, head::messages(), clock, test::seed(seed));
    }
  }
}
