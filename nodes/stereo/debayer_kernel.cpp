// SPDX-License-Identifier: Apache-2.0
#include "nodes/stereo/debayer_kernel.hpp"

#include <algorithm>

#include "nodes/stereo/simd_targets.hpp"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "nodes/stereo/debayer_kernel.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace takt::stereo::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

constexpr hn::ScalableTag<uint8_t> kBytes;
constexpr int kByteLanes = static_cast<int>(hn::MaxLanes(kBytes));
using Bytes = hn::Vec<decltype(kBytes)>;

constexpr uint8_t kBias = 128;

struct Rows {
  const uint8_t *above, *row, *below;
};

/// Pixel `x` whose neighbours stand at `before` and `after`.
HWY_INLINE void debayer_one(const Rows& in, int before, int x, int after, MosaicRow colours, int8_t* out) {
  const bool green = (x % 2 == 0) == colours.green_first;
  const int beside = in.row[before] + in.row[after], over = in.above[x] + in.below[x];
  int own = in.row[x], middle = own, other = 0;  // own: the colour that the row has beside green
  if (green) {
    own = (beside + 1) / 2;
    other = (over + 1) / 2;
  } else {
    middle = (beside + over + 2) / 4;
    other = (in.above[before] + in.above[after] + in.below[before] + in.below[after] + 2) / 4;
  }
  out[0] = static_cast<int8_t>((colours.red ? other : own) - kBias);
  out[1] = static_cast<int8_t>(middle - kBias);
  out[2] = static_cast<int8_t>((colours.red ? own : other) - kBias);
  out[3] = 0;
}

/// (a + b + c + d + 2) / 4 of bytes: the mean of two rounded means is too large by one where both steps rounded up what
/// together was less than a half.
HWY_INLINE Bytes mean_of_four(Bytes a, Bytes b, Bytes c, Bytes d) {
  const Bytes ab = hn::AverageRound(a, b), cd = hn::AverageRound(c, d);
  const Bytes too_large = hn::And(hn::Or(hn::Xor(a, b), hn::Xor(c, d)), hn::Xor(ab, cd));
  return hn::Sub(hn::AverageRound(ab, cd), hn::And(too_large, hn::Set(kBytes, 1)));
}

/// kByteLanes pixels from `x` >= 1 on; one more stands to their right.
HWY_INLINE void debayer_vector(const Rows& in, int x, MosaicRow colours, int8_t* out) {
  const auto load = [x](const uint8_t* row, int dx) HWY_ATTR { return hn::LoadU(kBytes, row + x + dx); };
  const Bytes n = load(in.above, 0), s = load(in.below, 0), w = load(in.row, -1), e = load(in.row, 1);
  const Bytes centre = load(in.row, 0);
  const Bytes corners = mean_of_four(load(in.above, -1), load(in.above, 1), load(in.below, -1), load(in.below, 1));
  const bool even_lanes_green = (x % 2 == 0) == colours.green_first;
  const Bytes even = hn::BitCast(kBytes, hn::Set(hn::ScalableTag<uint16_t>(), 0x00FF));
  const auto green = hn::MaskFromVec(even_lanes_green ? even : hn::Not(even));
  const Bytes bias = hn::Set(kBytes, kBias);
  const Bytes middle = hn::Xor(hn::IfThenElse(green, centre, mean_of_four(n, s, w, e)), bias);
  const Bytes own = hn::Xor(hn::IfThenElse(green, hn::AverageRound(w, e), centre), bias);
  const Bytes other = hn::Xor(hn::IfThenElse(green, hn::AverageRound(n, s), corners), bias);
  auto* bytes = reinterpret_cast<uint8_t*>(out + 4 * ptrdiff_t{x});
  hn::StoreInterleaved4(colours.red ? other : own, middle, colours.red ? own : other, bias, kBytes, bytes);
}

void debayer(const uint8_t* above, const uint8_t* row, const uint8_t* below, int count, MosaicRow colours,
             int8_t* out) {
  const Rows in{above, row, below};
  const int last = count - 1;
  debayer_one(in, 1, 0, 1, colours, out);  // mirrored at the edge
  int x = 1;
  if (last - 1 >= kByteLanes) {
    for (; x + kByteLanes <= last; x += kByteLanes) debayer_vector(in, x, colours, out);
    if (x < last) debayer_vector(in, last - kByteLanes, colours, out);  // some of them once more
    x = last;
  }
  for (; x < last; ++x) debayer_one(in, x - 1, x, x + 1, colours, out + 4 * ptrdiff_t{x});
  debayer_one(in, last - 1, last, last - 1, colours, out + 4 * ptrdiff_t{last});
}

void expand(const uint8_t* bgr, int count, int8_t* out) {
  const Bytes bias = hn::Set(kBytes, kBias);
  const auto step = [&](int i) HWY_ATTR {
    Bytes b, g, r;
    hn::LoadInterleaved3(kBytes, bgr + 3 * ptrdiff_t{i}, b, g, r);
    hn::StoreInterleaved4(hn::Xor(b, bias), hn::Xor(g, bias), hn::Xor(r, bias), bias, kBytes,
                          reinterpret_cast<uint8_t*>(out + 4 * ptrdiff_t{i}));
  };
  if (count >= kByteLanes) {
    for (int i = 0; i + kByteLanes <= count; i += kByteLanes) step(i);
    return step(count - kByteLanes);
  }
  for (int i = 0; i < count; ++i) {
    for (int c = 0; c < 3; ++c) out[4 * i + c] = static_cast<int8_t>(bgr[3 * i + c] - kBias);
    out[4 * i + 3] = 0;
  }
}

void grey(const uint8_t* in, int count, int8_t* out) {
  for (int i = 0; i < count; ++i) out[i] = static_cast<int8_t>(in[i] - kBias);
}

const DebayerKernels& target_debayer_kernels() {
  static const DebayerKernels table{debayer, expand, grey};
  return table;
}

}  // namespace takt::stereo::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace takt::stereo {
HWY_EXPORT(target_debayer_kernels);
const DebayerKernels& debayer_kernels() { return HWY_DYNAMIC_DISPATCH(target_debayer_kernels)(); }
}  // namespace takt::stereo
#endif
