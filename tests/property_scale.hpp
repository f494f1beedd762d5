// SPDX-License-Identifier: Apache-2.0
// How many rounds random properties run, and with which seeds:
//
//   std::mt19937 random(seed(7));
//   for (int round = 0; round < rounds(200); ++round) { ... }
//   CHECK(found >= at_scale(150));
//
// TAKT_PROPERTY_SCALE (default 1) multiplies rounds; TAKT_PROPERTY_SEED gives every generator another seed. A property
// program in which something failed prints the values that repeat it.
#pragma once
#include <algorithm>
#include <charconv>
#include <cmath>
#include <concepts>
#include <cstdint>
#include <cstdlib>
#include <optional>
#include <stdexcept>
#include <string>
#include <string_view>

namespace takt::test {

/// Nothing where it is unset or empty.
template <class T>
std::optional<T> number_in_environment(const char* name) {
  const char* said = std::getenv(name);
  const std::string_view text = said != nullptr ? said : "";
  if (text.empty()) return std::nullopt;
  T value{};
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc() || end != text.data() + text.size())
    throw std::invalid_argument(std::string(name) + " is `" + std::string(text) + "`, not a number");
  return value;
}

inline double property_scale() {
  const double scale = number_in_environment<double>("TAKT_PROPERTY_SCALE").value_or(1);
  if (!(scale > 0 && scale <= 1000))
    throw std::invalid_argument("TAKT_PROPERTY_SCALE is " + std::to_string(scale) + ", not within (0, 1000]");
  return scale;
}

inline std::optional<uint64_t> property_seed() { return number_in_environment<uint64_t>("TAKT_PROPERTY_SEED"); }

/// Rounds to run where it is n at scale 1; at least one.
template <std::integral T>
T rounds(T n) {
  return std::max(T{1}, static_cast<T>(std::ceil(static_cast<double>(n) * property_scale())));
}

/// Whether the numbers drawn are those on which the bounds of a property were set.
inline bool as_written() { return property_scale() >= 1 && !property_seed(); }

/// Least number of finds where it is k at scale 1 with the seeds of the sources. Fewer rounds and other seeds vary:
/// there half of the share of k is asked for, less three standard deviations of so many independent finds.
template <std::integral T>
T at_scale(T k) {
  const double share = static_cast<double>(k) * property_scale();
  const double least = as_written() ? share : share / 2 - 3 * std::sqrt(share / 2);
  return static_cast<T>(std::max(0.0, std::floor(least)));
}

/// Most of n that may be exceptions where it is that share in the same case; otherwise with room for what they vary.
template <std::integral T>
T at_most(T n, double share) {
  const double most = static_cast<double>(n) * share;
  return static_cast<T>(as_written() ? most : most + 3 * std::sqrt(most) + 1);
}

/// Seed of a generator that is k by default; with TAKT_PROPERTY_SEED another one for each k (splitmix64).
inline uint64_t seed(uint64_t k) {
  const auto base = property_seed();
  if (!base) return k;
  uint64_t x = *base * 0x9E3779B97F4A7C15u + k;
  for (int pass = 0; pass < 2; ++pass) {
    x += 0x9E3779B97F4A7C15u;
    x = (x ^ (x >> 30)) * 0xBF58476D1CE4E5B9u;
    x = (x ^ (x >> 27)) * 0x94D049BB133111EBu;
    x ^= x >> 31;
  }
  return x;
}

}  // namespace takt::test
