// SPDX-License-Identifier: Apache-2.0
// fuzz_seeds FOLDER: inputs that the fuzz targets begin with: whole conversations and their telegrams alone, made by
// the codecs themselves, and the golden vectors; all of them also cut, doubled and with flipped bits.
#include "tests/fuzz/seeds.hpp"

#include <algorithm>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <string>
#include <vector>

#include "hal/base/base_messages.hpp"
#include "hal/can/end_to_end.hpp"
#include "hal/head/head_messages.hpp"
#include "hal/laser/lms200/commands.hpp"
#include "hal/laser/lms200/scan.hpp"
#include "hal/laser/lms400/frame.hpp"
#include "hal/laser/lms400/messages.hpp"
#include "tests/conformance/link_messages.hpp"
#include "tests/unit/lms200/golden.hpp"
#include "tests/unit/lms400/golden.hpp"
#include "tests/unit/ros2_devices/scan_bytes.hpp"

using namespace takt;
using takt::fuzz::Bytes, takt::fuzz::Seeds;

namespace {

Bytes copy(std::span<const uint8_t> bytes) { return {bytes.begin(), bytes.end()}; }
std::span<const uint8_t> bytes_of(std::string_view text) {
  return {reinterpret_cast<const uint8_t*>(text.data()), text.size()};
}

Bytes bytes_of_hex(std::string_view hex) {
  Bytes bytes;
  for (size_t i = 0; i + 1 < hex.size(); i += 2)
    bytes.push_back(static_cast<uint8_t>(std::stoul(std::string(hex.substr(i, 2)), nullptr, 16)));
  return bytes;
}

Bytes lms200_scan(size_t beams, bool partial, uint8_t quarters, bool indices) {
  Bytes words;
  for (size_t i = 0; i < beams; ++i) {
    const auto value = static_cast<uint16_t>(i % 50 == 0 ? 8191 : 1000 + 3 * i);
    words.push_back(static_cast<uint8_t>(value));
    words.push_back(static_cast<uint8_t>(value >> 8));
  }
  lms200::Scan scan{true, partial, quarters, words, {}, 0x10};
  if (indices) scan.indices = {3, 4};
  return copy(lms200::scan_telegram(scan).bytes());
}

void lms200_seeds(Seeds& seeds) {
  using namespace lms200;
  const Bytes ok{0}, variant{1, 180, 0, 100, 0}, type{'L', 'M', 'S', '2', '0', '0', ';', 'V', '1'};
  Status status;
  status.variant = {180, 100};
  status.baud = 500000;
  status.turn_us = 148;
  Configuration right, wrong;
  right.set(0, true);
  wrong.set(4, false);
  Bytes written{1};
  written.insert(written.end(), right.bytes.begin(), right.bytes.end());
  const auto say = [](Reply code, std::span<const uint8_t> data) {
    Bytes bytes{kAck};
    const Telegram telegram = reply(code, data, 0x10);
    bytes.insert(bytes.end(), telegram.bytes().begin(), telegram.bytes().end());
    return bytes;
  };
  const auto status_bytes = status_data(status);
  for (const bool interlaced : {false, true}) {
    std::vector<Bytes> parts{say(Reply::mode, ok), say(Reply::type, type), say(Reply::variant, variant),
                             say(Reply::configuration, interlaced ? wrong.bytes : right.bytes)};
    if (interlaced)
      for (const Bytes& more : {say(Reply::mode, ok), say(Reply::configuration_written, written), say(Reply::mode, ok)})
        parts.push_back(more);
    parts.push_back(say(Reply::status, status_bytes));
    parts.push_back(say(Reply::mode, ok));
    for (uint8_t turn = 0; turn < 6; ++turn)
      parts.push_back(interlaced ? lms200_scan(turn % 4 == 0 ? 181 : 180, true, turn % 4, false)
                                 : lms200_scan(181, false, 0, turn % 2 == 1));
    seeds.add_conversation(parts);
  }
  for (const auto& golden : test::kLms200Telegrams) seeds.add_and_spoil(bytes_of_hex(golden.hex));
  for (const auto& golden : test::kLms200ShortScans) seeds.add_and_spoil(bytes_of_hex(golden.hex));
  for (const Command code : {Command::reset, Command::status, Command::errors, Command::type})
    seeds.add(copy(command(code).bytes()));
  for (const Reply code : {Reply::power_on, Reply::not_permitted, Reply::errors, Reply::keep_baud})
    seeds.add(say(code, type));
}

void lms400_seeds(Seeds& seeds) {
  using namespace lms400;
  const auto text = [](std::string_view words) { return copy(Frame(bytes_of(words)).bytes()); };
  std::vector<Bytes> parts{
      text("sMA mLRstopdata"),     text("sAN mLRstopdata 00000000"),
      text("sAN SetAccessMode 1"), text("sAN mSCsetscanconfig 00000000 437A0000 3F800000 0000000A"),
      text("sAN Run 1"),           text("sAN mLRreqdata 00000000")};
  for (const Format format : {Format::distance, Format::distance_and_remission, Format::remission}) {
    for (uint16_t number = 1; number < 4; ++number) {
      Bytes beams(70 * bytes_per_beam(format));
      for (size_t i = 0; i < beams.size(); ++i) beams[i] = static_cast<uint8_t>(i % 2 == 0 ? 100 + i : 5);
      Bytes payload(kLargestPayload);
      payload.resize(write_measurement({format, 1, 550'000, 10'000, 250, 1, 0, 255, beams, number}, payload));
      parts.push_back(copy(Frame(payload).bytes()));
    }
  }
  seeds.add_conversation(parts);
  for (const auto& golden : test::kLms400Texts) seeds.add_and_spoil(text(golden.text));
  for (const auto& golden : test::kLms400Measurements) seeds.add_and_spoil(bytes_of_hex(golden.hex));
  for (const auto& golden : test::kLms400Streams) seeds.add_and_spoil(bytes_of_hex(golden.hex));
  for (const char* words : {"sFA FF", "sWA FLsel", "sRA EImac 0 6", "sMN Run", "sAN SetAccessMode 0"})
    seeds.add(text(words));
}

/// As tests/fuzz/semantic_link.cpp reads them: each message alone, as a whole and in fragments, to both ends.
void semantic_link_seeds(Seeds& seeds) {
  using namespace semantic_link;
  for (const MessageKind& info : message_kinds()) {
    Placed message(info);
    test::fill(info.kind, 3, message.get());
    std::vector<std::byte> packed;
    write_message(info, message.get(), packed);
    const Bytes bytes = copy(test::plain(packed));
    seeds.add(bytes);
    Bytes all;
    const auto add = [&](uint8_t how, uint8_t fragment, uint8_t fragments, uint8_t number, const Bytes& payload) {
      Bytes piece{static_cast<uint8_t>(info.kind), fragment, fragments, number, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0};
      piece.insert(piece.end(), payload.begin(), payload.end());
      const uint8_t to = info.way == Way::to_client ? 1 : 0;
      for (const size_t byte : {size_t{how} | to, piece.size() >> 8, piece.size()})
        all.push_back(static_cast<uint8_t>(byte));
      all.insert(all.end(), piece.begin(), piece.end());
    };
    for (uint8_t number = 1; number < 4; ++number) add(2, 0, 1, number, bytes);
    // Of a message in fragments the size stands in its first two bytes.
    const Bytes part(100, 0);
    Bytes first = part;
    first[0] = 200;
    add(0, 0, 2, 9, first);
    add(0, 1, 2, 9, first);
    seeds.add(all);
  }
}

/// Each message three times, all at the middle of their ranges, and what the controller says of the bus.
void can_seeds(Seeds& seeds) {
  using namespace can;
  Bytes all;
  const auto add = [&](const Frame& frame) {
    const WireFrame wire = to_wire(frame);
    seeds.add_and_spoil(copy(wire));
    all.insert(all.end(), wire.begin(), wire.end());
  };
  for (const auto& table : {head::messages(), base::messages()}) {
    for (const Message& message : table) {
      std::vector<double> values;
      for (const Signal& signal : message.signals)
        values.push_back(signal.page == kPageNumber ? 0 : (signal.low + signal.high) / 2);
      EndToEndSender sender;
      for (int k = 0; k < 3; ++k) {
        Frame frame = encode(message, values);
        if (message.is_protected) sender.protect(message, frame);
        add(frame);
      }
    }
  }
  for (const uint32_t what : {0x4u, 0x40u, 0x100u, 0x200u}) add({kErrorFlag | what, 8, {0, 8, 0, 0, 0, 0, 130, 10}});
  seeds.add(all);
}

/// As tests/fuzz/camera.cpp reads them: each format, with every order of eyes and every mosaic, whole and cut.
void camera_seeds(Seeds& seeds) {
  for (uint8_t format = 0; format < 5; ++format)
    for (const uint8_t eyes : {uint8_t{0}, uint8_t{1}, uint8_t{16}})
      for (uint8_t mosaic = 0; mosaic < 5; ++mosaic) {
        Bytes bytes{format, 6, 4, eyes, mosaic, 3};
        for (int i = 0; i < 6 * (3 * 2 * 14 + 3); ++i) bytes.push_back(static_cast<uint8_t>(37 * i + format));
        seeds.add_and_spoil(bytes);
      }
}

void ros2_seeds(Seeds& seeds) {
  for (const bool big_endian : {false, true})
    for (const auto& scan : {takt::test::ScanBytes{}, takt::test::ScanBytes{.ranges = {1, 2}, .intensities = {5}}}) {
      Bytes bytes;
      for (const std::byte b : scan.bytes(big_endian)) bytes.push_back(std::to_integer<uint8_t>(b));
      seeds.add_and_spoil(bytes);
    }
}

}  // namespace

int main(int argc, char** argv) {
  if (argc != 2) {
    std::fprintf(stderr, "usage: fuzz_seeds FOLDER\n");
    return 2;
  }
  const std::filesystem::path folder(argv[1]);
  Seeds lms200_inputs(folder / "lms200"), lms400_inputs(folder / "lms400"), can_inputs(folder / "can"),
      camera_inputs(folder / "camera"), link_inputs(folder / "semantic_link"), ros2_inputs(folder / "ros2");
  lms200_seeds(lms200_inputs);
  lms400_seeds(lms400_inputs);
  can_seeds(can_inputs);
  camera_seeds(camera_inputs);
  semantic_link_seeds(link_inputs);
  ros2_seeds(ros2_inputs);
  const size_t of_files = takt::fuzz::file_seeds(folder);
  std::printf(
      "seeds: %zu for lms200, %zu for lms400, %zu for can, %zu for camera, %zu for semantic_link, %zu for ros2, %zu "
      "for files\n",
      lms200_inputs.count(), lms400_inputs.count(), can_inputs.count(), camera_inputs.count(), link_inputs.count(),
      ros2_inputs.count(), of_files);
}
