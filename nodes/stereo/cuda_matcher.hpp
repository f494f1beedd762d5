// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <memory>
#include <string_view>

#include "nodes/cuda/card.hpp"
#include "nodes/cuda/trust.hpp"
#include "nodes/stereo/matcher.hpp"
#include "rt/time/clock.hpp"

namespace takt::stereo {

/// What a card is told of a matcher; `parameters`: that a card serves.
cuda::StereoShape card_shape(int width, int height, int channels, const MatcherParameters& parameters);

/// A WindowMatcher or SemiGlobalMatcher on a card, bit for bit alike, with its twin on the CPU: that does what the card
/// has not done in time, and all while the card has no trust. match() blocks no longer than the bound and the twin.
class CudaMatcher final : public Matcher {
 public:
  /// Whether a card has a twin for these parameters.
  static bool serves(const MatcherParameters& p);
  /// Takes 0.2 s. Throws std::invalid_argument for parameters that problem() objects to or that a card does not serve,
  /// std::runtime_error if the card refuses.
  CudaMatcher(int width, int height, int channels, const MatcherParameters& parameters, const cuda::CardUse& use);
  ~CudaMatcher() override;

  [[nodiscard]] bool match(ImageView<const uint8_t> left, ImageView<const uint8_t> right,
                           const DisparityViews& out) override;
  void limit_search(int disparities) override;
  void tune(const MatcherParameters& parameters) override;
  void want_rows(int first, int last) override;
  const char* target() const override { return use_.card.name.c_str(); }
  /// Why the last match was made by the CPU; empty: it was not. As long as this lives.
  std::string_view trouble() const { return trust_.trouble(); }
  /// Whether the card matches noise faster than the twin, by that clock: some matches of both. In virtual time it does
  /// not.
  bool is_quicker(const Clock& clock);

 private:
  /// Whether the card made it.
  bool match_on_card(ImageView<const uint8_t> left, ImageView<const uint8_t> right, const DisparityViews& out);

  const cuda::CardUse use_;
  const int width_, height_, channels_;
  const std::unique_ptr<Matcher> twin_;
  cuda::Trust trust_;
  cuda::StereoOnCard* stereo_ = nullptr;
  int disparities_, most_disparities_, min_confidence_, step_once_, step_twice_;
};

}  // namespace takt::stereo
