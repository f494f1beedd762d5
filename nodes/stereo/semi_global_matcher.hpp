// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <memory>

#include "nodes/stereo/matcher.hpp"

namespace takt::stereo {

/// Semi-global matching (Hirschmueller 2008) of the census cost along the paths from left, right and above: what a
/// window has no texture for, its neighbours decide, and a slanted surface costs p1 a pixel. Integer arithmetic on
/// bytes: the same result on every SIMD target, equal to reference::semi_global. Memory is three rows of costs.
/// The confidence compares the winner's sum with the largest possible, 3 (c_max + p2).
class SemiGlobalMatcher final : public Matcher {
 public:
  /// Whether the parameters are of its kind.
  static bool serves(const MatcherParameters& p);
  /// Throws std::invalid_argument for parameters that problem() objects to.
  SemiGlobalMatcher(int width, int height, int channels, const MatcherParameters& parameters);
  ~SemiGlobalMatcher() override;

  [[nodiscard]] bool match(ImageView<const uint8_t> left, ImageView<const uint8_t> right,
                           const DisparityViews& out) override;
  void limit_search(int disparities) override;
  void tune(const MatcherParameters& parameters) override;
  const char* target() const override;

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace takt::stereo
