// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <memory>

#include "nodes/stereo/matcher.hpp"

namespace takt::stereo {

/// Every combination of cost, aggregation and selection of thesis Sec. 3.2, in floating point: for what the fast
/// matchers have no form for, at 20 to 500 times their time. Whole-numbered costs stay exact, so that it agrees with
/// them bit for bit where both serve (uniqueness and sub-pixel fit see the costs after the minimum filter here).
/// Memory is n_square rows of costs, 6 MB at 640 x 150.
class GeneralMatcher final : public Matcher {
 public:
  /// Throws std::invalid_argument for parameters that problem() objects to.
  GeneralMatcher(int width, int height, int channels, const MatcherParameters& parameters);
  ~GeneralMatcher() override;

  [[nodiscard]] bool match(ImageView<const uint8_t> left, ImageView<const uint8_t> right,
                           const DisparityViews& out) override;
  void limit_search(int disparities) override;
  void tune(const MatcherParameters& parameters) override;
  const char* target() const override { return "scalar"; }

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace takt::stereo
