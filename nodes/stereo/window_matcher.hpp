// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <memory>

#include "nodes/stereo/matcher.hpp"

namespace takt::stereo {

/// Dense stereo by square windows, minimum filter and winner takes all (thesis Sec. 3.2) in integer arithmetic: the
/// result is the same, bit for bit, on every SIMD target and equals reference::match. The volume of costs is never
/// stored; memory is about 15 rows of one strip.
class WindowMatcher final : public Matcher {
 public:
  /// Whether the parameters are of its kind.
  static bool serves(const MatcherParameters& p);
  /// Throws std::invalid_argument for parameters that problem() objects to.
  WindowMatcher(int width, int height, int channels, const MatcherParameters& parameters);
  ~WindowMatcher() override;

  [[nodiscard]] bool match(ImageView<const uint8_t> left, ImageView<const uint8_t> right,
                           const DisparityViews& out) override;
  void limit_search(int disparities) override;
  void tune(const MatcherParameters& parameters) override;
  void want_rows(int first, int last) override;
  const char* target() const override;

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace takt::stereo
