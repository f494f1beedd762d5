// SPDX-License-Identifier: Apache-2.0
#include "nodes/stereo/parameters.hpp"

namespace takt::stereo {
namespace {

std::string out_of_range(const char* name, int value, const std::string& range) {
  return std::string("parameter ") + name + " is " + std::to_string(value) + ", must lie in " + range;
}

/// Largest c_max for which the saturating byte arithmetic of a cost kind is exact.
int largest_truncation(CostKind kind) {
  switch (kind) {
    case CostKind::gradient: return 64;
    case CostKind::ssd: return 225;
    case CostKind::sad: break;
  }
  return 255;
}

}  // namespace

std::optional<std::string> problem(const MatcherParameters& p, int width, int height, int channels) {
  if (width < 1 || width > 8192 || height < 1 || height > 8192)
    return "an image of " + std::to_string(width) + " x " + std::to_string(height) +
           " px cannot be matched; 1..8192 can";
  if (channels != 1 && channels != 3) return out_of_range("channels", channels, "1 (grey) or 3 (BGR)");
  if (p.disparities < 1 || p.disparities > 512) return out_of_range("disparities", p.disparities, "1..512");
  if (p.n_square < 1 || p.n_square > 31 || p.n_square % 2 == 0)
    return out_of_range("n_square", p.n_square, "the odd numbers of 1..31");
  if (p.n_min < 1 || p.n_min > p.n_square || p.n_min % 2 == 0)
    return out_of_range("n_min", p.n_min, "the odd numbers of 1..n_square (" + std::to_string(p.n_square) + ")");
  const int limit = largest_truncation(p.cost);
  if (p.truncation() < 1 || p.c_max < 0 || p.truncation() > limit)
    return out_of_range("c_max", p.c_max, "1.." + std::to_string(limit) + " for this cost (0: its default)");
  if (p.max_sum() > 65534)
    return "c_max * n_square^2 is " + std::to_string(p.max_sum()) + ", must not exceed 65534; lower c_max or n_square";
  if (p.min_confidence < 0 || p.min_confidence > 255) return out_of_range("min_confidence", p.min_confidence, "0..255");
  if (p.uniqueness < 0 || p.uniqueness > 255) return out_of_range("uniqueness", p.uniqueness, "0..255");
  return std::nullopt;
}

}  // namespace takt::stereo
