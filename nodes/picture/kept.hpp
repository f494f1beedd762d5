// SPDX-License-Identifier: Apache-2.0
// What a job copies for the end of the run. Memory is taken once, in setup; keeping allocates nothing.
#pragma once
#include <algorithm>
#include <cstddef>
#include <optional>
#include <span>
#include <vector>

#include "nodes/cloud/cloud.hpp"
#include "nodes/picture/draw.hpp"
#include "rt/msg/ace/detections.hpp"
#include "rt/msg/image_view.hpp"
#include "rt/msg/point.hpp"
#include "rt/msg/point_cloud.hpp"
#include "rt/node.hpp"
#include "rt/state_archive.hpp"

namespace takt::picture {

/// Place in a port of the message with that stamp, if it is latched.
inline std::optional<size_t> with_stamp(const InputPort& port, int64_t stamp_ns) {
  for (size_t i = port.size(); i-- > 0;)
    if (port.stamp_ns(i) == stamp_ns) return i;
  return std::nullopt;
}

/// The newest image whose detections are latched with it, else the newest without any: boxes are never drawn on another
/// image than theirs. `pair` must hold a message.
struct ImageWithBoxes {
  size_t image;
  std::optional<size_t> boxes;
};
inline ImageWithBoxes newest_with_boxes(const InputPort& pair, const InputPort& detections) {
  for (size_t i = pair.size(); i-- > 0;)
    if (const auto boxes = with_stamp(detections, pair.stamp_ns(i))) return {i, boxes};
  return {pair.size() - 1, std::nullopt};
}

/// Into the memory that there is.
inline void keep_boxes(const Detections& detections, std::vector<Detection>& into) {
  const auto found = detections.boxes.items();
  into.assign(found.begin(), found.begin() + static_cast<ptrdiff_t>(std::min(found.size(), into.capacity())));
}

/// The last array of an image, a map or a grid. One thread at a time.
template <class T>
class KeptImage {
 public:
  void reserve(size_t elements) { items_.reserve(elements); }

  /// Copies an array that is as long as its sizes say and fits the memory taken; else the earlier one stays.
  bool keep(std::span<const T> items, int width, int height, int channels = 1) {
    if (width <= 0 || height <= 0 || channels <= 0) return false;
    const size_t wanted = static_cast<size_t>(width) * static_cast<size_t>(height) * static_cast<size_t>(channels);
    if (items.size() != wanted || items.size() > items_.capacity()) return false;
    items_.assign(items.begin(), items.end());
    width_ = width, height_ = height, channels_ = channels;
    return true;
  }

  bool empty() const { return items_.empty(); }
  ImageView<const T> view() const { return {items_.data(), width_, height_, channels_}; }

 private:
  std::vector<T> items_;
  int width_ = 0, height_ = 0, channels_ = 1;
};

/// The last cloud.
class KeptCloud {
 public:
  void reserve(size_t points) { points_.reserve(points), colours_.reserve(points); }

  /// One with a colour for each point, that fits the memory taken; else the earlier one stays.
  void keep(const PointCloud& cloud) {
    if (cloud.points.size > points_.capacity() || cloud.colours.size != cloud.points.size) return;
    points_.assign(cloud.points.items().begin(), cloud.points.items().end());
    colours_.assign(cloud.colours.items().begin(), cloud.colours.items().end());
  }

  cloud::CloudView view() const { return {points_, colours_}; }

 private:
  std::vector<Point> points_;
  std::vector<Colour> colours_;
};

/// The whole of a path: when the memory is full every second point is dropped, and every second one kept from then on.
class KeptTrack {
 public:
  void reserve(size_t points) { points_.reserve(points); }

  void add(const TrackPoint& point) {
    if (skip_-- > 0) return;
    skip_ = stride_ - 1;
    if (points_.size() == points_.capacity()) {
      for (size_t i = 0; 2 * i < points_.size(); ++i) points_[i] = points_[2 * i];
      points_.resize((points_.size() + 1) / 2);
      stride_ *= 2;
    }
    if (points_.size() < points_.capacity()) points_.push_back(point);
  }

  std::span<const TrackPoint> points() const { return points_; }
  void remember(StateArchive& archive) { TAKT_STATE(archive, points_, stride_, skip_); }

 private:
  std::vector<TrackPoint> points_;
  int stride_ = 1, skip_ = 0;
};

}  // namespace takt::picture
