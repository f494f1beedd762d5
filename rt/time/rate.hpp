// SPDX-License-Identifier: Apache-2.0
// Installed as <takt/time/rate.hpp>: core, stable.
#pragma once
#include <cstdint>
#include <optional>
#include <string_view>

namespace takt {

/// Releases per second as an exact fraction, so that 7 Hz or 30000/1001 Hz never drift. Both parts positive.
struct Rate {
  int64_t numerator = 1;
  int64_t denominator = 1;

  double hz() const { return static_cast<double>(numerator) / static_cast<double>(denominator); }
  /// Longest distance of two releases, ns (rounded up).
  int64_t period_ns() const;
  /// Instant of release k >= 0 after `origin_ns` (= epoch + offset): floor(origin + k * period).
  int64_t release_ns(int64_t origin_ns, int64_t k) const;
  /// Number of releases in [origin, end): ceil((end - origin) * rate), 0 if end <= origin.
  int64_t releases_before(int64_t origin_ns, int64_t end_ns) const;
  bool operator==(const Rate&) const = default;

  /// "15", "7.5" or "30000/1001"; nothing if the text is no positive number.
  static std::optional<Rate> parse(std::string_view text);
};

}  // namespace takt
