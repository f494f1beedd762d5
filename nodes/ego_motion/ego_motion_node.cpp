// SPDX-License-Identifier: Apache-2.0
#include <stdexcept>
#include <string>

#include "nodes/ego_motion/ego_motion.hpp"
#include "rt/node.hpp"

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
  }

  void start(int64_t) override {
    if (const Motion* known = motion_.handed_over()) ego_.resume(from_transform(known->pose));
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
    const Result r = ego_.step({pair->left_view(), pair->right_view(), map->view(), camera, stamp});
    const int64_t from = has_stamp_ ? last_stamp_ns_ : stamp;
    last_stamp_ns_ = stamp;
    has_stamp_ = true;
    Motion* motion = motion_.loan();
    if (!motion) return job.no_result();
    motion->from_stamp_ns = from;
    motion->camera_in_previous = to_transform(r.camera_in_previous);
    motion->pose = to_transform(r.pose);
    motion->confidence = r.confidence;
    motion->rms_px = r.rms_px;
    motion->corners = r.corners;
    motion->matched = r.matched;
    motion->inliers = r.inliers;
    motion->valid = r.valid;
    motion->keyframe = r.keyframe;
    motion_.send(stamp);
  }

 private:
  static std::string size(const Capacity& c) { return std::to_string(c.width) + " x " + std::to_string(c.height); }

  Parameters parameters() const {
    Parameters p;
    p.corners = {corners_, quality_, distance_, 8, tile_};
    constexpr Predict kPredict[] = {Predict::pyramid, Predict::constant_velocity, Predict::none};
    constexpr Subpixel kSubpixel[] = {Subpixel::lucas_kanade, Subpixel::parabola, Subpixel::none};
    p.predict = kPredict[predict_()];
    p.subpixel = kSubpixel[subpixel_()];
    p.n_search = n_search_;
    p.sigma = sigma_;
    p.r_const = r_const_;
    p.search_is_radius = search_is_radius_;
    p.corner_candidates = corner_candidates_;
    p.pyramid_range_px = pyramid_range_;
    p.flow_filter = flow_filter_;
    p.flow = {r_min_, t_flow_, n_flow_};
    p.estimator.model = model_() == 0 ? Model::six_dof : Model::planar;
    p.estimator.form = form_() == 0 ? Form::multiplied : Form::division;
    p.estimator.robust = robust_;
    p.estimator.inlier_px = inlier_;
    p.estimator.iterations = iterations_;
    p.confidence_minimum = conf_min_;
    p.inliers_minimum = inliers_min_;
    return p;
  }

  Input<StereoPair> pair_{this, "pair", "rectified stereo pair; join it with disparity"};
  Input<DisparityMap> disparity_{this, "disparity", "disparity of that pair"};
  Output<Motion> motion_{this, "motion", "motion since the previous frame and accumulated pose, camera frame"};
  Param<int> corners_{this, "corners", 800, {12, 20000}, "", "most corners per image"};
  Param<double> quality_{this,        "quality", 0.005,
                         {0.0, 0.99}, "1",       "least corner response, share of the image's largest"};
  Param<int> distance_{this, "distance", 5, {1, 100}, "px", "least distance of two corners"};
  Param<int> tile_{this, "tile", 64, {8, 16384}, "px", "edge of the tiles that corners are spread over"};
  Choice predict_{this,
                  "predict",
                  "pyramid",
                  {"pyramid", "constant_velocity", "none"},
                  "where the search is centred; none: thesis"};
  Choice subpixel_{
      this, "subpixel", "lucas_kanade", {"lucas_kanade", "parabola", "none"}, "fraction of a pixel; none: thesis"};
  Param<int> n_search_{this, "n_search", 11, {3, 15}, "px", "edge of the matching block, odd"};
  Param<double> sigma_{this,        "sigma", 0.2,
                       {0.0, 10.0}, "1",     "growth of the search window with the disparity; not for pyramid"};
  Param<double> r_const_{this, "r_const", 10.0, {0.0, 500.0}, "px", "search window at disparity 0; not for pyramid"};
  Param<bool> search_is_radius_{this, "search_is_radius", false, "", "search window +-N instead of +-N/2"};
  Param<bool> corner_candidates_{this, "corner_candidates", false, "",
                                 "test only positions within 1 px of a current corner"};
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
  Param<double> conf_min_{this, "conf_min", 0.3, {0.0, 1.0}, "1", "below it the motion is predicted and valid = 0"};
  Param<int> inliers_min_{this, "inliers_min", 12, {3, 20000}, "", "fewest inliers of a valid motion"};

  EgoMotion ego_;
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
