// SPDX-License-Identifier: Apache-2.0
#include "hal/settings/units.hpp"

#include <charconv>
#include <cmath>
#include <numbers>

namespace takt {
namespace {

struct Unit {
  Dimension dimension;
  std::string_view name;
  double factor;
};
constexpr double kDegree = std::numbers::pi / 180.0;
constexpr Unit kUnits[] = {
    {Dimension::length, "m", 1},
    {Dimension::length, "cm", 0.01},
    {Dimension::length, "mm", 0.001},
    {Dimension::angle, "rad", 1},
    {Dimension::angle, "deg", kDegree},
    {Dimension::time, "s", 1},
    {Dimension::time, "ms", 1e-3},
    {Dimension::time, "us", 1e-6},
    {Dimension::time, "ns", 1e-9},
    {Dimension::speed, "m/s", 1},
    {Dimension::speed, "mm/s", 1e-3},
    {Dimension::turn_rate, "rad/s", 1},
    {Dimension::turn_rate, "deg/s", kDegree},
    {Dimension::rate, "", 1},
    {Dimension::rate, "Hz", 1},
    {Dimension::number, "", 1},
};

}  // namespace

std::string_view trim(std::string_view s) {
  while (!s.empty() && (s.front() == ' ' || s.front() == '\t')) s.remove_prefix(1);
  while (!s.empty() && (s.back() == ' ' || s.back() == '\t')) s.remove_suffix(1);
  return s;
}

std::optional<double> parse_quantity(std::string_view text, Dimension dimension) {
  text = trim(text);
  if (!text.empty() && text.front() == '+') text.remove_prefix(1);
  double value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc{} || !std::isfinite(value)) return std::nullopt;
  const std::string_view unit = trim(text.substr(static_cast<size_t>(end - text.data())));
  if (dimension == Dimension::rate && unit.size() > 1 && unit.front() == '/') {  // "30000/1001"
    const auto divisor = parse_quantity(unit.substr(1), Dimension::number);
    if (!divisor || *divisor <= 0) return std::nullopt;
    return value / *divisor;
  }
  for (const Unit& known : kUnits) {
    if (known.dimension == dimension && known.name == unit) return value * known.factor;
  }
  return std::nullopt;
}

std::string_view unit_names(Dimension dimension) {
  switch (dimension) {
    case Dimension::number: return "a plain number";
    case Dimension::length: return "m, cm or mm";
    case Dimension::angle: return "rad or deg";
    case Dimension::time: return "s, ms, us or ns";
    case Dimension::speed: return "m/s or mm/s";
    case Dimension::turn_rate: return "rad/s or deg/s";
    case Dimension::rate: return "Hz, as a number or a fraction";
  }
  return "";
}

}  // namespace takt
