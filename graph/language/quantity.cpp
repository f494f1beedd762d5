// SPDX-License-Identifier: Apache-2.0
#include "graph/language/quantity.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <optional>

#include "graph/language/words.hpp"
#include "rt/param.hpp"

namespace takt::graph {
namespace {

/// One unit word: `numerator / denominator` SI units of its dimension, times `irrational` (pi / 180 for degrees).
struct Unit {
  std::string_view word, dimension;
  int64_t numerator, denominator;
  double irrational;
};

constexpr double kDegree = std::numbers::pi / 180;
constexpr std::array kUnits{Unit{"m", "m", 1, 1, 1},
                            Unit{"cm", "m", 1, 100, 1},
                            Unit{"mm", "m", 1, 1000, 1},
                            Unit{"km", "m", 1000, 1, 1},
                            Unit{"s", "s", 1, 1, 1},
                            Unit{"ms", "s", 1, 1000, 1},
                            Unit{"us", "s", 1, 1'000'000, 1},
                            Unit{"ns", "s", 1, 1'000'000'000, 1},
                            Unit{"min", "s", 60, 1, 1},
                            Unit{"h", "s", 3600, 1, 1},
                            Unit{"rad", "rad", 1, 1, 1},
                            Unit{"deg", "rad", 1, 1, kDegree},
                            Unit{"m/s", "m/s", 1, 1, 1},
                            Unit{"cm/s", "m/s", 1, 100, 1},
                            Unit{"mm/s", "m/s", 1, 1000, 1},
                            Unit{"rad/s", "rad/s", 1, 1, 1},
                            Unit{"deg/s", "rad/s", 1, 1, kDegree},
                            Unit{"Hz", "Hz", 1, 1, 1},
                            Unit{"kHz", "Hz", 1000, 1, 1},
                            Unit{"B", "B", 1, 1, 1},
                            Unit{"kB", "B", 1000, 1, 1},
                            Unit{"MB", "B", 1'000'000, 1, 1},
                            Unit{"GB", "B", 1'000'000'000, 1, 1},
                            Unit{"B/s", "B/s", 1, 1, 1},
                            Unit{"kB/s", "B/s", 1000, 1, 1},
                            Unit{"MB/s", "B/s", 1'000'000, 1, 1}};

const Unit* find_unit(std::string_view word) {
  const auto it = std::find_if(kUnits.begin(), kUnits.end(), [&](const Unit& u) { return u.word == word; });
  return it == kUnits.end() ? nullptr : &*it;
}

bool is_digit(char c) { return c >= '0' && c <= '9'; }

/// Digits from `at` on, appended to `value`; false beyond 18 digits in all, so that nothing overflows.
bool take_digits(std::string_view text, size_t& at, Wide& value, int& digits) {
  while (at < text.size() && is_digit(text[at])) {
    value = value * 10 + (text[at++] - '0');
    if (++digits > 18) return false;
  }
  return true;
}

Wide power_of_ten(int exponent) {
  Wide value = 1;
  while (exponent-- > 0) value *= 10;
  return value;
}

/// "e-3" at `at`, if digits follow; else nothing is taken ("3em" has a unit that begins with e).
int take_exponent(std::string_view text, size_t& at) {
  size_t i = at;
  if (i >= text.size() || (text[i] != 'e' && text[i] != 'E')) return 0;
  ++i;
  const bool negative = i < text.size() && text[i] == '-';
  if (i < text.size() && (text[i] == '-' || text[i] == '+')) ++i;
  if (i >= text.size() || !is_digit(text[i])) return 0;
  int exponent = 0;
  for (; i < text.size() && is_digit(text[i]); ++i) exponent = std::min(1000, exponent * 10 + (text[i] - '0'));
  at = i;
  return negative ? -exponent : exponent;
}

std::string trim(std::string_view text) {
  const auto first = text.find_first_not_of(' ');
  if (first == std::string_view::npos) return "";
  return std::string(text.substr(first, text.find_last_not_of(' ') - first + 1));
}

/// The value of `q` in SI units, rounded once if the unit is rational; twice where the product is too large for Wide.
double si_value(const Quantity& q, const Unit& unit) {
  Wide above = 0;
  const double numerator = __builtin_mul_overflow(q.numerator, Wide{unit.numerator}, &above)
                               ? static_cast<double>(q.numerator) * static_cast<double>(unit.numerator)
                               : static_cast<double>(above);
  return numerator / static_cast<double>(q.denominator * unit.denominator) * unit.irrational;
}

std::string unit_hint(std::string_view unit) { return join_words(units_like(unit), " | "); }

}  // namespace

tl::expected<Quantity, std::string> parse_quantity(std::string_view whole) {
  const std::string text = trim(whole);
  const auto no_number = [&] { return tl::make_unexpected("is `" + text + "`, which is no number with a unit"); };
  Quantity q;
  size_t at = 0;
  const bool negative = !text.empty() && text[0] == '-';
  if (negative) ++at;
  int digits = 0, decimals = 0;
  const size_t first = at;
  if (!take_digits(text, at, q.numerator, digits)) return tl::make_unexpected("is `" + text + "`: too many digits");
  if (at == first) return no_number();
  if (at < text.size() && text[at] == '.') {
    const size_t point = ++at;
    if (!take_digits(text, at, q.numerator, digits)) return tl::make_unexpected("is `" + text + "`: too many digits");
    if (at == point) return no_number();
    decimals = static_cast<int>(at - point);
  } else if (at < text.size() && text[at] == '/' && at + 1 < text.size() && is_digit(text[at + 1])) {
    q.denominator = 0;
    digits = 0;
    if (!take_digits(text, ++at, q.denominator, digits) || q.denominator == 0)
      return tl::make_unexpected("is `" + text + "`: the lower part of a fraction is a whole number from 1 on");
  }
  const int exponent = (q.denominator == 1 ? take_exponent(text, at) : 0) - decimals;
  if (exponent > 15 || exponent < -30) return tl::make_unexpected("is `" + text + "`, which is out of any range");
  if (exponent >= 0) q.numerator *= power_of_ten(exponent);
  // Trailing decimals of zero would only make the products below larger than they need to be.
  int below = exponent < 0 ? -exponent : 0;
  while (below > 0 && q.numerator % 10 == 0) q.numerator /= 10, --below;
  if (below > 18) return tl::make_unexpected("is `" + text + "`: too many digits");
  if (q.denominator == 1) q.denominator = power_of_ten(below);
  if (negative) q.numerator = -q.numerator;
  q.unit = trim(std::string_view(text).substr(at));
  if (!q.unit.empty() && (is_digit(q.unit[0]) || std::string_view(".-+/_").find(q.unit[0]) != std::string_view::npos))
    return no_number();
  return q;
}

bool carries_no_unit(std::string_view unit) { return unit.empty() || unit == "1" || unit == "px" || unit == kPath; }

std::vector<std::string> units_like(std::string_view unit) {
  std::vector<std::string> words{std::string(unit)};
  if (const Unit* declared = find_unit(unit))
    for (const auto& u : kUnits)
      if (u.dimension == declared->dimension && u.word != unit) words.emplace_back(u.word);
  return words;
}

tl::expected<double, std::string> parse_in_unit(std::string_view text, std::string_view unit) {
  const auto q = parse_quantity(text);
  if (!q) {
    const bool bare = carries_no_unit(unit);
    return tl::make_unexpected(q.error() + (bare ? "" : fmt::format("; it is in {} ({})", unit, unit_hint(unit))));
  }
  const std::string number = text.empty() ? "" : trim(text.substr(0, text.rfind(q->unit)));
  if (carries_no_unit(unit)) {
    if (q->unit.empty() || q->unit == unit) return q->value();
    return tl::make_unexpected(fmt::format("is `{}`, but it carries no unit: write {}", trim(text), number));
  }
  if (q->unit.empty())
    return tl::make_unexpected(
        fmt::format("is {0} without a unit; write {0}{1} (units: {2})", trim(text), unit, unit_hint(unit)));
  if (q->unit == unit) return q->value();
  const Unit *declared = find_unit(unit), *given = find_unit(q->unit);
  if (declared == nullptr || given == nullptr || declared->dimension != given->dimension)
    return tl::make_unexpected(fmt::format("is `{}`, but {} is no unit of it; it is in {} (units: {})", trim(text),
                                           ticked(q->unit), unit, unit_hint(unit)));
  return si_value(*q, *given) * static_cast<double>(declared->denominator) /
         (static_cast<double>(declared->numerator) * declared->irrational);
}

tl::expected<int64_t, std::string> parse_duration_ns(std::string_view text) {
  const auto q = parse_quantity(text);
  if (!q) return tl::make_unexpected(q.error() + "; a time is wanted, such as 15ms or 1/15 s");
  if (q->unit.empty())
    return tl::make_unexpected(
        fmt::format("is {0} without a unit; write {0}ms (units: {1})", trim(text), unit_hint("s")));
  const Unit* unit = find_unit(q->unit);
  if (unit == nullptr || unit->dimension != "s")
    return tl::make_unexpected(
        fmt::format("is `{}`, but {} is no unit of time (units: {})", trim(text), ticked(q->unit), unit_hint("s")));
  const Wide scale = 1'000'000'000 / unit->denominator * unit->numerator;
  if (std::abs(q->value()) * static_cast<double>(scale) > 1e17)
    return tl::make_unexpected("is `" + trim(text) + "`, longer than three years");
  const Wide twice = q->numerator * scale * 2 + (q->numerator < 0 ? -q->denominator : q->denominator);
  return static_cast<int64_t>(twice / (q->denominator * 2));
}

tl::expected<Rate, std::string> parse_rate(std::string_view text) {
  const auto q = parse_quantity(text);
  const std::string wanted = "; a rate is a positive number of releases per second: 15, 7.5 or 1/3";
  if (!q) return tl::make_unexpected("is `" + trim(text) + "`" + wanted);
  if (!q->unit.empty())
    return tl::make_unexpected(fmt::format("is `{}`, but a rate is in Hz and carries no unit: write {}", trim(text),
                                           trim(text.substr(0, text.rfind(q->unit)))));
  if (q->numerator <= 0) return tl::make_unexpected("is `" + trim(text) + "`" + wanted);
  if (q->numerator > q->denominator * 100'000 || q->denominator > q->numerator * 86'400)
    return tl::make_unexpected("is `" + trim(text) + "`; a rate lies between once a day (1/86400) and 100000");
  Wide a = q->numerator, b = q->denominator;
  while (b != 0) std::swap(a %= b, b);
  const Wide numerator = q->numerator / a, denominator = q->denominator / a;
  // Keeps numerator * k * period within 128 bits over any run.
  if (numerator > 1'000'000'000 || denominator > 1'000'000'000)
    return tl::make_unexpected("is `" + trim(text) + "`: at most nine digits above and below");
  return Rate{static_cast<int64_t>(numerator), static_cast<int64_t>(denominator)};
}

std::string duration_text(int64_t ns) {
  const double value = static_cast<double>(ns);
  if (std::abs(value) >= 1e9) return fmt::format("{:.6g}s", value * 1e-9);
  if (std::abs(value) >= 1e6) return fmt::format("{:.6g}ms", value * 1e-6);
  if (std::abs(value) >= 1e3) return fmt::format("{:.6g}us", value * 1e-3);
  return fmt::format("{}ns", ns);
}

std::string rate_text(const Rate& rate) {
  return rate.denominator == 1 ? fmt::format("{} Hz", rate.numerator)
                               : fmt::format("{}/{} Hz", rate.numerator, rate.denominator);
}

}  // namespace takt::graph
