// SPDX-License-Identifier: Apache-2.0
// Numbers with units as they stand in a graph or schedule file: "30cm", "150ms", "1/15 s", "-12.5deg".
#pragma once
#include <cstdint>
#include <string>
#include <string_view>
#include <tl/expected.hpp>
#include <vector>

#include "rt/time/rate.hpp"

namespace takt::graph {

/// Wide enough for 18 digits times any unit; digits with an exponent and a unit may exceed it.
__extension__ typedef __int128 Wide;

/// A number as written, exact: numerator / denominator, and the unit word behind it ("" if there is none).
struct Quantity {
  Wide numerator = 0;
  Wide denominator = 1;  ///< > 0
  std::string unit;
  double value() const { return static_cast<double>(numerator) / static_cast<double>(denominator); }
};

/// Splits "1/15 s" or "-1.5e3mm"; nothing is known of the unit yet. At most 18 significant digits.
tl::expected<Quantity, std::string> parse_quantity(std::string_view text);

/// True if values in `unit` are written without one: counts, pixels, pure numbers, text and flags ("", "1", "px").
bool carries_no_unit(std::string_view unit);

/// Units in which a value of the declared unit may be written ("m" -> m, cm, mm, km), the declared one first.
std::vector<std::string> units_like(std::string_view unit);

/// The value in the declared unit; the error says what to write: "is 0.3 without a unit; write 0.3m (m, cm, mm or km)".
tl::expected<double, std::string> parse_in_unit(std::string_view text, std::string_view unit);

/// A duration in whole nanoseconds, the nearest to what is written ("1/15 s" is 66666667).
tl::expected<int64_t, std::string> parse_duration_ns(std::string_view text);

/// Releases per second: a positive integer, decimal or fraction without unit, between one a day and 100 kHz.
tl::expected<Rate, std::string> parse_rate(std::string_view text);

/// "66.667 ms", for messages.
std::string duration_text(int64_t ns);
/// "7.5 Hz" or "1/3 Hz".
std::string rate_text(const Rate& rate);

}  // namespace takt::graph
