// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <cstdint>
#include <memory>

#include "nodes/stereo/parameters.hpp"
#include "rt/msg/image_view.hpp"

namespace takt::stereo {

/// Dense stereo by square windows, minimum filter and winner takes all (thesis Sec. 3.2) in integer arithmetic: the
/// result is the same, bit for bit, on every SIMD target and equals reference::match. The volume of costs is never
/// stored; memory is about 15 rows of one strip. One object serves one thread at a time; it allocates only when made.
class Matcher {
 public:
  /// For images of that size with 1 (grey) or 3 (BGR) channels. Throws std::invalid_argument for parameters that
  /// problem() objects to.
  Matcher(int width, int height, int channels, const MatcherParameters& parameters);
  ~Matcher();
  Matcher(Matcher&&) noexcept;
  Matcher& operator=(Matcher&&) noexcept;

  /// Disparity (px, 0 .. disparities - 1, or -1 where rejected) and confidence (0..255) of each pixel of the left
  /// rectified image; left (x, y) meets right (x - d, y). Without rejection every pixel gets a disparity.
  /// Returns false, and writes nothing, if a view has not the size or the channels given at construction.
  [[nodiscard]] bool match(ImageView<const uint8_t> left, ImageView<const uint8_t> right, ImageView<int16_t> disparity,
                           ImageView<uint8_t> confidence);

  /// From the next match() on only disparities 0 .. n - 1 are searched, n = `disparities` brought into 1 .. those given
  /// at construction; the result is that of a matcher made for n. Allocates nothing.
  void limit_search(int disparities);

  const MatcherParameters& parameters() const;
  /// Name of the SIMD target in use ("AVX3", "AVX2", ...).
  const char* target() const;

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace takt::stereo
