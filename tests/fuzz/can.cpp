// SPDX-License-Identifier: Apache-2.0
// Any frames, to what stands between a CAN bus and the drivers of head and base: frames, protection, signals.
#include <array>
#include <cmath>
#include <initializer_list>
#include <optional>

#include "hal/base/base_messages.hpp"
#include "hal/can/end_to_end.hpp"
#include "hal/head/head_messages.hpp"
#include "tests/fuzz/require.hpp"

using namespace takt;
using namespace takt::can;
using takt::fuzz::require;

namespace {

constexpr size_t kMostRows = 24;

/// The rules of profile 1A again, in a few lines: what was heard last, and what may follow it.
struct Protection {
  std::optional<int> heard;
  bool lets_through(const Message& message, const Frame& frame) {
    if (frame.length != message.length || frame.data[0] != end_to_end_crc(message.data_id(), frame)) return false;
    const int counter = frame.data[1] % 16;
    if (counter == 15) return false;
    bool follows = false;
    for (int lost = 0; heard && lost < 3; ++lost) follows = follows || (*heard + 1 + lost) % 15 == counter;
    heard = counter;
    return follows;
  }
};

void check_signals(const Message& message, const Frame& frame) {
  std::array<double, kMostSignals> values, again;
  values.fill(NAN);
  if (!decode(message, frame, values)) {
    for (const double value : values) require(std::isnan(value));
    return;
  }
  for (size_t i = 0; i < message.signals.size(); ++i) {
    const Signal& signal = message.signals[i];
    const double tolerance = signal.factor / 2;
    require(std::isnan(values[i]) || (values[i] > signal.low - tolerance && values[i] < signal.high + tolerance));
  }
  again = values;
  const Frame encoded = encode(message, values);
  require(encoded.id == message.id && encoded.length == message.length);
  require(decode(message, encoded, again));
  require(encode(message, again) == encoded);
}

}  // namespace

/// Frames of 16 bytes as SocketCAN has them. The first padding byte says how much of it is put right: 1 the identifier
/// and the length, 2 checksum and counter, too.
extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  BusWatch bus;
  uint64_t error_frames = 0;
  for (const auto& table : {head::messages(), base::messages()}) {
    std::array<EndToEndReceiver, kMostRows> receivers{};
    std::array<EndToEndSender, kMostRows> senders;
    std::array<Protection, kMostRows> protections{};
    for (size_t at = 0; at < size; at += 16) {
      const std::span<const uint8_t> wire(data + at, std::min<size_t>(16, size - at));
      auto frame = from_wire(wire);
      require(wire.size() == 16 || !frame);
      if (!frame) continue;
      require(from_wire(to_wire(*frame)) == frame && frame->length <= 8);
      if ((frame->id & kErrorFlag) != 0) {
        bus.observe(*frame);
        require(bus.error_frames == ++error_frames);
        continue;
      }
      const size_t chosen = frame->id % table.size();
      if (wire[5] % 3 > 0) {
        frame->id = table[chosen].id;
        frame->length = table[chosen].length;
        for (size_t i = frame->length; i < 8; ++i) frame->data[i] = 0;
      }
      for (size_t row = 0; row < table.size(); ++row) {
        if (table[row].id != frame->id) continue;
        if (!table[row].is_protected) {
          check_signals(table[row], *frame);
          continue;
        }
        if (wire[5] % 3 > 1) {
          senders[row].skip(wire[6] % 5);
          senders[row].protect(table[row], *frame);
        }
        const bool let_through = usable(receivers[row].check(table[row], *frame));
        require(let_through == protections[row].lets_through(table[row], *frame));
        if (let_through) check_signals(table[row], *frame);
      }
    }
  }
  return 0;
}
