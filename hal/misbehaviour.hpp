// SPDX-License-Identifier: Apache-2.0
// Installed as <takt/hal/misbehaviour.hpp>: hal, experimental.
#pragma once
#include <algorithm>
#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace takt {

/// How a device goes wrong: of doubles and of simulated devices, on command, in scenarios and in settings. No device
/// knows all of it.
enum class Misbehaviour : uint8_t {
  none,
  silent,         ///< hears, but nothing of what it says arrives
  unplugged,      ///< gone from its line, and lives on; with none it is there again, and must be opened anew
  garbage,        ///< what it says arrives damaged
  frozen,         ///< the same values again and again, in good telegrams with new numbers and stamps
  repeated,       ///< the same telegram again and again, number, stamp and all
  wrong_crc,      ///< telegrams with a wrong checksum
  wrong_baud,     ///< falls to another rate of its own than was agreed
  masquerade,     ///< messages with the checksum of another one
  lost_frames,    ///< so many messages are missing that the counter tells
  no_heartbeat,   ///< says all but its heartbeat
  bus_off,        ///< its controller says bus-off and is silent; with none that it was restarted
  flagged,        ///< frames with the error flag of its driver
  cut,            ///< half of each frame
  empty,          ///< no byte of a frame
  io_error,       ///< EIO instead of a frame
  end_of_stream,  ///< EPIPE instead of a frame
  queue_error,    ///< the queue is in error: POLLERR, and no frame
  uncounted,      ///< the number of every frame is 0
  unstamped,      ///< no monotonic stamps
  dazzled,        ///< light that is too bright: of a wide field it says that it sees nothing
  polluted,       ///< a dirty window: it warns for two seconds, and is in error then
};

/// In the order of Misbehaviour.
inline constexpr std::array<std::string_view, 22> kMisbehaviours{
    "none",          "silent",      "unplugged",    "garbage",   "frozen",  "repeated", "wrong_crc", "wrong_baud",
    "masquerade",    "lost_frames", "no_heartbeat", "bus_off",   "flagged", "cut",      "empty",     "io_error",
    "end_of_stream", "queue_error", "uncounted",    "unstamped", "dazzled", "polluted"};

constexpr std::string_view to_text(Misbehaviour how) { return kMisbehaviours[static_cast<size_t>(how)]; }

/// The one of these with that name.
inline std::optional<Misbehaviour> misbehaviour_of(std::string_view word, std::span<const Misbehaviour> known) {
  const auto found = std::find_if(known.begin(), known.end(), [&](Misbehaviour how) { return to_text(how) == word; });
  return found == known.end() ? std::nullopt : std::optional(*found);
}

/// One bit for each of these, `none` left out.
constexpr uint32_t fault_bits(std::span<const Misbehaviour> faults) {
  static_assert(kMisbehaviours.size() <= 32);
  uint32_t bits = 0;
  for (const Misbehaviour how : faults)
    if (how != Misbehaviour::none) bits |= uint32_t{1} << static_cast<uint32_t>(how);
  return bits;
}

constexpr bool has(uint32_t fault_bits, Misbehaviour how) {
  return (fault_bits >> static_cast<uint32_t>(how) & 1) != 0;
}

/// In the order of Misbehaviour.
inline std::vector<Misbehaviour> faults_of(uint32_t bits) {
  std::vector<Misbehaviour> faults;
  for (size_t how = 1; how < kMisbehaviours.size(); ++how)
    if (has(bits, static_cast<Misbehaviour>(how))) faults.push_back(static_cast<Misbehaviour>(how));
  return faults;
}

/// "silent, unplugged, frozen": the names of all of these.
inline std::string names_of(std::span<const Misbehaviour> known) {
  std::string all;
  for (const Misbehaviour how : known) all.append(all.empty() ? "" : ", ").append(to_text(how));
  return all;
}

}  // namespace takt
