// SPDX-License-Identifier: Apache-2.0
// Installed as <takt/hal/settings/failures.hpp>: hal, experimental.
#pragma once
#include <cstdint>
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

/// When a device fails. Where windows overlap, the first one counts.
class FailureSchedule {
 public:
  explicit FailureSchedule(std::vector<FailureWindow> windows) : windows_(std::move(windows)) {}
  void begin(int64_t epoch_ns) { epoch_ns_ = epoch_ns; }
  std::optional<Misbehaviour> at(int64_t now_ns) const {
    for (const FailureWindow& window : windows_)
      if (now_ns - epoch_ns_ >= window.from_ns && now_ns - epoch_ns_ < window.to_ns) return window.failure;
    return std::nullopt;
  }

 private:
  std::vector<FailureWindow> windows_;
  int64_t epoch_ns_ = 0;
};

}  // namespace takt
