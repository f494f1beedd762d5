// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <array>
#include <cstddef>
#include <cstdint>
#include <functional>

namespace takt {

/// How much the host took lately. One thread at a time.
class StolenTime {
 public:
  static constexpr int64_t kWindow_ns = 2'000'000'000, kStep_ns = 50'000'000;

  /// `read`: CPU time that the host has taken since some instant, ns. Empty: it takes none.
  explicit StolenTime(std::function<int64_t()> read) : read_(std::move(read)) {}
  bool counted() const { return static_cast<bool>(read_); }
  /// Reads the counter if the last reading is older than kStep_ns.
  void look(int64_t now_ns);
  /// Taken in the window before the last reading; 0 before the second one.
  int64_t recent_ns() const;

 private:
  struct Reading {
    int64_t at_ns = 0, total_ns = 0;
  };
  std::function<int64_t()> read_;
  std::array<Reading, kWindow_ns / kStep_ns + 1> readings_{};
  size_t count_ = 0;
};

}  // namespace takt
