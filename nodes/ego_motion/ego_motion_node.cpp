// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <iterator>
#include <optional>
#include <stdexcept>
#include <string>

#include "nodes/ego_motion/ego_motion.hpp"
#include "nodes/mapping_3d/pose.hpp"
#include "rt/msg/disparity.hpp"
#include "rt/msg/geometry.hpp"
#include "rt/msg/image.hpp"
#include "rt/msg/motion.hpp"
#include "rt/msg/odometry.hpp"
#include "rt/msg/pose.hpp"
#include "rt/node.hpp"
#include "rt/transform/transform_buffer.hpp"

namespace takt {
namespace {

using namespace ego_motion;

class EgoMotionNode final : public Node {
 public:
  void setup(Setup&) override {
    const Capacity& images = pair_.capacity();
    const Capacity& map = disparity_.capacity();
    if (images.width != map.width || images.height != map.height)
      throw SetupError("pair is " + size(images) + " px but disparity is " + size(map) +
                       " px: connect the rectified pair that the disparity was computed from");
    width_ = static_cast<int>(images.width);
    height_ = static_cast<int>(images.height);
    try {
      ego_.configure(width_, height_, parameters());
    } catch (const std::invalid_argument& error) {
      throw SetupError(error.what());
    }
    changed();
  }

  void changed() override {
    ego_.tune(parameters());
    mount_ = mapping_3d::camera_mount(camera_x_, camera_y_, camera_height_, 0, camera_tilt_);
  }

  void start(int64_t) override {
    const Motion* motion = motion_.handed_over();
    const Pose* pose = pose_.handed_over();
    if (!motion || !pose) return;
    UncertainPose known{pose->transform, {}};
    std::copy(std::begin(pose->covariance), std::end(pose->covariance), known.covariance.begin());
    ego_.resume(known, motion->from_stamp_ns);
  }

  void run(Job& job) override {
    const StereoPair* pair = pair_.newest();
    const DisparityMap* map = disparity_.newest();
    if (!pair || !map || pair_.stamp_ns() != disparity_.stamp_ns()) return job.no_result();
    const int64_t stamp = pair_.stamp_ns();
    if (has_stamp_ && stamp <= last_stamp_ns_)
      return job.no_result();  // nothing new: a second answer would be zero motion
    const CameraModel& camera = pair->camera;
    if (pair->width != width_ || pair->height != height_ || map->width != width_ || map->height != height_ ||
        !(camera.focal_px > 0) || !(camera.baseline_m > 0))
      return job.no_result();
    for (size_t i = 0; i < odometry_.size(); ++i)
      robot_.insert(odometry_.stamp_ns(i), {mapping_3d::robot_in_odometry(odometry_[i]), {}});
    const UncertainPose mount{mount_of(*pair), {}};
    Frame frame{pair->left_view(), pair->right_view(), map->view(), camera, stamp};
    if (has_stamp_) frame.odometry = odometry_since_last(stamp, mount);
    const Result r = ego_.step(frame);
    const int64_t from = has_stamp_ ? last_stamp_ns_ : stamp;
    last_stamp_ns_ = stamp;
    has_stamp_ = true;
    give(r.pose, pose_, stamp);
    // M_robot = rTc T^-1 rTc^-1 (erratum E-25).
    give(compose(compose(mount, r.camera_in_previous), inverse(mount)), robot_motion_, stamp);
    Motion* motion = motion_.loan();
    if (!motion) return job.no_result();
    motion->from_stamp_ns = from;
    motion->camera_in_previous = r.camera_in_previous.transform;
    motion->pose = r.pose.transform;
    motion->confidence = r.confidence;
    motion->rms_px = r.rms_px;
    motion->corners = r.corners;
    motion->matched = r.matched;
    motion->inliers = r.inliers;
    motion->valid = r.valid;
    motion->keyframe = r.keyframe;
    motion_.send(stamp);
  }

  void remember(StateArchive& archive) override { TAKT_STATE(archive, ego_, robot_, last_stamp_ns_, has_stamp_); }

 private:
  static std::string size(const Capacity& c) { return std::to_string(c.width) + " x " + std::to_string(c.height); }

  /// Not with this job if no memory is to be had.
  static void give(const UncertainPose& from, Output<Pose>& port, int64_t stamp_ns) {
    Pose* to = port.loan();
    if (!to) return;
    to->transform = from.transform;
    std::copy(from.covariance.begin(), from.covariance.end(), to->covariance);
    port.send(stamp_ns);
  }

  const Transform& mount_of(const StereoPair& pair) const {
    const Transform& t = pair.sensor_in_robot;
    const bool said = t.x != 0 || t.y != 0 || t.z != 0 || t.qx != 0 || t.qy != 0 || t.qz != 0;
    return said ? t : mount_;
  }

  /// camera_in_previous since the last pair as the odometry has it: rTc^-1 M_robot rTc. None where it does not know the
  /// robot's pose at both.
  std::optional<Rigid> odometry_since_last(int64_t stamp_ns, const UncertainPose& mount) const {
    const auto before = robot_.at(last_stamp_ns_), now = robot_.at(stamp_ns);
    if (!before || !now) return std::nullopt;
    const Rigid camera = from_transform(mount.transform);
    const Rigid moved = from_transform(before->transform).inverse() * from_transform(now->transform);
    return camera.inverse() * moved * camera;
  }

  Parameters parameters() const {
    if (!odometry_.connected() && predict_() == static_cast<size_t>(Predict::odometry))
      throw SetupError(
          "predict is odometry, but the input odometry is not connected: connect it, or choose pyramid, "
          "constant_velocity or none");
    Parameters p;
    p.corners = {corners_, quality_, distance_, 8, tile_};
    p.predict = static_cast<Predict>(predict_());
    p.subpixel = static_cast<Subpixel>(subpixel_());
    p.n_search = n_search_;
    p.sigma = sigma_;
    p.r_const = r_const_;
    p.search_is_radius = search_is_radius_;
    p.corner_candidates = corner_candidates_;
    p.brightness = brightness_;
    p.pyramid_range_px = pyramid_range_;
    p.flow_filter = flow_filter_;
    p.flow = {r_min_, t_flow_, n_flow_};
    p.estimator.model = model_() == 0 ? Model::six_dof : Model::planar;
    p.estimator.form = form_() == 0 ? Form::multiplied : Form::division;
    p.estimator.robust = robust_;
    p.estimator.inlier_px = inlier_;
    p.estimator.iterations = iterations_;
    p.estimator.shared_px = shared_error_;
    p.expectation = {acceleration_, turn_acceleration_, odometry_error_};
    p.confidence_minimum = conf_min_;
    p.inliers_minimum = inliers_min_;
    return p;
  }

  Input<StereoPair> pair_{this, "pair", "rectified stereo pair; join it with disparity"};
  Input<DisparityMap> disparity_{this, "disparity", "disparity of that pair"};
  Input<Odometry> odometry_{this, "odometry", "robot poses around the pair's stamp: what motion to expect; depth 16",
                            Need::optional};
  Output<Motion> motion_{this, "motion", "motion since the previous frame and accumulated pose, camera frame"};
  Output<Pose> pose_{this, "pose", "the accumulated pose, camera in the first camera frame, with its covariance"};
  Output<Pose> robot_motion_{this, "robot_motion", "robot in its frame of the previous pair, with its covariance"};
  Param<int> corners_{this, "corners", 800, {12, 20000}, "", "most corners per image; in a run not above its start"};
  Param<double> quality_{this,        "quality", 0.005,
                         {0.0, 0.99}, "1",       "least corner response, share of the image's largest"};
  Param<int> distance_{this, "distance", 5, {1, 100}, "px", "least distance of two corners"};
  Param<int> tile_{this, "tile", 64, {8, 16384}, "px", "edge of the tiles that corners are spread over"};
  Choice predict_{this,
                  "predict",
                  "pyramid",
                  {"pyramid", "constant_velocity", "odometry", "none"},
                  "where corners are searched; none: thesis"};
  Choice subpixel_{
      this, "subpixel", "lucas_kanade", {"lucas_kanade", "parabola", "none"}, "fraction of a pixel; none: thesis"};
  Param<int> n_search_{this, "n_search", 11, {3, 15}, "px", "edge of the matching block, odd"};
  Param<double> sigma_{this,        "sigma", 0.2,
                       {0.0, 10.0}, "1",     "growth of the search window with the disparity; not for pyramid"};
  Param<double> r_const_{this, "r_const", 10.0, {0.0, 500.0}, "px", "search window at disparity 0; not for pyramid"};
  Param<bool> search_is_radius_{this, "search_is_radius", false, "", "search window +-N instead of +-N/2"};
  Param<bool> corner_candidates_{this, "corner_candidates", false, "",
                                 "test only positions within 1 px of a current corner"};
  Param<bool> brightness_{this, "brightness", true, "", "compare blocks made equally bright; thesis: false"};
  Param<int> pyramid_range_{
      this, "pyramid_range", 64, {8, 512}, "px", "reach of the coarse search, plus half the disparity"};
  Param<bool> flow_filter_{this, "flow_filter", false, "",
                           "drop corners that disagree with their neighbours; thesis: true"};
  Param<double> r_min_{this, "r_min", 20.0, {1.0, 1000.0}, "px", "radius of the neighbourhood"};
  Param<double> t_flow_{this,         "t_flow", 2.0,
                        {0.1, 100.0}, "px",     "largest distance from the neighbourhood's median flow"};
  Param<int> n_flow_{this, "n_flow", 3, {1, 1000}, "", "fewest corners of a neighbourhood, the corner included"};
  Choice model_{this, "model", "six_dof", {"six_dof", "planar"}, "planar: turn about y, shift in x and z (thesis)"};
  Choice form_{this, "form", "multiplied", {"multiplied", "division"}, "planar, not robust: rows in px, or as printed"};
  Param<bool> robust_{this, "robust", true, "", "sample consensus and weights; false: plain least squares (thesis)"};
  Param<double> inlier_{this, "inlier", 1.0, {0.05, 20.0}, "px", "largest residual of an inlier"};
  Param<int> iterations_{this, "iterations", 200, {1, 10000}, "", "most random samples"};
  Param<double> conf_min_{this,       "conf_min", 0.3,
                          {0.0, 1.0}, "1",        "below it the motion is the expected one and valid = 0"};
  Param<int> inliers_min_{this, "inliers_min", 12, {3, 20000}, "", "fewest inliers of a valid motion"};
  Param<double> acceleration_{this,          "acceleration", 1.0,
                              {0.01, 100.0}, "m/s^2",        "standard deviation, where the motion was not measured"};
  Param<double> turn_acceleration_{this,      "turn_acceleration",
                                   2.0,       {0.01, 100.0},
                                   "rad/s^2", "standard deviation, where the motion was not measured"};
  Param<double> odometry_error_{
      this, "odometry_error", 0.1, {0.001, 1.0}, "1", "standard deviation, share of what the odometry says"};
  Param<double> shared_error_{
      this, "shared_error", 0.05, {0.0, 10.0}, "px", "error that all corners of a frame share; enters the covariance"};
  Param<double> camera_x_{this, "camera_x",
                          0.0,  {-5.0, 5.0},
                          "m",  "camera to the right of the robot's centre, where the pair does not say"};
  Param<double> camera_y_{this,        "camera_y", 0.0,
                          {-5.0, 5.0}, "m",        "camera before the robot's centre, where the pair does not say"};
  Param<double> camera_height_{
      this, "camera_height", 1.6, {0.0, 5.0}, "m", "camera above the floor, where the pair does not say"};
  Param<double> camera_tilt_{this,        "camera_tilt", 0.0,
                             {-1.6, 1.6}, "rad",         "camera tilt, up positive, where the pair does not say"};

  static constexpr int64_t kLongestGapNs = 500'000'000;  ///< between two poses of the odometry

  EgoMotion ego_;
  Transform mount_;
  PoseTrack robot_{InputPort::kMaxDepth, kLongestGapNs};  ///< in the odometry frame
  int width_ = 0, height_ = 0;
  int64_t last_stamp_ns_ = 0;
  bool has_stamp_ = false;
};

}  // namespace

void register_ego_motion(NodeTypes& types) {
  types.add<EgoMotionNode>("ego_motion", Layer::perception,
                           "Camera motion from a rectified stereo pair and its disparity");
}

}  // namespace takt
