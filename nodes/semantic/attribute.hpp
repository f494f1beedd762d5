// SPDX-License-Identifier: Apache-2.0
// Values of attributes: their kinds, how far apart two are, and as text (thesis Sec. 5.2.2, 5.2.3; ).
#pragma once
#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <tl/expected.hpp>
#include <variant>
#include <vector>

namespace takt::semantic {

/// Channels 0..1.
struct Rgb {
  float r = 0, g = 0, b = 0;
  bool operator==(const Rgb&) const = default;
};
/// Index into Attribute::words.
struct Word {
  uint16_t index = 0;
  bool operator==(const Word&) const = default;
};
/// In the attribute's unit; monostate: unknown.
using Value = std::variant<std::monostate, double, bool, Rgb, Word>;
inline bool known(const Value& value) { return value.index() != 0; }

enum class ValueKind : uint8_t { scalar, boolean, colour, enumerated };

struct Attribute {
  ValueKind kind = ValueKind::boolean;
  std::string unit;                ///< of a scalar; empty: a pure number
  double low = 0, high = 1;        ///< of a scalar, low < high
  std::vector<std::string> words;  ///< of an enumeration
  bool identity = false;           ///< objects that differ much in it are never the same one
};

/// Whether an attribute may have that value: known, of its kind, within its range.
bool fits(const Attribute& attribute, const Value& value);

/// 0..1 of two values that fit: scalar |a - b| / range, colour root mean square over the channels, else 0 or 1.
double distance(const Attribute& attribute, const Value& a, const Value& b);

/// "1.5kg", "true", "0.9 0.1 0.1", "full", each as the attribute wants it; unknown: no value of it. No allocation.
Value value_of(const Attribute& attribute, std::string_view text);
/// The same; the error says what is valid.
tl::expected<Value, std::string> parse_value(const Attribute& attribute, std::string_view text);
/// Writes what value_of() reads, as much as fits, and returns how many characters it takes: 0 of an unknown value. No
/// allocation.
size_t write_value(const Attribute& attribute, const Value& value, std::span<char> into);
/// What parse_value() reads; "unknown" of an unknown value.
std::string to_text(const Attribute& attribute, const Value& value);
/// "boolean", "scalar, 0..20 kg", "one of empty, full".
std::string describe(const Attribute& attribute);

}  // namespace takt::semantic
