// SPDX-License-Identifier: Apache-2.0
#include "nodes/stereo/half_resolution.hpp"

#include <cstring>
#include <stdexcept>

#include "nodes/stereo/post_process.hpp"

namespace takt::stereo {
namespace {

/// Windows shrink with the image, to the next odd edge: they then see about as much of the scene as at full size.
MatcherParameters halved(MatcherParameters p) {
  const auto odd_half = [](int edge) { return (edge + 1) / 2 | 1; };
  p.disparities = (p.disparities + 1) / 2;
  p.n_square = odd_half(p.n_square);
  p.n_min = odd_half(p.n_min);
  return p;
}

/// What is wrong is told of the parameters as they were given.
const MatcherParameters& checked(const MatcherParameters& p, int width, int height, int channels) {
  if (const auto wrong = problem(p, width, height, channels)) throw std::invalid_argument("stereo: " + *wrong);
  return p;
}

size_t pixels(int width, int height) { return static_cast<size_t>(half(width)) * static_cast<size_t>(half(height)); }

/// Elements from a pixel to its right neighbour: kStep, 0 in an image one pixel wide, where it is its own.
template <int kChannels, int kStep>
void halve_row(const uint8_t* a, const uint8_t* b, int count, uint8_t* out) {
  constexpr int kNext = kStep == 0 ? kChannels : 2 * kChannels;
  for (int x = 0; x < count; ++x)
    for (int c = 0; c < kChannels; ++c) {
      const int i = kNext * x + c;
      out[kChannels * x + c] = static_cast<uint8_t>((a[i] + a[i + kStep] + b[i] + b[i + kStep] + 2) >> 2);
    }
}

template <class T>
void copy_row(const T* from, int count, T* to) {
  std::memcpy(to, from, static_cast<size_t>(count) * sizeof(T));
}

/// out[x] = value(x / 2), `last` being the last argument that value has.
template <class T, class Value>
void twice(int width, int last, T* out, Value value) {
  const int pairs = std::min(last + 1, width / 2);
  for (int x = 0; x < pairs; ++x) out[2 * x] = out[2 * x + 1] = value(x);
  for (int x = 2 * pairs; x < width; ++x) out[x] = value(last);  // an odd last column
}

}  // namespace

void halve(ImageView<const uint8_t> in, ImageView<uint8_t> out) {
  for (int y = 0; y < out.height; ++y) {
    const uint8_t* a = in.row(2 * y);
    const uint8_t* b = in.row(std::min(2 * y + 1, in.height - 1));
    if (in.width < 2) halve_row<1, 0>(a, b, out.width * in.channels, out.row(y));
    else if (in.channels == 3) halve_row<3, 3>(a, b, out.width, out.row(y));
    else halve_row<1, 1>(a, b, out.width, out.row(y));
  }
}

void enlarge(const DisparityViews& in, const DisparityViews& out) {
  const int width = out.disparity.width;
  const bool fine = in.fraction.data != nullptr && out.fraction.data != nullptr;
  for (int y = 0; y < out.disparity.height; ++y) {
    int16_t* d_out = out.disparity.row(y);
    uint8_t* c_out = out.confidence.row(y);
    uint8_t* f_out = fine ? out.fraction.row(y) : nullptr;
    if (y % 2 == 1) {
      copy_row(out.disparity.row(y - 1), width, d_out);
      copy_row(out.confidence.row(y - 1), width, c_out);
      if (fine) copy_row(out.fraction.row(y - 1), width, f_out);
      continue;
    }
    const int from = std::min(y / 2, in.disparity.height - 1), last = in.disparity.width - 1;
    const int16_t* d = in.disparity.row(from);
    const uint8_t* f = fine ? in.fraction.row(from) : nullptr;
    const uint8_t* c = in.confidence.row(from);
    twice(width, last, c_out, [&](int x) { return c[x]; });
    if (!fine) {
      twice(width, last, d_out, [&](int x) { return static_cast<int16_t>(d[x] < 0 ? -1 : 2 * d[x]); });
      continue;
    }
    const auto doubled = [&](int x) { return std::max(0, 2 * (d[x] * kFractions + f[x]) - kNoFraction); };
    twice(width, last, d_out, [&](int x) { return static_cast<int16_t>(d[x] < 0 ? -1 : doubled(x) / kFractions); });
    twice(width, last, f_out, [&](int x) { return static_cast<uint8_t>(doubled(x) % kFractions); });
  }
}

HalfMatcher::HalfMatcher(int width, int height, int channels, const MatcherParameters& parameters)
    : width_(width),
      height_(height),
      channels_(channels),
      matcher_(make_matcher(half(width), half(height), channels, halved(checked(parameters, width, height, channels)))),
      left_(pixels(width, height) * static_cast<size_t>(channels)),
      right_(left_.size()),
      confidence_(pixels(width, height)),
      fraction_(pixels(width, height)),
      disparity_(pixels(width, height)) {}

void HalfMatcher::tune(const MatcherParameters& parameters) {
  matcher_->tune(halved(checked(parameters, width_, height_, channels_)));
}

bool HalfMatcher::match(ImageView<const uint8_t> left, ImageView<const uint8_t> right, const DisparityViews& out) {
  if (!fit(left, right, out, width_, height_, channels_)) return false;
  const int w = half(width_), h = half(height_);
  const ImageView<uint8_t> half_left(left_.data(), w, h, channels_), half_right(right_.data(), w, h, channels_);
  const DisparityViews halved{{disparity_.data(), w, h}, {confidence_.data(), w, h}, {fraction_.data(), w, h}};
  halve(left, half_left);
  halve(right, half_right);
  if (!matcher_->match(half_left, half_right, halved)) return false;
  enlarge(halved, out);
  return true;
}

}  // namespace takt::stereo
