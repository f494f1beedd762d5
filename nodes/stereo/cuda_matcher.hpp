// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <memory>
#include <string>
#include <string_view>

#include "nodes/cuda/card.hpp"
#include "nodes/stereo/matcher.hpp"
#include "rt/time/clock.hpp"

namespace takt::stereo {

/// A WindowMatcher or SemiGlobalMatcher on a card, bit for bit alike, with its twin on the CPU: that does what the card
/// has not done in time. After kMostLate matches in a row that came late, the card is left alone for kPause matches;
/// after an error of CUDA, for good. match() blocks no longer than the bound and the twin.
class CudaMatcher final : public Matcher {
 public:
  static constexpr int kMostLate = 3, kPause = 150;
  /// Whether a card has a twin for these parameters.
  static bool serves(const MatcherParameters& p);
  /// `bound_ns`: how long a match may wait for the card. Takes 0.2 s. Throws std::invalid_argument for parameters that
  /// problem() objects to or that a card does not serve, std::runtime_error if the card refuses.
  CudaMatcher(int width, int height, int channels, const MatcherParameters& parameters, const cuda::Card& card,
              int64_t bound_ns);
  ~CudaMatcher() override;

  [[nodiscard]] bool match(ImageView<const uint8_t> left, ImageView<const uint8_t> right,
                           const DisparityViews& out) override;
  void limit_search(int disparities) override;
  void tune(const MatcherParameters& parameters) override;
  void want_rows(int first, int last) override;
  const char* target() const override { return card_.name.c_str(); }
  /// Why the last match was made by the CPU; empty: it was not. As long as this lives.
  std::string_view trouble() const { return *trouble_; }
  /// Whether the card matches noise faster than the twin, by that clock: some matches of both. In virtual time it does
  /// not.
  bool is_quicker(const Clock& clock);

 private:
  /// Whether the card made it.
  bool match_on_card(ImageView<const uint8_t> left, ImageView<const uint8_t> right, const DisparityViews& out);

  const cuda::Card card_;
  const int64_t bound_ns_;
  const int width_, height_, channels_;
  const std::unique_ptr<Matcher> twin_;
  const std::string none_, late_, failed_;
  const std::string* trouble_ = &none_;
  cuda::StereoOnCard* stereo_ = nullptr;
  int disparities_, most_disparities_, min_confidence_, step_once_, step_twice_;
  int late_in_row_ = 0, pause_ = 0;
  bool given_up_ = false;
};

}  // namespace takt::stereo
