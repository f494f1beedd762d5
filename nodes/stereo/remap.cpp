// SPDX-License-Identifier: Apache-2.0
#include "nodes/stereo/remap.hpp"

#include <algorithm>
#include <cstring>

#include "nodes/stereo/debayer_kernel.hpp"
#include "nodes/stereo/remap_kernel.hpp"

namespace takt::stereo {
namespace {

constexpr int kNothing = 2;  // pixels at the end of each row of the window: what pixels without a source are made of
constexpr int8_t kBlack = -128;

int round_up(int value, int step) { return (value + step - 1) / step * step; }

/// Source rows that each row needs, from the first to one beyond the last.
struct Reach {
  int first, end;
};

std::vector<Reach> reach_of_rows(int width, int height, std::span<const RemapSource> sources) {
  std::vector<Reach> reach(static_cast<size_t>(height), Reach{height, 0});
  for (size_t i = 0; i < sources.size(); ++i) {
    if (sources[i].x < 0) continue;
    Reach& row = reach[i / static_cast<size_t>(width)];
    row.first = std::min<int>(row.first, sources[i].y);
    row.end = std::max<int>(row.end, sources[i].y + 2);
  }
  return reach;
}

/// Rows of one image on their way through the window.
class Passage {
 public:
  Passage(ImageView<const uint8_t> in, BayerPattern pattern, int8_t* window, int rows, ptrdiff_t stride)
      : in_(in), pattern_(pattern), window_(window), rows_(rows), stride_(stride) {}

  /// Lets rows pass until `count` of them have.
  void advance(int count) {
    for (; passed_ < count; ++passed_) {
      const int slot = passed_ % rows_;
      make(passed_, window_ + slot * stride_);
      // The first slot is once more behind the last: there, too, the row below comes one stride later.
      if (slot == 0) std::memcpy(window_ + rows_ * stride_, window_, static_cast<size_t>(stride_));
    }
  }

 private:
  void make(int y, int8_t* out) const {
    const uint8_t* row = in_.row(y);
    if (pattern_ != BayerPattern::none) {
      const int above = y > 0 ? y - 1 : 1, below = y + 1 < in_.height ? y + 1 : y - 1;
      kernels_.debayer(in_.row(above), row, in_.row(below), in_.width, mosaic_row(pattern_, y), out);
    } else if (in_.channels == 3) {
      kernels_.expand(row, in_.width, out);
    } else {
      kernels_.grey(row, in_.width, out);
    }
  }

  const DebayerKernels& kernels_ = debayer_kernels();
  ImageView<const uint8_t> in_;
  BayerPattern pattern_;
  int8_t* window_;
  int rows_;
  ptrdiff_t stride_;
  int passed_ = 0;
};

}  // namespace

Remap::Remap(int width, int height, std::span<const RemapSource> sources)
    : width_(width),
      height_(height),
      row_pixels_(width + kNothing),
      padded_width_(round_up(width, kRemapGroup)),
      needed_rows_(static_cast<size_t>(height)) {
  const std::vector<Reach> reach = reach_of_rows(width, height, sources);
  int needed = 0;
  for (size_t y = 0; y < reach.size(); ++y) needed_rows_[y] = needed = std::max(needed, reach[y].end);
  int oldest = height;
  for (size_t y = reach.size(); y-- > 0;) {
    oldest = std::min(oldest, reach[y].first);
    window_rows_ = std::max(window_rows_, needed_rows_[y] - oldest);
  }
  window_rows_ = std::max(window_rows_, 1);  // a table without any source
  const auto pixels = static_cast<size_t>(padded_width_) * static_cast<size_t>(height);
  offsets_.assign(pixels, static_cast<uint32_t>(width));
  fractions_.assign(pixels, 0);
  for (int y = 0; y < height; ++y)
    for (int x = 0; x < width; ++x) {
      const RemapSource& source = sources[static_cast<size_t>(y) * static_cast<size_t>(width) + static_cast<size_t>(x)];
      if (source.x < 0) continue;
      const size_t i = static_cast<size_t>(y) * static_cast<size_t>(padded_width_) + static_cast<size_t>(x);
      offsets_[i] = static_cast<uint32_t>(source.y % window_rows_ * row_pixels_ + source.x);
      fractions_[i] = static_cast<uint16_t>(source.fraction_x | source.fraction_y << 8);
    }
}

size_t Remap::window_bytes() const {
  return 4 * static_cast<size_t>(row_pixels_) * (static_cast<size_t>(window_rows_) + 1);
}

void Remap::run(ImageView<const uint8_t> in, BayerPattern pattern, std::span<int8_t> window,
                ImageView<uint8_t> out) const {
  const int bytes = out.channels == 3 ? 4 : 1;
  const ptrdiff_t stride = ptrdiff_t{row_pixels_} * bytes;
  for (int row = 0; row <= window_rows_; ++row)
    std::fill_n(window.data() + row * stride + ptrdiff_t{width_} * bytes, kNothing * bytes, kBlack);
  const RemapKernels& kernels = remap_kernels();
  Passage passage(in, pattern, window.data(), window_rows_, stride);
  for (int y = 0; y < height_; ++y) {
    passage.advance(needed_rows_[static_cast<size_t>(y)]);
    const ptrdiff_t first = ptrdiff_t{y} * padded_width_;
    const RemapRow row{window.data(), stride, offsets_.data() + first, fractions_.data() + first, width_};
    if (bytes == 4) kernels.bgr(row, out.row(y));
    else kernels.grey(row, out.row(y));
  }
}

}  // namespace takt::stereo
