// SPDX-License-Identifier: Apache-2.0
// Cascades slid over all scales of an image, row of windows by row of windows (R-5.2, C-11).
#pragma once
#include <cstdint>
#include <span>
#include <vector>

#include "nodes/traffic_signs/cascade.hpp"
#include "nodes/traffic_signs/grouping.hpp"
#include "nodes/traffic_signs/pyramid.hpp"
#include "nodes/traffic_signs/window_kernel.hpp"

namespace takt::traffic_signs {

/// Equal, window by window and bit for bit, to what cv::CascadeClassifier decides. The scales are shared: an image is
/// scaled and summed once for all cascades. Memory is taken by the constructor; the rest allocates nothing and one
/// thread at a time may use it.
class Search {
 public:
  /// Throws std::invalid_argument if a cascade's window does not fit into the image, or factor is not above 1.
  Search(int width, int height, double factor, std::span<const Cascade> cascades);

  int levels() const { return pyramid_.levels(); }
  /// Those levels at which the cascade's window fits: 0 .. levels(cascade) - 1.
  int levels(size_t cascade) const { return static_cast<int>(placed_[cascade].size()); }
  const Level& level(int index) const { return pyramid_.level(index); }
  int columns(size_t cascade, int level) const;
  int rows(size_t cascade, int level) const;

  /// Before the rows of that level; `grey` as for Pyramid::build().
  void build(int level, ImageView<const uint8_t> grey) { pyramid_.build(level, grey); }
  /// One row of windows: as pass_windows(), `passed` for each column; empty `wanted`: all.
  void row(size_t cascade, int level, int row, std::span<const uint8_t> wanted, std::span<uint8_t> passed) const;
  /// A window in pixels of the image.
  Box box(size_t cascade, int level, int column, int row) const;
  uint8_t stages(size_t cascade) const { return static_cast<uint8_t>(windows_[cascade].stages); }

 private:
  struct Window {
    int width, height;
    size_t stages;
  };
  struct Placed {
    std::vector<PlacedStump> stumps;
    std::vector<PlacedStage> stages;
    Corners inner;
    double inner_area;
  };
  static Placed place(const Cascade& cascade, const Level& level);

  Pyramid pyramid_;
  std::vector<Window> windows_;              ///< cascade by cascade
  std::vector<std::vector<Placed>> placed_;  ///< cascade by cascade, level by level
};

/// All windows of one cascade that pass all stages, as cv::CascadeClassifier::detectMultiScale lists them with
/// minNeighbors 0 and its other defaults: after a window that fails in the first stage the next one is left out.
/// (OpenCV loses the last row of windows at some scales; this does not.) For measurements; allocates. `grey` as for
/// Search::build().
std::vector<Box> detect_multi_scale(Search& search, size_t cascade, ImageView<const uint8_t> grey);

}  // namespace takt::traffic_signs
