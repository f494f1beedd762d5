// SPDX-License-Identifier: Apache-2.0
#include "nodes/stereo/parameters.hpp"

namespace takt::stereo {
namespace {

std::string out_of_range(const char* name, int value, const std::string& range) {
  return std::string("parameter ") + name + " is " + std::to_string(value) + ", must lie in " + range;
}

std::string out_of_range(const char* name, double value, const std::string& range) {
  return std::string("parameter ") + name + " is " + std::to_string(value) + ", must lie in " + range;
}

/// Largest c_max for which the saturating byte arithmetic of a cost kind is exact.
int largest_truncation(CostKind kind) {
  switch (kind) {
    case CostKind::gradient: return 64;
    case CostKind::ssd: return 225;
    case CostKind::census: return kCensusBits;
    case CostKind::sad:
    case CostKind::rss:
    case CostKind::mixed: break;
  }
  return 255;
}

std::optional<std::string> window_problem(const MatcherParameters& p) {
  if (p.n_square < 1 || p.n_square > kLargestWindow || p.n_square % 2 == 0)
    return out_of_range("n_square", p.n_square, "the odd numbers of 1..31");
  if (p.aggregation == Aggregation::adaptive_window && p.n_square < 5)
    return out_of_range("n_square", p.n_square, "5..31 for an adaptive window");
  if (p.n_min < 1 || p.n_min > p.n_square || p.n_min % 2 == 0)
    return out_of_range("n_min", p.n_min, "the odd numbers of 1..n_square (" + std::to_string(p.n_square) + ")");
  if (!(p.edge_threshold >= 0 && p.edge_threshold <= 361))
    return out_of_range("edge_threshold", p.edge_threshold, "0..361");
  if (!(p.gamma_distance > 0)) return out_of_range("gamma_distance", p.gamma_distance, "numbers above 0");
  if (!(p.gamma_colour > 0)) return out_of_range("gamma_colour", p.gamma_colour, "numbers above 0");
  return std::nullopt;
}

std::optional<std::string> cost_problem(const MatcherParameters& p) {
  const int limit = largest_truncation(p.cost);
  if (p.truncation() < 1 || p.c_max < 0 || p.truncation() > limit)
    return out_of_range("c_max", p.c_max, "1.." + std::to_string(limit) + " for this cost (0: its default)");
  if (p.aggregation == Aggregation::square && p.max_sum() > 65534)
    return "c_max * n_square^2 is " + std::to_string(p.max_sum()) + ", must not exceed 65534; lower c_max or n_square";
  if (!(p.intensity_weight >= 0 && p.intensity_weight <= 1))
    return out_of_range("intensity_weight", p.intensity_weight, "0..1");
  return std::nullopt;
}

std::optional<std::string> selection_problem(const MatcherParameters& p) {
  if (p.p1 < 0 || p.p1 > 255) return out_of_range("p1", p.p1, "0..255 (0: its default)");
  if (p.p2 < 0 || p.p2 > 255) return out_of_range("p2", p.p2, "0..255 (0: its default)");
  if (p.selection != Selection::winner && p.step_once() > p.step_twice())
    return out_of_range("p1", p.step_once(), "1..p2 (" + std::to_string(p.step_twice()) + ")");
  if (p.selection == Selection::semi_global && p.cost == CostKind::census && p.n_square == 1 &&
      3 * (p.truncation() + p.step_twice()) > 255)
    return "3 (c_max + p2) is " + std::to_string(3 * (p.truncation() + p.step_twice())) +
           ", must not exceed 255 for semi_global on census; lower c_max or p2";
  return std::nullopt;
}

}  // namespace

std::optional<std::string> problem(const MatcherParameters& p, int width, int height, int channels) {
  if (width < 1 || width > 8192 || height < 1 || height > 8192)
    return "an image of " + std::to_string(width) + " x " + std::to_string(height) +
           " px cannot be matched; 1..8192 can";
  if (channels != 1 && channels != 3) return out_of_range("channels", channels, "1 (grey) or 3 (BGR)");
  if (p.disparities < 1 || p.disparities > 512) return out_of_range("disparities", p.disparities, "1..512");
  if (const auto wrong = window_problem(p)) return wrong;
  if (const auto wrong = cost_problem(p)) return wrong;
  if (const auto wrong = selection_problem(p)) return wrong;
  if (p.min_confidence < 0 || p.min_confidence > 255) return out_of_range("min_confidence", p.min_confidence, "0..255");
  if (p.uniqueness < 0 || p.uniqueness > 255) return out_of_range("uniqueness", p.uniqueness, "0..255");
  return std::nullopt;
}

MatcherParameters tuned(const MatcherParameters& made, const MatcherParameters& wanted) {
  MatcherParameters p = made;
  p.intensity_weight = wanted.intensity_weight;
  p.combination = wanted.combination;
  p.edge_threshold = wanted.edge_threshold;
  p.gamma_distance = wanted.gamma_distance;
  p.gamma_colour = wanted.gamma_colour;
  p.p1 = wanted.p1;
  p.p2 = wanted.p2;
  p.min_confidence = wanted.min_confidence;
  return p;
}

}  // namespace takt::stereo
