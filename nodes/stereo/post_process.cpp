// SPDX-License-Identifier: Apache-2.0
#include "nodes/stereo/post_process.hpp"

namespace takt::stereo {
namespace {

struct Three {
  int16_t low, middle, high;
};

Three sorted(int16_t a, int16_t b, int16_t c) {
  const int16_t low = a < b ? a : b, high = a < b ? b : a;
  const int16_t upper = high < c ? c : high, rest = high < c ? high : c;
  return {low < rest ? low : rest, low < rest ? rest : low, upper};
}

}  // namespace

// Of three sorted columns: the median of (the largest low, the median of the middles, the smallest high).
void median_3x3(ImageView<int16_t> in, ImageView<int16_t> out) {
  const int w = in.width;
  for (int y = 0; y < in.height; ++y) {
    int16_t* row = in.row(y);
    row[-1] = row[0];
    row[w] = row[w - 1];
  }
  for (int y = 0; y < in.height; ++y) {
    const int16_t *above = in.row(std::max(0, y - 1)), *here = in.row(y),
                  *below = in.row(std::min(in.height - 1, y + 1));
    int16_t* to = out.row(y);
    for (int x = 0; x < w; ++x) {
      const Three l = sorted(above[x - 1], here[x - 1], below[x - 1]), m = sorted(above[x], here[x], below[x]),
                  r = sorted(above[x + 1], here[x + 1], below[x + 1]);
      to[x] = sorted(sorted(l.low, m.low, r.low).high, sorted(l.middle, m.middle, r.middle).middle,
                     sorted(l.high, m.high, r.high).low)
                  .middle;
    }
  }
}

}  // namespace takt::stereo
