// SPDX-License-Identifier: Apache-2.0
// Bodies in a cloud: candidates, a fit for each, what is no body left out. Floor frame: z up, floor z = 0.
#pragma once
#include <span>
#include <vector>

#include "nodes/body_pose/fitter.hpp"
#include "nodes/body_pose/segmentation.hpp"
#include "rt/msg/ace/body_poses.hpp"
#include "rt/msg/geometry.hpp"
#include "rt/msg/point.hpp"

namespace takt::body_pose {

struct DetectorParameters {
  SegmentationParameters segmentation;
  FitParameters fit;
  double error_max = 2.5;  ///< a fit with a larger error is no body
  int links_min = 6;       ///< nor is one with fewer links
};

struct DetectedBody {
  Fit fit;
  float top_m = 0;
  bool valid = false;  ///< is_valid(): Eq. 3.11
  size_t candidate = 0;
};

class BodyDetector {
 public:
  /// Takes the memory for clouds of up to `capacity` points; run() allocates nothing.
  BodyDetector(const Skeleton& skeleton, const DetectorParameters& parameters, size_t capacity)
      : p_(parameters),
        segmentation_(capacity, parameters.segmentation),
        fitter_(skeleton, parameters.fit, static_cast<size_t>(parameters.segmentation.points_max)) {
    bodies_.reserve(static_cast<size_t>(parameters.segmentation.candidates));
  }

  /// From the next run() on, but for what Segmentation::tune() leaves as it was.
  void tune(const DetectorParameters& parameters) {
    segmentation_.tune(parameters.segmentation);
    fitter_.tune(parameters.fit);
    p_ = parameters;
    p_.segmentation = segmentation_.parameters();
  }

  /// Bodies, nearest first, as seen from `eye`. Asks may_go_on() before each rotation of each candidate; when that says
  /// no, candidates that were not reached are left out.
  template <class MayGoOn>
  std::span<const DetectedBody> run(std::span<const Point> points, const Eigen::Vector3f& eye,
                                    const MayGoOn& may_go_on) {
    bodies_.clear();
    eye_ = eye;
    candidates_ = segmentation_.run(points);
    double tried = 0;
    for (size_t i = 0; i < candidates_.size() && (i == 0 || may_go_on()); ++i) {
      const Fit fit = fitter_.fit(cluster(i), may_go_on);
      tried += fit.searched;
      keep(fit, i);
    }
    searched_ = candidates_.empty() ? 1 : tried / static_cast<double>(candidates_.size());
    return bodies_;
  }

  std::span<const Candidate> candidates() const { return candidates_; }
  double searched() const { return searched_; }  ///< share of all rotations of all candidates of the last run
  /// Candidate i as the fit sees it.
  Cluster cluster(size_t i) const;
  const Segmentation& segmentation() const { return segmentation_; }
  const Skeleton& skeleton() const { return fitter_.skeleton(); }

 private:
  void keep(const Fit& fit, size_t candidate);

  DetectorParameters p_;
  Segmentation segmentation_;
  Fitter fitter_;
  Eigen::Vector3f eye_ = Eigen::Vector3f::Zero();
  std::span<const Candidate> candidates_;
  std::vector<DetectedBody> bodies_;
  double searched_ = 1;
};

/// Where a sensor is that is mounted there: what bodies are seen from.
inline Eigen::Vector3f eye_of(const Transform& mount) {
  return Eigen::Vector3d(mount.x, mount.y, mount.z).cast<float>();
}
/// Fills one body of a message.
Body to_message(const Skeleton& skeleton, const DetectedBody& body);
/// Unit direction of a pointer of the skeleton; 0 0 0 if one of its joints is missing.
Eigen::Vector3f pointing_direction(const Fit& fit, const Pointer& pointer);

}  // namespace takt::body_pose
