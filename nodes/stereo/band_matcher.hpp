// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <atomic>
#include <memory>
#include <thread>
#include <vector>

#include "nodes/stereo/matcher.hpp"

namespace takt::stereo {

/// Square-window matching of an image in bands of rows, each on a thread of its own; the caller's takes the first.
/// Every band reads the rows beside it that its windows reach into, so the result is that of one matcher, bit for bit,
/// and bands cost those rows twice. The threads live as long as the object, sleep between two matches and run under the
/// policy of the thread that made it; pinning and priority are the caller's to give, by `threads()`.
class BandMatcher final : public Matcher {
 public:
  /// `bands` 1..8, at most one for every 16 rows. Throws std::invalid_argument for those, for parameters that problem()
  /// objects to and for a selection that looks along the whole image (semi_global).
  BandMatcher(int width, int height, int channels, const MatcherParameters& parameters, int bands);
  ~BandMatcher() override;

  [[nodiscard]] bool match(ImageView<const uint8_t> left, ImageView<const uint8_t> right,
                           const DisparityViews& out) override;
  void limit_search(int disparities) override;
  const char* target() const override { return bands_.front().matcher->target(); }

  /// Those beside the caller's own.
  std::vector<std::jthread>& threads() { return threads_; }

 private:
  struct Band {
    int first = 0, last = 0;  ///< rows of the result
    int top = 0, height = 0;  ///< rows that are read
    std::unique_ptr<Matcher> matcher;
    std::vector<int16_t> disparity;
    std::vector<uint8_t> confidence, fraction;
  };
  void run(Band& band) const;
  void serve(Band& band, const std::stop_token& stop);

  int width_, height_, channels_;
  std::vector<Band> bands_;
  ImageView<const uint8_t> left_, right_;
  DisparityViews out_;
  std::atomic<uint32_t> asked_{0}, done_{0};
  std::vector<std::jthread> threads_;  ///< last: ends before what it uses
};

}  // namespace takt::stereo
