// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <tl/expected.hpp>
#include <vector>

namespace takt::sim {

enum class Failure : uint8_t {
  silent,     ///< no data
  unplugged,  ///< gone until it is restarted after the window
  garbage,    ///< damaged data
  frozen,     ///< the data of the window's first read, again and again, with new stamps
};

/// A device fails so in [from, to), relative to the epoch of the run.
struct FailureWindow {
  Failure failure = Failure::silent;
  int64_t from_ns = 0, to_ns = 0;
};

/// "unplugged 2s..4s, frozen 6s..6.5s". The error says what is wrong and how it is written.
tl::expected<std::vector<FailureWindow>, std::string> parse_failures(std::string_view text);

/// When a device fails. Where windows overlap, the first one counts.
class FailureSchedule {
 public:
  explicit FailureSchedule(std::vector<FailureWindow> windows) : windows_(std::move(windows)) {}
  void begin(int64_t epoch_ns) { epoch_ns_ = epoch_ns; }
  std::optional<Failure> at(int64_t now_ns) const {
    for (const FailureWindow& window : windows_)
      if (now_ns - epoch_ns_ >= window.from_ns && now_ns - epoch_ns_ < window.to_ns) return window.failure;
    return std::nullopt;
  }

 private:
  std::vector<FailureWindow> windows_;
  int64_t epoch_ns_ = 0;
};

}  // namespace takt::sim
