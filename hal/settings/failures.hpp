// SPDX-License-Identifier: Apache-2.0
// Installed as <takt/hal/settings/failures.hpp>: hal, experimental.
#pragma once
#include <atomic>
#include <cstdint>
#include <memory>
#include <string>
#include <string_view>
#include <tl/expected.hpp>
#include <vector>

#include "hal/misbehaviour.hpp"

namespace takt {

/// What every simulated device knows, and scenarios speak of.
inline constexpr std::array kCommonFailures{Misbehaviour::silent, Misbehaviour::unplugged, Misbehaviour::garbage,
                                            Misbehaviour::frozen};

/// A device fails so in [from, to), relative to the epoch of the run.
struct FailureWindow {
  Misbehaviour failure = Misbehaviour::silent;
  int64_t from_ns = 0, to_ns = 0;
};

/// "unplugged 2s..4s, frozen 6s..6.5s", in the words of `known`. The error says what is wrong and how it is written.
tl::expected<std::vector<FailureWindow>, std::string> parse_failures(
    std::string_view text, std::span<const Misbehaviour> known = kCommonFailures);

/// The one fault that somebody has switched on while the graph runs (`takt fault`). Set by the thread of the device's
/// jobs, read by any.
class FaultSwitch {
 public:
  /// `known`: all that can be switched on; `none` among them is passed over.
  explicit FaultSwitch(std::span<const Misbehaviour> known) : known_(fault_bits(known)) {}
  /// See fault_bits().
  uint32_t known() const { return known_; }
  /// `none` switches off. False: the device does not know it, and nothing changes.
  bool set(Misbehaviour fault) {
    if (fault != Misbehaviour::none && !has(known_, fault)) return false;
    on_.store(fault, std::memory_order_relaxed);
    return true;
  }
  /// `none`: nothing is switched on.
  Misbehaviour on() const { return on_.load(std::memory_order_relaxed); }

 private:
  uint32_t known_;
  std::atomic<Misbehaviour> on_{Misbehaviour::none};
};

/// When a device fails. A fault that is switched on counts before all windows; where these overlap, the first one.
class FailureSchedule {
 public:
  /// `known`: what can be switched on; see FaultSwitch.
  explicit FailureSchedule(std::vector<FailureWindow> windows, std::span<const Misbehaviour> known = kCommonFailures)
      : windows_(std::move(windows)), by_hand_(std::make_unique<FaultSwitch>(known)) {}
  FaultSwitch& by_hand() { return *by_hand_; }
  void begin(int64_t epoch_ns) { epoch_ns_ = epoch_ns; }
  std::optional<Misbehaviour> at(int64_t now_ns) const {
    if (const Misbehaviour fault = by_hand_->on(); fault != Misbehaviour::none) return fault;
    for (const FailureWindow& window : windows_)
      if (now_ns - epoch_ns_ >= window.from_ns && now_ns - epoch_ns_ < window.to_ns) return window.failure;
    return std::nullopt;
  }

 private:
  std::vector<FailureWindow> windows_;
  std::unique_ptr<FaultSwitch> by_hand_;  ///< where it stays while the schedule moves
  int64_t epoch_ns_ = 0;
};

}  // namespace takt
