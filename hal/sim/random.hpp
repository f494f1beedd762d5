// SPDX-License-Identifier: Apache-2.0
// Counter-based random numbers: a value is a pure function of seed and counters, so that a reading at an instant is the
// same in whatever order, process or thread it is asked for.
#pragma once
#include <cmath>
#include <cstdint>
#include <numbers>

namespace takt::sim {

/// 64-bit finaliser of SplitMix64 (Steele, Lea, Flood 2014).
constexpr uint64_t mix(uint64_t x) {
  x += 0x9E3779B97F4A7C15ull;
  x = (x ^ (x >> 30)) * 0xBF58476D1CE4E5B9ull;
  x = (x ^ (x >> 27)) * 0x94D049BB133111EBull;
  return x ^ (x >> 31);
}
constexpr uint64_t mix(uint64_t seed, uint64_t a, uint64_t b = 0) { return mix(mix(mix(seed) ^ a) ^ b); }

/// Uniform in (0, 1).
constexpr double uniform(uint64_t bits) { return (static_cast<double>(bits >> 11) + 0.5) * 0x1p-53; }

/// Standard normal (Box-Muller on two derived uniforms).
inline double normal(uint64_t seed, uint64_t a, uint64_t b = 0) {
  const uint64_t first = mix(seed, a, b);
  return std::sqrt(-2.0 * std::log(uniform(first))) * std::cos(2.0 * std::numbers::pi * uniform(mix(first)));
}

}  // namespace takt::sim
