// SPDX-License-Identifier: Apache-2.0
// Point clouds as plain data: what the operations of this room read and fill.
#pragma once
#include <array>
#include <cmath>
#include <span>
#include <string>
#include <vector>

#include "rt/msg/point.hpp"

namespace takt::cloud {

/// Points with a coordinate that is not finite or beyond this are never kept and never counted.
constexpr float kFarthest_m = 1e6f;

inline bool usable(const Point& p, float farthest_m = kFarthest_m) {
  // Written so that NaN fails.
  return std::abs(p.x) <= farthest_m && std::abs(p.y) <= farthest_m && std::abs(p.z) <= farthest_m;
}

/// A cloud to read. Without colours where there is not one for each point.
struct CloudView {
  std::span<const Point> points;
  std::span<const Colour> colours;
  std::array<double, 3> origin{};  ///< m, what is to be added to each point
  bool coloured() const { return colours.size() == points.size(); }
};

/// A cloud with memory of its own, for tools; a job fills a CloudBuffer.
struct Cloud {
  std::vector<Point> points;
  std::vector<Colour> colours;
  /// m, what is to be added to each point: of a file whose coordinates (UTM, say) a float would round to decimetres.
  std::array<double, 3> origin{};
  std::vector<std::string> left_out{};  ///< what was not taken from its file, a sentence each
  CloudView view() const { return {points, colours, origin}; }
};

/// A cloud to fill, in memory of a fixed size. Points that no longer fit are counted, not written.
class CloudBuffer {
 public:
  /// `colours` has the size of `points`, or is empty: then none are kept.
  CloudBuffer(std::span<Point> points, std::span<Colour> colours) : points_(points), colours_(colours) {}

  void push(const Point& point, const Colour& colour) {
    if (size_ == points_.size()) {
      ++lost_;
      return;
    }
    points_[size_] = point;
    if (!colours_.empty()) colours_[size_] = colour;
    ++size_;
  }
  /// Drops the points, keeps the count of those lost.
  void clear() { size_ = 0; }
  /// Points beyond the first `size` are dropped. size <= this->size().
  void shorten(size_t size) { size_ = size; }

  size_t size() const { return size_; }
  size_t capacity() const { return points_.size(); }
  size_t lost() const { return lost_; }
  std::span<Point> points() { return points_.first(size_); }
  std::span<Colour> colours() { return colours_.empty() ? colours_ : colours_.first(size_); }
  CloudView view() const { return {points_.first(size_), colours_.empty() ? colours_ : colours_.first(size_), {}}; }

 private:
  std::span<Point> points_;
  std::span<Colour> colours_;
  size_t size_ = 0, lost_ = 0;
};

}  // namespace takt::cloud
