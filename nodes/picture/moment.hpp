// SPDX-License-Identifier: Apache-2.0
// What a robot knew at one instant, as a picture: what its camera saw, its map with the objects in it, and the semantic
// network of these objects.
#pragma once
#include <opencv2/core.hpp>
#include <optional>
#include <string>
#include <vector>

#include "nodes/picture/kept.hpp"
#include "rt/msg/ace/detections.hpp"
#include "rt/msg/ace/object_reports.hpp"
#include "rt/transform/planar_pose.hpp"

namespace takt::picture {

/// An object as it was reported, in the map frame.
struct KnownObject {
  ObjectName name;
  double x_m = 0, y_m = 0;
  size_t attributes_end = 0;  ///< its attributes end there in Moment::attributes, and begin where those before it end
};

/// Memory is taken by reserve; keeping takes none.
struct Moment {
  int64_t at_ns = 0;
  std::string said, plan;
  std::vector<KnownObject> objects;
  std::vector<ObjectAttribute> attributes;
  std::optional<PlanarPose> robot;  ///< in the map frame
  KeptImage<uint8_t> left;
  std::vector<Detection> boxes;
  KeptImage<int16_t> cells;
  double cell_m = 0, origin_x_m = 0, origin_y_m = 0;

  void reserve(size_t pixels, size_t most_boxes, size_t most_cells, size_t most_objects, size_t most_characters);
  /// Of object i.
  std::span<const ObjectAttribute> attributes_of(size_t i) const;
};

/// The known part of the grid, and all objects, with the robot as an arrow. `side_px` wide and high.
cv::Mat draw_map(const Moment& moment, int side_px);

/// Types on the left, objects in the middle, what is true of them on the right; lines join what is connected.
cv::Mat draw_network(const Moment& moment, int width_px, int height_px);

/// Camera image (where there is one), map and network side by side.
cv::Mat draw_moment(const Moment& moment);

}  // namespace takt::picture
