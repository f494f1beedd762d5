// SPDX-License-Identifier: Apache-2.0
#include <doctest/doctest.h>

#include <cmath>
#include <cstring>
#include <limits>
#include <numeric>

#include "hal/semantic_link/messages.hpp"
#include "hal/semantic_link/wire.hpp"
#include "rt/msg/ace/action.hpp"
#include "rt/msg/ace/object_reports.hpp"
#include "rt/msg/laser_scan.hpp"
#include "rt/msg/text_status.hpp"
#include "rt/msg/velocity_command.hpp"
#include "tests/conformance/link_messages.hpp"

using namespace takt;
using namespace takt::semantic_link;
using takt::test::Bytes;

namespace {

Header scan_header(uint32_t bytes) {
  Header header;
  header.kind = Kind::scan;
  header.session = 0x1122334455667788;
  header.sequence = 7;
  header.number = 3;
  header.stamp_ns = -5;
  header.message_bytes = bytes;
  return header;
}

Bytes written(const Header& header, const Bytes& payload, const Key& key = {}) {
  Bytes bytes(payload.size() + kOverhead);
  REQUIRE(write_packet(header, payload, key, bytes) == bytes.size());
  return bytes;
}

Fault fault_of(const Bytes& bytes, const Key& key = {}) {
  const auto packet = read_packet(bytes, key);
  REQUIRE_FALSE(packet.has_value());
  return packet.error();
}

/// Bytes of a message after `change` was applied to a good one.
template <class T, class Change>
bool readable(Kind kind, Change change) {
  Placed message(info_of(kind));
  test::fill(kind, 5, message.get());
  change(message.as<T>());
  std::vector<std::byte> packed;
  REQUIRE(write_message(info_of(kind), message.get(), packed));
  Placed back(info_of(kind));
  const auto result = read_message(info_of(kind), test::plain(packed), back.get());
  if (!result) CHECK(result.error() == Fault::content);
  return result.has_value();
}

}  // namespace

TEST_CASE("SipHash-2-4: the values of its authors, key 00..0f, bytes 00, 01, ...") {
  Key key;
  std::iota(key.begin(), key.end(), uint8_t{0});
  Bytes bytes(15);
  std::iota(bytes.begin(), bytes.end(), uint8_t{0});
  CHECK(siphash(key, std::span(bytes).first(0)) == 0x726fdb47dd0e0e31);
  CHECK(siphash(key, std::span(bytes).first(1)) == 0x74f839c593dc67fd);
  CHECK(siphash(key, std::span(bytes).first(8)) == 0x93f5f5799a932462);
  CHECK(siphash(key, bytes) == 0xa129ca6149be45e5);
}

TEST_CASE("a datagram's bytes, one by one") {
  const Bytes bytes = written(scan_header(2), {0xAB, 0xCD});
  const Bytes head{'T',  'S',  'L',  'K',  1,    17,   0, 1, 0x88, 0x77, 0x66, 0x55, 0x44,
                   0x33, 0x22, 0x11, 7,    0,    0,    0, 3, 0,    0,    0,    0xFB, 0xFF,
                   0xFF, 0xFF, 0xFF, 0xFF, 0xFF, 0xFF, 2, 0, 0,    0,    0xAB, 0xCD};
  REQUIRE(bytes.size() == head.size() + kCheckBytes);
  CHECK(std::equal(head.begin(), head.end(), bytes.begin()));
  const auto packet = read_packet(bytes, {});
  REQUIRE(packet);
  CHECK(packet->header.kind == Kind::scan);
  CHECK(packet->header.session == 0x1122334455667788);
  CHECK(packet->header.sequence == 7);
  CHECK(packet->header.number == 3);
  CHECK(packet->header.stamp_ns == -5);
  CHECK(packet->payload.size() == 2);
}

TEST_CASE("one byte changed, missing or too many: refused, and it is said why") {
  const Bytes good = written(scan_header(20), Bytes(20, 9));
  for (size_t i = 0; i < good.size(); ++i) {
    Bytes bytes = good;
    bytes[i] ^= 0x10;
    const Fault expected = i < 4 ? Fault::magic : i == 4 ? Fault::version : Fault::check;
    CHECK(fault_of(bytes) == expected);
    const Fault shorter = fault_of(Bytes(good.begin(), good.begin() + static_cast<ptrdiff_t>(i)));
    CHECK(shorter == (i < kOverhead ? Fault::length : Fault::check));
  }
  Bytes longer = good;
  longer.push_back(0);
  CHECK(fault_of(longer) == Fault::check);
  CHECK(fault_of(Bytes(kLargestDatagram + 1)) == Fault::length);
  Key key{};
  key[3] = 1;
  CHECK(fault_of(good, key) == Fault::check);  // who has another key, or none
}

TEST_CASE("kinds and fragments that cannot be, with a check that holds") {
  const auto shape = [](uint8_t fragment, uint8_t fragments, uint32_t message, size_t payload) {
    Header header = scan_header(message);
    header.fragment = fragment;
    header.fragments = fragments;
    const auto packet = read_packet(written(header, Bytes(payload)), {});
    return packet ? std::string("ok") : std::string(to_text(packet.error()));
  };
  CHECK(shape(0, 1, 20, 20) == "ok");
  CHECK(shape(0, 1, 21, 20) == "shape");
  CHECK(shape(0, 0, 20, 20) == "shape");
  CHECK(shape(1, 1, 20, 20) == "shape");
  CHECK(shape(0, 3, 25, 10) == "ok");
  CHECK(shape(2, 3, 25, 5) == "ok");
  CHECK(shape(2, 3, 25, 6) == "shape");   // the two before are of one size
  CHECK(shape(2, 3, 25, 11) == "shape");  // the last is larger than the others
  CHECK(shape(0, 3, 20, 10) == "shape");  // two would do
  CHECK(shape(0, 3, 31, 10) == "shape");  // three are too few
  CHECK(shape(0, 65, 65, 1) == "shape");
  CHECK(shape(0, 1, 64'001, 64'001) == "shape");
  Header header = scan_header(0);
  for (int kind = 0; kind < 256; ++kind) {
    header.kind = static_cast<Kind>(kind);
    const bool ok = read_packet(written(header, {}), {}).has_value();
    CHECK(ok == ((kind >= 1 && kind <= 5) || (kind >= 16 && kind <= 23)));
  }
}

TEST_CASE("every message comes back bit by bit, and is refused at any other length") {
  for (const MessageKind& info : message_kinds()) {
    CAPTURE(info.name);
    Placed message(info), back(info);
    test::fill(info.kind, 17, message.get());
    std::vector<std::byte> bytes, again;
    REQUIRE(write_message(info, message.get(), bytes));
    CHECK(bytes.size() <= most_bytes(info));
    CHECK(most_bytes(info) <= kLargestMessage);
    REQUIRE(read_message(info, test::plain(bytes), back.get()));
    REQUIRE(write_message(info, back.get(), again));
    CHECK(bytes == again);
    for (size_t size = 0; size < bytes.size(); ++size)
      CHECK_FALSE(read_message(info, test::plain(bytes).first(size), back.get()).has_value());
    bytes.push_back({});
    CHECK_FALSE(read_message(info, test::plain(bytes), back.get()).has_value());
  }
}

TEST_CASE("messages that nobody can mean are refused") {
  const double nan = std::nan(""), inf = std::numeric_limits<double>::infinity();
  CHECK(readable<VelocityCommand>(Kind::velocity, [](auto&) {}));
  CHECK_FALSE(readable<VelocityCommand>(Kind::velocity, [&](auto& m) { m.speed_m_s = nan; }));
  CHECK_FALSE(readable<VelocityCommand>(Kind::velocity, [&](auto& m) { m.turn_rad_s = -inf; }));
  CHECK_FALSE(readable<LaserScan>(Kind::scan, [](auto& m) { m.range_m[1] = std::nanf(""); }));
  CHECK_FALSE(readable<LaserScan>(Kind::scan, [](auto& m) { m.range_m[1] = -1; }));
  CHECK_FALSE(readable<LaserScan>(Kind::scan, [](auto& m) { m.sweep_s = -0.1; }));
  CHECK_FALSE(readable<ActionCommand>(Kind::action, [](auto& m) { std::memset(m.action, 'a', sizeof m.action); }));
  CHECK_FALSE(
      readable<ActionCommand>(Kind::action, [](auto& m) { std::memset(m.objects[3], 'a', sizeof m.objects[3]); }));
  CHECK_FALSE(readable<ActionOutcome>(Kind::outcome, [](auto& m) { m.state = 5; }));
  CHECK_FALSE(readable<ActionOutcome>(Kind::outcome, [](auto& m) { std::memset(m.reason, 'a', sizeof m.reason); }));
  const auto reports = [](auto change) { return readable<ObjectReports>(Kind::objects, change); };
  CHECK(reports([](auto&) {}));
  CHECK_FALSE(reports([](auto& m) { m.names.size -= 1; }));
  CHECK_FALSE(reports([](auto& m) { m.in_map = 2; }));
  CHECK_FALSE(reports([](auto& m) { m.places[0].attributes += 1; }));
  CHECK_FALSE(reports([](auto& m) { m.places[0].attributes = -1; }));
  CHECK_FALSE(reports([](auto& m) { m.places[0].attributes = 0.5f; }));
  CHECK_FALSE(reports([](auto& m) { std::memset(m.names[1].type, 'a', sizeof m.names[1].type); }));
  CHECK_FALSE(reports([](auto& m) { std::memset(m.attributes[0].value, 'a', sizeof m.attributes[0].value); }));
}

TEST_CASE("a message that is larger than its kind may be is not written") {
  Placed text(info_of(Kind::status));
  const MessageKind& status = info_of(Kind::status);
  MessageKind larger = status;
  larger.capacity.count = status.capacity.count + 1;
  Placed message(larger);
  message.as<TextStatus>().text.resize(larger.capacity.count);
  std::vector<std::byte> bytes;
  CHECK_FALSE(write_message(status, message.get(), bytes));
  CHECK(bytes.empty());
}

TEST_CASE("notes come back, and at another length or with an impossible value they are none") {
  std::array<uint8_t, kLargestNote> bytes{};
  Hello hello{{'a', 'c', 'e'}, 5, layout()};
  REQUIRE(write_note(hello, bytes) == 48);
  const auto back = read_hello(bytes);
  REQUIRE(back);
  CHECK(back->robot == hello.robot);
  CHECK(back->nonce == 5);
  CHECK(back->layout == layout());
  CHECK_FALSE(read_hello(std::span(bytes).first(47)));
  bytes[31] = 'x';
  CHECK_FALSE(read_hello(bytes));  // a name without end
  REQUIRE(write_note(RefusalNote{9, Reason::taken}, bytes) == 9);
  CHECK(read_refusal(std::span(bytes).first(9))->reason == Reason::taken);
  bytes[8] = 0;
  CHECK_FALSE(read_refusal(std::span(bytes).first(9)));
  REQUIRE(write_note(Welcome{1, 2, 3}, bytes) == 24);
  CHECK(read_welcome(std::span(bytes).first(24))->heard_ns == 3);
  REQUIRE(write_note(Alive{-2, 4}, bytes) == 16);
  CHECK(read_alive(std::span(bytes).first(16))->sent_ns == -2);
  CHECK_FALSE(read_alive(std::span(bytes).first(15)));
}
