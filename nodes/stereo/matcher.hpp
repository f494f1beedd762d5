// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <cstdint>
#include <memory>

#include "nodes/stereo/parameters.hpp"
#include "rt/msg/image_view.hpp"

namespace takt::stereo {

/// Where a matcher writes, all of the size of the images.
struct DisparityViews {
  ImageView<int16_t> disparity;   ///< px, 0 .. disparities - 1, or -1 where rejected; left (x, y) is right (x - d, y)
  ImageView<uint8_t> confidence;  ///< 0..255 (confidence_of)
  ImageView<uint8_t> fraction{};  ///< 1/64 px to add, plus 32 (kNoFraction); no data: not wanted
};

/// Dense stereo. One object serves one thread at a time; it allocates only when made.
class Matcher {
 public:
  virtual ~Matcher() = default;

  /// Disparity and confidence of each pixel of the left rectified image. Without rejection every pixel gets a
  /// disparity. Returns false, and writes nothing, if a view has not the size or the channels given at construction.
  [[nodiscard]] virtual bool match(ImageView<const uint8_t> left, ImageView<const uint8_t> right,
                                   const DisparityViews& out) = 0;

  /// From the next match() on only disparities 0 .. n - 1 are searched, n = `disparities` brought into 1 .. those given
  /// at construction; the result is that of a matcher made for n. Allocates nothing.
  virtual void limit_search(int disparities) = 0;

  /// From the next match() on parameters that problem() does not object to, as far as tuned() goes; the search stays as
  /// limit_search() left it. Allocates nothing.
  virtual void tune(const MatcherParameters& parameters) = 0;

  /// From the next match() on only rows first .. last - 1 of the result are wanted, 0 <= first < last <= height; what
  /// the others then hold is undefined. Allocates nothing.
  virtual void want_rows(int /*first*/, int /*last*/) {}

  /// CPU time that threads beside the caller's have taken, ns. Any thread.
  virtual int64_t helper_cpu_ns() const { return 0; }

  /// Name of the SIMD target in use ("AVX3", "AVX2", ...).
  virtual const char* target() const = 0;
};

/// The matcher for these parameters, for images of that size with 1 (grey) or 3 (BGR) channels:
/// square windows and winner takes all of the costs gradient, ssd, sad and census: WindowMatcher;
/// semi-global matching of the census cost without window: SemiGlobalMatcher; all else: GeneralMatcher, which takes
/// time and memory. Throws std::invalid_argument for parameters that problem() objects to.
std::unique_ptr<Matcher> make_matcher(int width, int height, int channels, const MatcherParameters& parameters);

}  // namespace takt::stereo
