// SPDX-License-Identifier: Apache-2.0
#include "hal/can/frame.hpp"

#include <doctest/doctest.h>

#include <algorithm>
#include <cstring>
#include <string>
#include <vector>

#include "hal/can/candump.hpp"
#include "hal/can/end_to_end.hpp"
#include "tests/unit/can/golden_frames.hpp"

using namespace takt;
using namespace takt::can;

namespace {

Frame frame_of(uint32_t id, std::string_view data) {
  const auto bytes = test::bytes_of(data);
  Frame frame{id, static_cast<uint8_t>(bytes.size()), {}};
  std::copy(bytes.begin(), bytes.end(), frame.data.begin());
  return frame;
}

const Signal kNoSignals[] = {{"S", 16, 8, false, 1, 0, 0, 255}};
Message protected_message(uint32_t id) { return {"M", id, 8, Sender::device, true, kNoSignals}; }

}  // namespace

TEST_CASE("can: sixteen bytes there and back; what no classic frame has is refused") {
  const Frame frame = frame_of(0x190, "E841B50BE6FB0E02");
  const WireFrame wire = to_wire(frame);
  CHECK(std::equal(wire.begin(), wire.end(), test::bytes_of("9001000008000000E841B50BE6FB0E02").begin()));
  CHECK(from_wire(wire) == frame);
  CHECK_FALSE(from_wire(std::span(wire).first(15)));
  const auto changed = [&](size_t at, uint8_t value) {
    WireFrame other = wire;
    other[at] = value;
    return from_wire(other);
  };
  CHECK_FALSE(changed(4, 9));     // length
  CHECK_FALSE(changed(3, 0x80));  // extended
  CHECK_FALSE(changed(3, 0x40));  // remote
  CHECK(changed(4, 2)->data == std::array<uint8_t, 8>{0xE8, 0x41});
}

TEST_CASE("can: every sort of frame as candump writes it") {
  const auto packet = [](uint32_t id, size_t size, uint8_t length, std::string_view data, uint8_t flags = 0,
                         uint8_t code = 0) {
    std::vector<uint8_t> bytes(size);
    std::memcpy(bytes.data(), &id, sizeof id);
    bytes[4] = length, bytes[5] = flags, bytes[7] = code;
    const auto content = test::bytes_of(data);
    std::copy(content.begin(), content.end(), bytes.begin() + 8);
    return bytes;
  };
  const auto text = [&](FrameSort sort, const std::vector<uint8_t>& bytes) {
    const auto frame = candump_text(bytes);
    REQUIRE(frame);
    CHECK(frame->sort == sort);
    return frame->text;
  };
  CHECK(text(FrameSort::standard, packet(0x190, 16, 8, "E841B50BE6FB0E02")) == "190#E841B50BE6FB0E02");
  CHECK(text(FrameSort::standard, packet(0x5, 16, 0, "")) == "005#");
  CHECK(text(FrameSort::standard, packet(0x5, 16, 8, "0102030405060708", 0, 12)) == "005#0102030405060708_C");
  CHECK(text(FrameSort::extended, packet(0x98FEF100, 16, 3, "010203")) == "18FEF100#010203");
  CHECK(text(FrameSort::extended, packet(0x80000001, 16, 1, "AB")) == "00000001#AB");
  CHECK(text(FrameSort::remote, packet(0x40000123, 16, 0, "")) == "123#R");
  CHECK(text(FrameSort::remote, packet(0xC0000123, 16, 5, "")) == "00000123#R5");
  CHECK(text(FrameSort::error, packet(0x20000004, 16, 8, "0004000000000000")) == "20000004#0004000000000000");
  CHECK(text(FrameSort::fd, packet(0x321, 72, 12, "AAAAAAAAAAAAAAAAAAAAAAAA", 1)) == "321##1AAAAAAAAAAAAAAAAAAAAAAAA");
  CHECK(text(FrameSort::fd, packet(0x80000321, 72, 0, "", 4)) == "00000321##4");
  CHECK_FALSE(candump_text(packet(0x190, 16, 9, "")));
  CHECK_FALSE(candump_text(packet(0x190, 72, 65, "")));
  for (const size_t size : {0UL, 8UL, 15UL, 17UL, 71UL, 73UL}) CHECK_FALSE(candump_text(std::vector<uint8_t>(size)));
}

TEST_CASE("can: what the error frames say") {
  const auto watched = [](std::initializer_list<std::string_view> names) {
    BusWatch bus;
    for (const auto name : names) {
      const auto* row = std::find_if(std::begin(test::kErrorFrames), std::end(test::kErrorFrames),
                                     [&](const auto& f) { return f.name == name; });
      REQUIRE(row != std::end(test::kErrorFrames));
      const auto frame = from_wire(test::bytes_of(row->wire));
      REQUIRE(frame);
      REQUIRE((frame->id & kErrorFlag) != 0);
      bus.observe(*frame);
    }
    return bus;
  };
  CHECK(watched({"tx_warning"}).state == BusState::warning);
  CHECK(watched({"tx_warning"}).transmit_errors == 96);
  CHECK(watched({"tx_passive"}).state == BusState::passive);
  CHECK(watched({"tx_passive_cnt"}).transmit_errors == 128);
  CHECK(watched({"rx_passive"}).receive_errors == 128);
  CHECK(watched({"rx_passive", "recovered"}).state == BusState::active);
  CHECK(watched({"rx_overflow"}).overflows == 1);
  CHECK(watched({"tx_passive", "bus_off"}).state == BusState::off);
  CHECK(watched({"bus_off", "restarted"}).state == BusState::active);
  CHECK(watched({"bus_off", "restarted"}).restarts == 1);
  CHECK(watched({"no_ack"}).unacknowledged == 1);
  for (const auto* name : {"tx_timeout", "prot_stuff", "lost_arb"}) {
    CHECK(watched({name}).state == BusState::active);
    CHECK(watched({name}).error_frames == 1);
  }
}

TEST_CASE("end to end: the anchors of AUTOSAR E2E profile 1A") {
  CHECK(end_to_end_crc(0x0123, frame_of(0x123, "0000000000000000")) == 0xCC);
  CHECK(end_to_end_crc(0x0123, frame_of(0x123, "0001000000000000")) == 0x91);
}

TEST_CASE("end to end: counters run 0..14 and the receiver agrees; a change of any single bit is seen") {
  const Message message = protected_message(0x321);
  EndToEndSender sender;
  EndToEndReceiver receiver;
  for (int k = 0; k < 40; ++k) {
    Frame frame{message.id, 8, {0, 0x70, static_cast<uint8_t>(k)}};
    sender.protect(message, frame);
    CHECK((frame.data[1] & 0x0F) == k % 15);
    CHECK((frame.data[1] & 0xF0) == 0x70);
    CHECK(receiver.check(message, frame) == (k == 0 ? EndToEndStatus::initial : EndToEndStatus::ok));
    for (size_t bit = 0; bit < 64; ++bit) {
      Frame changed = frame;
      changed.data[bit / 8] = static_cast<uint8_t>(changed.data[bit / 8] ^ 1u << bit % 8);
      EndToEndReceiver other;
      CHECK(other.check(message, changed) == EndToEndStatus::wrong_crc);
    }
  }
}

TEST_CASE("end to end: repeated, lost and refused frames of the golden sequences") {
  const Message message = protected_message(0x190);
  for (const auto& sequence : test::frame_sequences()) {
    EndToEndReceiver receiver;
    for (size_t i = 0; i < sequence.frames.size(); ++i) {
      CHECK_MESSAGE(test::word(receiver.check(message, frame_of(0x190, sequence.frames[i]))) == sequence.verdicts[i],
                    std::string(sequence.name));
    }
  }
  for (const auto& refused : test::kRefusedFrames) {
    EndToEndReceiver receiver;
    const auto status = receiver.check(message, frame_of(0x190, refused.data));
    switch (refused.reason) {
      case test::RefusedFrame::crc: CHECK(status == EndToEndStatus::wrong_crc); break;
      case test::RefusedFrame::counter_or_length: CHECK(status == EndToEndStatus::invalid); break;
      case test::RefusedFrame::range: CHECK(status == EndToEndStatus::initial); break;  // the codec refuses it
    }
  }
}
