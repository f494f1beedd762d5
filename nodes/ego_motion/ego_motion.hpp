// SPDX-License-Identifier: Apache-2.0
// Stereo ego-motion (thesis Sec. 4.3.2 and App. C, corrected): how the camera moved between two rectified pairs.
#pragma once
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "nodes/ego_motion/block_search.hpp"
#include "nodes/ego_motion/corners.hpp"
#include "nodes/ego_motion/estimator.hpp"
#include "nodes/ego_motion/expectation.hpp"
#include "nodes/ego_motion/flow_filter.hpp"
#include "nodes/ego_motion/plane.hpp"
#include "nodes/ego_motion/refine.hpp"
#include "nodes/ego_motion/rigid.hpp"
#include "rt/msg/geometry.hpp"
#include "rt/state_archive.hpp"

namespace takt::ego_motion {

/// Where a corner is searched. pyramid: coarse to fine, with the expected motion as a second guess. The others: within
/// one window, centred where the motion before would bring it (constant_velocity), where the odometry says, or the
/// motion before where that is unknown (odometry), or where it was (none: thesis).
enum class Predict : uint8_t { pyramid, constant_velocity, odometry, none };
/// How matches get their fraction of a pixel. none: whole pixels (thesis).
enum class Subpixel : uint8_t { lucas_kanade, parabola, none };

struct Parameters {
  CornerParameters corners;
  Predict predict = Predict::pyramid;
  Subpixel subpixel = Subpixel::lucas_kanade;
  int n_search = 11;   ///< edge of the matching block, odd, 3..15 px
  double sigma = 0.2;  ///< search window N = sigma d + r_const, px (thesis); not used by `pyramid`
  double r_const = 10;
  bool search_is_radius = false;   ///< window +-N instead of +-floor(N / 2) (A-13)
  bool corner_candidates = false;  ///< test only positions within 1 px of a current corner, if the window holds one
                                   ///< (thesis)
  bool brightness = true;          ///< compare blocks made equally bright; false: as they are (thesis)
  int pyramid_range_px = 64;       ///< coarse search +-range, plus pyramid_share times the disparity
  double pyramid_share = 0.5;
  bool flow_filter = false;  ///< needs dense corners of similar depth; sample consensus replaces it by default
  FlowFilterParameters flow;
  EstimatorParameters estimator;
  ExpectationParameters expectation;
  double confidence_minimum = 0.3;
  int inliers_minimum = 12;

  /// As printed: whole pixels, window around the old position, flow filter, planar unweighted least squares.
  static Parameters faithful();
  /// Empty, or what is wrong ("n_search is 8, must be odd and lie in 3..15").
  std::string error() const;
};

/// Of one step. Frame: x right, y down, z forward. Covariances as in rt/transform/pose_math.hpp.
struct Result {
  UncertainPose camera_in_previous;  ///< maps current camera coordinates into the previous frame
  UncertainPose pose;                ///< accumulated: current camera in the first camera frame
  double confidence = 0;             ///< inliers / matched * exp(-rms / 1 px)
  double rms_px = 0;
  int corners = 0, matched = 0, inliers = 0;
  bool valid = false;     ///< false: the motion was expected (odometry, else constant velocity), not measured
  bool keyframe = false;  ///< first frame: nothing to compare with
  /// What the matches said, refused or not, as camera_in_previous; none if they said nothing.
  std::optional<Rigid> estimate;
};

/// One rectified frame; all views have the configured size.
struct Frame {
  ImageView<const uint8_t> left, right;  ///< 1 channel or 3 (BGR)
  ImageView<const int16_t> disparity;    ///< whole px, negative: unknown
  CameraModel camera;                    ///< rectified: focal_px and baseline_m above 0
  int64_t stamp_ns = 0;
  std::optional<Rigid> odometry =
      std::nullopt;  ///< camera_in_previous as the odometry has it, since the frame of the step before
};

struct TrackedCorner {
  Corner corner;
  float disparity = 0;  ///< px, with its fraction, of the frame that the corner was found in
};

class EgoMotion {
 public:
  EgoMotion() = default;
  /// Takes all memory. Throws std::invalid_argument on parameters out of range or images under 128 x 128 px; before
  /// start only.
  void configure(int width, int height, const Parameters& parameters);
  /// Other parameters from the next step() on; what the frames before left stays. Allocates nothing. Throws
  /// std::invalid_argument on parameters out of range, and for more corners than configure() took memory for.
  void tune(const Parameters& parameters);
  /// Motion since the frame of the call before; the first call (and one after reset()) gives a keyframe.
  Result step(const Frame& frame);
  /// Goes on from a pose that an earlier process had reached at that stamp or later: the next call gives it with valid
  /// = false and a larger covariance, since nobody saw the motion in between, and no keyframe.
  void resume(const UncertainPose& pose, int64_t stamp_ns);
  /// Forgets the previous frame and the pose.
  void reset();
  /// Corners of the last frame, as the next one will look for them.
  std::span<const TrackedCorner> corners() const { return tracked_; }
  /// All matches of the last step, and those that entered the estimate.
  std::span<const Flow> flows() const { return flows_; }
  std::span<const Observation> observations() const { return observations_; }
  /// With the last image, a byte a pixel.
  void remember(StateArchive& archive);

 private:
  struct Located {
    double x = 0, y = 0;
    bool found = false;
  };
  /// Throws std::invalid_argument.
  void take(const Parameters& parameters);
  void find_corners(const Frame& frame);
  double measure_disparity(double x, double y, int first, int last) const;
  double current_disparity(const Frame& frame, double x, double y, double previous) const;
  /// `centre`: motion that says where a corner is searched; none: where it was.
  void match_all(const Frame& frame, const std::optional<Rigid>& centre);
  Located locate(const TrackedCorner& from, const CameraModel& camera, const std::optional<Rigid>& centre) const;
  BlockMatch search_pyramid(const TrackedCorner& from, int guess_x, int guess_y) const;
  BlockMatch search_window(const Patch& patch, const TrackedCorner& from, int centre_x, int centre_y) const;
  Located sharpen(const Patch& patch, const TrackedCorner& from, const BlockMatch& match) const;
  /// Fills in what was measured; false if it is refused.
  bool measure(const Frame& frame, const Rigid& expected, Result& result);
  void filter_flow();
  void mark_candidates();

  Parameters p_;
  int width_ = 0, height_ = 0, half_ = 5;
  Pyramid previous_, current_;
  Level right_;
  CornerDetector detector_;
  FlowFilter flow_filter_;
  MotionEstimator estimator_;
  Expectation expectation_;
  std::vector<TrackedCorner> tracked_, found_;  ///< corners of the previous and the current frame
  std::vector<Observation> observations_;
  std::vector<Flow> flows_;
  std::vector<uint8_t> keep_, candidates_;
  bool has_previous_ = false, resumed_ = false;
  int64_t stamp_ns_ = 0;
  uint64_t steps_ = 0;
  UncertainPose pose_;
};

}  // namespace takt::ego_motion
