// SPDX-License-Identifier: Apache-2.0
// From a coloured cloud to objects with attributes, relations and classes: everything of this room in its order.
#pragma once
#include <optional>
#include <span>
#include <vector>

#include "nodes/mapping_3d/pose.hpp"
#include "nodes/object_3d/attributes.hpp"
#include "nodes/object_3d/classifier.hpp"
#include "nodes/object_3d/pixel_grid.hpp"
#include "nodes/object_3d/seeds.hpp"
#include "nodes/object_3d/segmenter.hpp"
#include "nodes/object_3d/support.hpp"
#include "rt/msg/ace/detections.hpp"
#include "rt/msg/geometry.hpp"
#include "rt/msg/point.hpp"

namespace takt::object_3d {

/// Where regions begin.
enum class SeedSource : uint8_t {
  standing,  ///< each point that no object has yet, from the highest on
  colour,    ///< components of a colour
  boxes      ///< boxes of a detector
};

struct FinderParameters {
  SeedSource seeds = SeedSource::standing;
  ColourModel colour;
  ComponentLimits components;
  double range_m = 2.0;       ///< farther from the camera nothing is looked for
  bool needs_support = true;  ///< objects stand on a plane, whose points are left out; else the whole cloud is grown in
  SupportParameters support;
  double clearance_m = 0.01;  ///< a point of an object is more than this above the support
  double gap_m = 0.05;        ///< an object whose lowest point is less than this above something stands on it
  double beside_m = 0.10;     ///< gap between the outlines of two objects side by side
  bool smooth = true;         ///< SurfaceSmoother, where the cloud is a camera's
  SegmentParameters segment;
};

inline constexpr int kOnSupport = -1, kOnNothing = -2, kBesideNothing = -1;

/// A coloured cloud in the frame of its sensor, as PointCloud carries it.
struct SensorCloud {
  std::span<const Point> points;
  std::span<const Colour> colours;  ///< as many, or none
  CameraModel camera;
  int step_px = 0;
  Transform sensor_in_robot;
};

struct FoundObject {
  Description what;
  Answer answer;
  int on = kOnNothing;          ///< index of the object that it stands on, or kOnSupport, kOnNothing
  int beside = kBesideNothing;  ///< index of the nearest object beside it that stands on the same, or kBesideNothing
  uint32_t segment = 0;
};

class ObjectFinder {
 public:
  /// For clouds of up to `capacity` points. `classifier` may be null: then all are unknown; it is used, not owned.
  ObjectFinder(size_t capacity, size_t most_objects, const FinderParameters& parameters, Classifier* classifier);
  /// From the next run() on.
  void tune(const FinderParameters& parameters) { parameters_ = parameters; }

  /// `boxes` are read with SeedSource::boxes alone. `may_go_on()` is asked about
  /// every tenth of a millisecond of growing and before each description; after a no the objects complete so far are
  /// the result. Objects stand in the order of their seeds, the highest first. The result depends on cloud and answers
  /// alone.
  template <class MayGoOn>
  std::span<const FoundObject> run(const SensorCloud& cloud, std::span<const Detection> boxes, MayGoOn may_go_on) {
    begin(cloud, boxes);
    bool more = true;
    while (may_go_on() && (more = segmenter_.advance())) describe_new();
    searched_ = more ? segmenter_.done() : 1;
    relate();
    return objects();
  }
  std::span<const FoundObject> objects() const { return std::span(objects_).first(count_); }
  /// Share of the seeds that the last run() came to, 0..1.
  double searched() const { return searched_; }
  const std::optional<Plane>& support() const { return support_; }
  /// Points of the cloud that belong to an object, as indices into it.
  std::span<const uint32_t> points_of(const FoundObject& object);

 private:
  void begin(const SensorCloud& cloud, std::span<const Detection> boxes);
  void take_points(const SensorCloud& cloud);
  size_t find_seeds(const SensorCloud& cloud, std::span<const Detection> boxes);
  void describe_new();
  void describe(const Segment& segment);
  void relate();
  Point in_robot(const Point& p) const;

  FinderParameters parameters_;
  Classifier* classifier_;
  PixelGrid grid_;
  SurfaceSmoother smoother_;
  ColourSeeds colour_seeds_;
  Segmenter segmenter_;
  Describer describer_;
  mapping_3d::Affine mount_;
  double step_per_focal_ = 0;  ///< distance of neighbouring points across the line of sight, by their depth
  std::optional<Plane> support_;
  size_t points_ = 0;  ///< that regions are grown in: those within range, above the support
  std::vector<Point> camera_points_, robot_points_;
  std::vector<Colour> colours_;
  std::vector<uint32_t> source_;  ///< of those points, in the cloud
  std::vector<uint32_t> seeds_, scratch_;
  std::vector<Point> object_points_;
  std::vector<Colour> object_colours_;
  std::vector<FoundObject> objects_;
  size_t count_ = 0, described_ = 0;  ///< objects, and segments that were looked at for them
  double searched_ = 0;
};

}  // namespace takt::object_3d
