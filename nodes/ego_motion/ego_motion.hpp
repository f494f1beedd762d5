// SPDX-License-Identifier: Apache-2.0
// Stereo ego-motion (thesis Sec. 4.3.2 and App. C, corrected): how the camera moved between two rectified pairs.
#pragma once
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "nodes/ego_motion/block_search.hpp"
#include "nodes/ego_motion/corners.hpp"
#include "nodes/ego_motion/flow_filter.hpp"
#include "nodes/ego_motion/motion.hpp"
#include "nodes/ego_motion/plane.hpp"
#include "nodes/ego_motion/refine.hpp"
#include "nodes/ego_motion/rigid.hpp"

namespace takt::ego_motion {

/// Where the search window of a corner is centred. pyramid: coarse to fine, with the last motion as a second guess.
/// constant_velocity: where the last motion would bring it. none: where it was (thesis).
enum class Predict : uint8_t { pyramid, constant_velocity, none };
/// How matches get their fraction of a pixel. none: whole pixels (thesis).
enum class Subpixel : uint8_t { lucas_kanade, parabola, none };

struct Parameters {
  CornerParameters corners;
  Predict predict = Predict::pyramid;
  Subpixel subpixel = Subpixel::lucas_kanade;
  int n_search = 11;   ///< edge of the matching block, odd, 3..15 px
  double sigma = 0.2;  ///< search window N = sigma d + r_const, px (thesis); not used by `pyramid`
  double r_const = 10;
  bool search_is_radius = false;  ///< window +-N instead of +-floor(N / 2)
  bool corner_candidates =
      false;                  ///< test only positions within 1 px of a current corner, if the window holds one (thesis)
  int pyramid_range_px = 64;  ///< coarse search +-range, plus pyramid_share times the disparity
  double pyramid_share = 0.5;
  bool flow_filter = false;  ///< needs dense corners of similar depth; sample consensus replaces it by default
  FlowFilterParameters flow;
  EstimatorParameters estimator;
  double confidence_minimum = 0.3;
  int inliers_minimum = 12;

  /// As printed: whole pixels, window around the old position, flow filter, planar unweighted least squares.
  static Parameters faithful();
  /// Empty, or what is wrong ("n_search is 8, must be odd and lie in 3..15").
  std::string error() const;
};

/// Of one step. Frame: x right, y down, z forward.
struct Result {
  Rigid camera_in_previous;  ///< maps current camera coordinates into the previous frame
  Rigid pose;                ///< accumulated: current camera in the first camera frame
  double confidence = 0;     ///< inliers / matched * exp(-rms / 1 px)
  double rms_px = 0;
  int corners = 0, matched = 0, inliers = 0;
  bool valid = false;     ///< false: the motion was predicted at constant velocity, not measured
  bool keyframe = false;  ///< first frame: nothing to compare with
};

/// One rectified frame; all views have the configured size.
struct Frame {
  ImageView<const uint8_t> left, right;  ///< 1 channel or 3 (BGR)
  ImageView<const int16_t> disparity;    ///< whole px, negative: unknown
  CameraModel camera;                    ///< rectified: focal_px and baseline_m above 0
  int64_t stamp_ns = 0;
};

class EgoMotion {
 public:
  EgoMotion() = default;
  /// Takes all memory. Throws std::invalid_argument on parameters out of range or images under 128 x 128 px; before
  /// start only.
  void configure(int width, int height, const Parameters& parameters);
  /// Motion since the frame of the call before; the first call (and one after reset()) gives a keyframe.
  Result step(const Frame& frame);
  /// Goes on from a pose that an earlier process had reached: the next call gives it with valid = false, since nobody
  /// saw the motion in between, and no keyframe.
  void resume(const Rigid& pose);
  /// Forgets the previous frame and the pose.
  void reset();
  /// Matches of the last step that entered the estimate.
  std::span<const Observation> observations() const { return observations_; }

 private:
  struct Tracked {
    Corner corner;
    float disparity = 0;  ///< sub-pixel, of the frame the corner was found in
  };
  struct Located {
    double x = 0, y = 0;
    bool found = false;
  };
  void find_corners(const Frame& frame);
  double measure_disparity(double x, double y, int first, int last) const;
  double current_disparity(const Frame& frame, double x, double y, double previous) const;
  void match_all(const Frame& frame, const Rigid& predicted);
  Located locate(const Tracked& from, const Optics& optics, const CameraModel& camera, const Rigid& predicted);
  BlockMatch search_pyramid(const Tracked& from, int guess_x, int guess_y) const;
  BlockMatch search_window(const Patch& patch, const Tracked& from, int centre_x, int centre_y) const;
  Located sharpen(const Patch& patch, const Tracked& from, const BlockMatch& match) const;
  void filter_flow();
  void mark_candidates();

  Parameters p_;
  int width_ = 0, height_ = 0, half_ = 5;
  Pyramid previous_, current_;
  Plane right_;
  CornerDetector detector_;
  FlowFilter flow_filter_;
  MotionEstimator estimator_;
  std::vector<Tracked> tracked_, found_;  ///< corners of the previous and the current frame
  std::vector<Observation> observations_;
  std::vector<Flow> flows_;
  std::vector<uint8_t> keep_, candidates_;
  bool has_previous_ = false, has_motion_ = false, resumed_ = false;
  int64_t stamp_ns_ = 0, interval_ns_ = 0;
  uint64_t steps_ = 0;
  Rigid last_T_, pose_;
};

}  // namespace takt::ego_motion
