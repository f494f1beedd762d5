// SPDX-License-Identifier: Apache-2.0
#include "rt/time/rate.hpp"

#include <charconv>
#include <numeric>

namespace takt {
namespace {
__extension__ using Wide = __int128;
constexpr Wide kSecond = 1'000'000'000;
constexpr int64_t kMost = 1'000'000'000;  // of a numerator or denominator: then a period fits into int64

std::optional<int64_t> whole(std::string_view text) {
  int64_t value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc{} || end != text.data() + text.size()) return std::nullopt;
  return value;
}
}  // namespace

int64_t Rate::period_ns() const { return static_cast<int64_t>((kSecond * denominator + numerator - 1) / numerator); }

int64_t Rate::release_ns(int64_t origin_ns, int64_t k) const {
  return origin_ns + static_cast<int64_t>(Wide{k} * denominator * kSecond / numerator);
}

int64_t Rate::releases_before(int64_t origin_ns, int64_t end_ns) const {
  if (end_ns <= origin_ns) return 0;
  // The k-th release is floored to whole ns, so it lies before `end` exactly if k * period < end - origin.
  const Wide span = Wide{end_ns - origin_ns} * numerator;
  const Wide unit = kSecond * denominator;
  return static_cast<int64_t>((span + unit - 1) / unit);
}

std::optional<Rate> Rate::parse(std::string_view text) {
  Rate rate;
  if (const size_t slash = text.find('/'); slash != std::string_view::npos) {
    const auto n = whole(text.substr(0, slash)), d = whole(text.substr(slash + 1));
    if (!n || !d) return std::nullopt;
    rate = {*n, *d};
  } else if (const size_t dot = text.find('.'); dot != std::string_view::npos) {
    const std::string_view decimals = text.substr(dot + 1);
    const auto n = whole(text.substr(0, dot)), f = whole(decimals);
    if (!n || !f || *n > kMost || decimals.size() > 9 || decimals.front() == '-' || text.front() == '-')
      return std::nullopt;
    int64_t scale = 1;
    for (size_t i = 0; i < decimals.size(); ++i) scale *= 10;
    rate = {*n * scale + *f, scale};
  } else {
    const auto n = whole(text);
    if (!n) return std::nullopt;
    rate = {*n, 1};
  }
  if (rate.numerator <= 0 || rate.denominator <= 0 || rate.numerator > kMost || rate.denominator > kMost)
    return std::nullopt;
  const int64_t divisor = std::gcd(rate.numerator, rate.denominator);
  return Rate{rate.numerator / divisor, rate.denominator / divisor};
}

}  // namespace takt
