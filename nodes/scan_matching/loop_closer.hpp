// SPDX-License-Identifier: Apache-2.0
// Whether the robot is back where it was: scans kept along the way, one of which fits what it sees now.
#pragma once
#include <optional>
#include <span>
#include <vector>

#include "nodes/scan_matching/point_to_line.hpp"
#include "rt/state_archive.hpp"

namespace takt::scan_matching {

struct ClosureParameters {
  size_t anchors = 256;                     ///< scans that are kept; then the oldest makes room
  double anchor_m = 1.0, anchor_rad = 0.5;  ///< a scan that far from the last one kept is kept, and looked for
  double way_m = 10;                        ///< what was driven since an anchor, so that it closes a loop
  double reach_m = 3, reach_rad = 1.0;      ///< how far the robot may believe to be from an anchor that it sees
  double drift_m = 1.5, drift_rad = 0.4;    ///< errors that are looked for, to each side
  double score_min = 0.5;                   ///< least share of a perfect score, 0..1
  double paired_min = 0.6;                  ///< least share of points with one of the anchors beside them, 0..1
  double prior_share_max = 0.05;            ///< of Refined: along a corridor no loop is closed
  double agree_m = 0.2, agree_rad = 0.05;   ///< by how much two looks in a row may differ, or neither is believed
  double least_m = 0.15, least_rad = 0.03;  ///< smaller errors are left alone
};

/// Where the robot turns out to be.
struct Closure {
  PlanarPose believed, actual;  ///< both in the map frame
};

/// The frame of the poses that it is given (`track`) drifts on without a jump; the map frame is the one in which loops
/// are closed, and equal to it until the first one is. Allocates in the constructor only. One thread at a time.
class LoopCloser {
 public:
  /// For scans of at most `beams` points. `map` says how a scan is compared, with the cells made coarser.
  LoopCloser(size_t beams, const MapParameters& map, const ClosureParameters& parameters);
  /// From the next step() on; anchors and drift stay as they were.
  void tune(ClosureParameters parameters) {
    parameters.anchors = p_.anchors;
    parameters.drift_m = p_.drift_m;
    parameters.drift_rad = p_.drift_rad;
    p_ = parameters;
  }

  /// The robot's next pose, and what it sees from there (robot frame). Where a loop was closed, the scans kept since
  /// that place, or since the last loop, have moved by their share of the error, linear in the way.
  std::optional<Closure> step(const PlanarPose& robot_in_track, std::span<const SurfacePoint> points);

  PlanarPose robot_in_map(const PlanarPose& robot_in_track) const { return compose(map_from_track_, robot_in_track); }
  /// Up to 12 kB for each scan that was kept.
  void remember(StateArchive& archive);

 private:
  struct Anchor {
    PlanarPose robot_in_map;
    double way_m = 0;
    std::vector<SurfacePoint> points;
    void remember(StateArchive& archive) { TAKT_STATE(archive, robot_in_map, way_m, points); }
  };
  void keep(const PlanarPose& robot_in_map, std::span<const SurfacePoint> points);
  /// Counted from the oldest.
  Anchor& anchor(size_t i) { return ring_[(first_ + i) % ring_.size()]; }
  std::optional<size_t> known_place(const PlanarPose& robot_in_map);
  std::optional<PlanarPose> match(size_t place, const PlanarPose& robot_in_map, std::span<const SurfacePoint> points);
  void correct(size_t place, const Closure& closure);

  ClosureParameters p_;
  LocalMap map_;
  CorrelativeSearch search_;
  std::vector<Anchor> ring_;
  size_t first_ = 0, count_ = 0;
  PlanarPose map_from_track_;
  std::optional<PlanarPose> last_, kept_;  ///< poses in the track
  std::optional<PlanarPose> found_;        ///< map_from_track as the last look had it
  double way_m_ = 0, right_until_m_ = 0;   ///< driven; when the last loop was closed
};

}  // namespace takt::scan_matching
