// SPDX-License-Identifier: Apache-2.0
#include <cmath>
#include <cstdio>
#include <memory>
#include <optional>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "nodes/cuda/accelerator.hpp"
#include "nodes/stereo/band_matcher.hpp"
#include "nodes/stereo/calibration_file.hpp"
#include "nodes/stereo/cuda_matcher.hpp"
#include "nodes/stereo/half_resolution.hpp"
#include "nodes/stereo/matcher.hpp"
#include "nodes/stereo/rectification_monitor.hpp"
#include "nodes/stereo/rectify.hpp"
#include "nodes/stereo/triangulate.hpp"
#include "rt/msg/disparity.hpp"
#include "rt/msg/geometry.hpp"
#include "rt/msg/image.hpp"
#include "rt/msg/point_cloud.hpp"
#include "rt/node.hpp"
#include "rt/transform/pose_math.hpp"

namespace takt {
namespace {

using namespace stereo;

constexpr int kHalfRange = 2;                              // level
constexpr double kHalfCost = 0.35, kHalfRangeCost = 0.25;  // README.md, quality levels

class StereoNode final : public Node {
 public:
  void setup(Setup& setup) override {
    const Capacity& images = pair_.capacity();
    width_ = static_cast<int>(images.width);
    height_ = static_cast<int>(images.height);
    channels_ = input_channels_ = static_cast<int>(images.channels);
    pattern_ = static_cast<BayerPattern>(bayer_());
    if (pattern_ != BayerPattern::none) check_mosaic();
    range_ = most_ = disparities_;
    try {
      matcher_ = full_matcher(setup.clock, parameters(disparities_));
      half_matcher_.emplace(width_, height_, channels_, parameters(disparities_));
      if (!calibration_().empty()) load_calibration(setup.directory / calibration_());
    } catch (const std::invalid_argument& error) {
      throw SetupError(error.what());
    }
    const auto pixels = static_cast<size_t>(width_) * static_cast<size_t>(height_);
    const size_t bytes = pixels * static_cast<size_t>(channels_);
    left_.resize(bytes);
    right_.resize(bytes);
    disparity_scratch_.resize(pixels);
    confidence_scratch_.resize(pixels);
    if (subpixel_) fraction_scratch_.resize(pixels);
    rectified_.reserve({images.width, images.height, static_cast<uint32_t>(channels_), 0});
    monitor_.emplace(width_, height_, disparities_());
    disparity_.reserve({images.width, images.height, 1, 0});
    least_step_ = cloud_step_;
    const auto step = static_cast<uint32_t>(least_step_);
    cloud_.reserve({0, 0, 1, ((images.width + step - 1) / step) * ((images.height + step - 1) / step)});
  }

  void changed() override {
    if (cloud_step_ < least_step_)
      throw SetupError("cloud_step is " + cloud_step_.value_text() + " px, and memory was taken for the points of " +
                       std::to_string(least_step_) + " px; start with it");
    const MatcherParameters p = parameters(disparities_);
    if (const auto wrong = problem(p, width_, height_, channels_)) throw SetupError("stereo: " + *wrong);
    matcher_->tune(p);
    half_matcher_->tune(p);
  }

  int64_t helper_cpu_ns() const override { return matcher_ ? matcher_->helper_cpu_ns() : 0; }

  void run(Job& job) override {
    const StereoPair* in = pair_.newest();
    if (!in || !pair_.is_new()) return job.no_result();  // nothing to match, or matched already
    const bool is_rectified = in->camera.focal_px > 0;
    if (!fits(job, *in, is_rectified)) return job.no_result();
    stamp_ = pair_.stamp_ns();
    sensor_in_robot_ = is_rectified ? in->sensor_in_robot : rectified_in_robot(in->sensor_in_robot);
    camera_ = is_rectified ? in->camera : rectifier_->camera();
    ImageView<const uint8_t> left = in->left_view(), right = in->right_view();
    if (!rectify(*in, is_rectified, left, right)) return job.no_result();
    set_range(job.level());
    if (disparity_.connected() || cloud_.connected()) match_and_send(job, left, right);
  }

  void remember(StateArchive& archive) override { TAKT_STATE(archive, monitor_, alarm_, told_of_misfit_); }

 private:
  MatcherParameters parameters(int disparities) const {
    MatcherParameters p;
    p.disparities = disparities;
    p.cost = static_cast<CostKind>(cost_());
    p.c_max = c_max_;
    p.n_square = n_square_;
    p.n_min = n_min_;
    p.min_confidence = static_cast<int>(std::lround(min_confidence_ * 255));
    p.uniqueness = static_cast<int>(std::lround(uniqueness_ * 255));
    p.left_right_check = left_right_check_;
    p.intensity_weight = intensity_weight_;
    p.aggregation = static_cast<Aggregation>(aggregation_());
    p.combination = static_cast<Combination>(combination_());
    p.edge_threshold = edge_threshold_;
    p.gamma_distance = gamma_distance_;
    p.gamma_colour = gamma_colour_;
    p.selection = static_cast<Selection>(selection_());
    p.p1 = p1_;
    p.p2 = p2_;
    p.median = median_;
    p.subpixel = subpixel_;
    return p;
  }

  std::unique_ptr<Matcher> full_matcher(const Clock& clock, const MatcherParameters& p) {
    std::unique_ptr<CudaMatcher> on_card;
    const auto in_use = accelerator_.take(
        [&](const cuda::CardUse& use) { on_card = std::make_unique<CudaMatcher>(width_, height_, channels_, p, use); },
        [&] { return on_card->is_quicker(clock); });
    card_matcher_ = in_use ? on_card.get() : nullptr;
    if (in_use) return on_card;
    if (bands_ > 1) return std::make_unique<BandMatcher>(width_, height_, channels_, p, bands_);
    return make_matcher(width_, height_, channels_, p);
  }

  void check_mosaic() {
    if (channels_ != 1)
      throw SetupError("bayer is " + std::string(bayer_.word()) + " but `pair` has " + std::to_string(channels_) +
                       " channels; mosaics have 1");
    if (calibration_().empty())
      throw SetupError("bayer is " + std::string(bayer_.word()) +
                       " but there is no `calibration`; raw pairs are debayered where they are rectified");
    channels_ = 3;
  }

  void load_calibration(const std::filesystem::path& path) {
    const StereoCalibration calibration = read_calibration(path);
    if (calibration.width != width_ || calibration.height != height_)
      throw SetupError(path.string() + " is for " + std::to_string(calibration.width) + " x " +
                       std::to_string(calibration.height) + " px but `pair` has " + std::to_string(width_) + " x " +
                       std::to_string(height_) + "; give the calibration of this camera mode");
    rectifier_.emplace(calibration, pattern_);
  }

  /// Whether the node was set up for such a pair; else the first one says why it gets no result.
  bool fits(Job& job, const StereoPair& in, bool is_rectified) {
    char text[160];
    const int channels = is_rectified ? channels_ : input_channels_;
    if (in.camera.focal_px != 0 && !is_rectified) return false;  // damaged: a camera that is not calibrated says 0
    if (!is_rectified && !rectifier_)
      std::snprintf(
          text, sizeof text,
          "the pair is raw and `calibration` is not set, so nothing is matched; docs/calibration.md makes one");
    else if (in.width != width_ || in.height != height_ || in.channels != channels)
      std::snprintf(text, sizeof text, "a pair of %d x %d px and %d channels is not matched; those of %d x %d, %d are",
                    in.width, in.height, in.channels, width_, height_, channels);
    else return true;
    if (!std::exchange(told_of_misfit_, true)) job.results_wrong(text);
    return false;
  }

  /// Rectification turned the left camera; a mount that is not known stays so.
  Transform rectified_in_robot(const Transform& raw) const {
    const bool known = raw.x != 0 || raw.y != 0 || raw.z != 0 || raw.qx != 0 || raw.qy != 0 || raw.qz != 0;
    return known ? compose({raw, {}}, {rectifier_->rectified_in_raw(), {}}).transform : raw;
  }

  /// Leaves the views on rectified images: in the input, in the message to send or in this node's own memory.
  bool rectify(const StereoPair& in, bool is_rectified, ImageView<const uint8_t>& left,
               ImageView<const uint8_t>& right) {
    StereoPair* out = rectified_.connected() ? rectified_.loan() : nullptr;
    ImageView<uint8_t> left_out(left_.data(), width_, height_, channels_),
        right_out(right_.data(), width_, height_, channels_);
    if (out != nullptr) {
      out->width = width_;
      out->height = height_;
      out->channels = channels_;
      out->health = in.health;
      out->frame_number = in.frame_number;
      out->camera = camera_;
      out->sensor_in_robot = sensor_in_robot_;
      out->left.resize(left_.size());
      out->right.resize(right_.size());
      left_out = out->left_view();
      right_out = out->right_view();
    }
    if (is_rectified) {
      if (out != nullptr && !Rectifier(width_, height_, camera_).rectify(left, right, left_out, right_out))
        return false;
    } else {
      if (!rectifier_->rectify(left, right, left_out, right_out)) return false;
      left = left_out;
      right = right_out;
    }
    if (out != nullptr) rectified_.send(stamp_);
    return true;
  }

  void match_and_send(Job& job, ImageView<const uint8_t> left, ImageView<const uint8_t> right) {
    DisparityMap* map = disparity_.connected() ? disparity_.loan() : nullptr;
    DisparityViews views{{disparity_scratch_.data(), width_, height_}, {confidence_scratch_.data(), width_, height_}};
    if (subpixel_) views.fraction = {fraction_scratch_.data(), width_, height_};
    if (map != nullptr) {
      map->width = width_;
      map->height = height_;
      map->disparities = range_;
      map->camera = camera_;
      map->disparity.resize(disparity_scratch_.size());
      map->confidence.resize(confidence_scratch_.size());
      map->fraction.resize(fraction_scratch_.size());
      views.disparity = map->view();
      views.confidence = map->confidence_view();
      if (subpixel_) views.fraction = map->fraction_view();
    }
    Matcher& matcher = job.level() == 0 ? *matcher_ : *half_matcher_;
    if (!matcher.match(left, right, views)) return job.no_result();
    if (card_matcher_ != nullptr && job.level() == 0) accelerator_.tell(job, "matches", card_matcher_->trouble());
    if (map != nullptr) disparity_.send(stamp_);
    if (row_check_) check_rows(job, left, right, views.disparity);
    PointCloud* cloud = cloud_.connected() ? cloud_.loan() : nullptr;
    if (cloud != nullptr) {
      cloud->camera = camera_;
      cloud->sensor_in_robot = sensor_in_robot_;
      cloud->step_px = cloud_step_;
      cloud->points.resize(cloud->points.capacity);
      cloud->colours.resize(cloud->colours.capacity);
      const size_t count =
          triangulate(views, left, camera_, cloud_step_, cloud->points.items(), cloud->colours.items());
      cloud->points.resize(count);
      cloud->colours.resize(count);
      cloud_.send(stamp_);
    }
    if ((disparity_.connected() && map == nullptr) || (cloud_.connected() && cloud == nullptr)) job.no_result();
  }

  void check_rows(Job& job, ImageView<const uint8_t> left, ImageView<const uint8_t> right,
                  ImageView<const int16_t> disparity) {
    monitor_->observe(left, right, disparity);
    const auto error_px = monitor_->row_error_px();
    const auto trust = error_px ? alarm_.update(*error_px) : std::nullopt;
    if (!trust) return;
    char text[120];
    std::snprintf(text, sizeof text,
                  "rows of the rectified pair differ by %.2f px (median of %zu points); calibrate again", *error_px,
                  monitor_->points());
    if (*trust == RowTrust::wrong) job.results_wrong(text);
    else job.results_doubtful(text);
  }

  /// `search` may have been changed between two jobs, and the level.
  void set_range(int level) {
    const int all = search_ > 0 ? std::min(search_(), most_) : most_,
              wanted = level == kHalfRange ? (all + 1) / 2 : all;
    if (wanted == range_) return;
    range_ = wanted;
    matcher_->limit_search(range_);
    half_matcher_->limit_search(range_);
  }

  Input<StereoPair> pair_{this, "pair", "raw or rectified pair; raw ones need a calibration"};
  Output<StereoPair> rectified_{this, "rectified", "the pair with epipolar lines along rows"};
  Output<DisparityMap> disparity_{this, "disparity", "disparity and confidence of the left rectified image"};
  Output<PointCloud> cloud_{this, "cloud",
                            "coloured points in the frame of the left camera (x right, y down, z forward)"};

  Levels levels_{
      this,
      {{"full", 1.0, "every pixel, every disparity"},
       {"half", kHalfCost, "half resolution over the same range; disparities are even"},
       {"half_range", kHalfRangeCost, "half resolution, half of the range: what is nearer gets a wrong one"}}};

  Param<int> disparities_{this, "disparities", 150, {1, 512}, "px", "search range 0 .. disparities - 1", kSizesMemory};
  Param<int> search_{this, "search", 0, {0, 512}, "px", "of that range, how much is searched; 0: all of it"};
  Choice cost_{this,
               "cost",
               "gradient",
               {"gradient", "ssd", "sad", "census", "rss", "mixed"},
               "matching cost of two pixels",
               kSizesMemory};
  Param<int> c_max_{this,        "c_max",
                    0,           {0, 255},
                    "",          "truncation of the cost; 0: 10 for gradient, 24 for census, 50 for the others",
                    kSizesMemory};
  Param<double> intensity_weight_{this, "intensity_weight",
                                  1.0,  {0.0, 1.0},
                                  "1",  "w of cost mixed: share of the intensities next to the derivatives"};
  Choice aggregation_{this,
                      "aggregation",
                      "square",
                      {"square", "adaptive_window", "boundary", "adaptive_weight"},
                      "which costs around a pixel count; all but square take many times as long",
                      kSizesMemory};
  Choice combination_{this, "combination", "min", {"min", "max", "mean"}, "of the three sizes of an adaptive window"};
  Param<int> n_square_{this, "n_square", 15, {1, 31}, "px", "edge of the summing window, odd", kSizesMemory};
  Param<int> n_min_{this, "n_min", 5, {1, 31}, "px", "edge of the minimum filter, odd, at most n_square", kSizesMemory};
  Param<double> edge_threshold_{this, "edge_threshold",
                                30.0, {0.0, 361.0},
                                "1",  "gradient magnitude of an edge that bounds a window, grey levels"};
  Param<double> gamma_distance_{
      this, "gamma_distance", 7.5, {0.1, 100.0}, "px", "distance at which an adaptive weight has fallen to 1/e"};
  Param<double> gamma_colour_{this, "gamma_colour",
                              20.0, {0.1, 442.0},
                              "1",  "difference of colour at which an adaptive weight has fallen to 1/e"};
  Choice selection_{
      this, "selection", "winner", {"winner", "scanline", "semi_global"}, "how costs become a disparity", kSizesMemory};
  Param<int> p1_{this, "p1", 0, {0, 255}, "", "cost of a step by 1 px along a path; 0: 0.1 c_max, semi_global 14"};
  Param<int> p2_{this, "p2", 0, {0, 255}, "", "cost of a larger step; 0: 0.6 c_max, semi_global 60"};
  Param<bool> median_{this, "median", false, "", "3 x 3 median filter on the disparities", kSizesMemory};
  Param<bool> subpixel_{this, "subpixel", false, "", "disparities to 1/64 px", kSizesMemory};
  Param<double> min_confidence_{
      this, "min_confidence", 0.25, {0.0, 1.0}, "1", "smallest confidence of a valid pixel; 0 keeps all"};
  Param<double> uniqueness_{this,        "uniqueness", 0.0,
                            {0.0, 1.0},  "1",          "smallest (second - best) / second of a valid pixel; 0: off",
                            kSizesMemory};
  Param<bool> left_right_check_{
      this,        "left_right_check", false, "", "reject where left and right disagree by over 1 px; doubles the time",
      kSizesMemory};
  Param<int> bands_{this,
                    "bands",
                    1,
                    {1, 8},
                    "",
                    "of rows, each on a thread of its own while a CPU is free (full level)",
                    Fixed{"starts threads"}};
  cuda::Accelerator accelerator_{this};
  Param<int> cloud_step_{
      this, "cloud_step", 2, {1, 64}, "px", "distance of the pixels that become points; in a run not below its start"};
  Param<std::string> calibration_{this, "calibration", "", kPath,
                                  "calibration file (M1 D1 M2 D2 R T image_size) for raw pairs"};
  Choice bayer_{this,
                "bayer",
                "none",
                {"none", "rggb", "bggr", "grbg", "gbrg"},
                "colour filter of raw pairs of one channel, from the upper left corner; they become BGR",
                kSizesMemory};
  Param<bool> row_check_{this, "row_check", true, "",
                         "tell where matched points of the rectified pair lie on different rows"};

  int width_ = 0, height_ = 0;
  int channels_ = 0, input_channels_ = 0;  ///< of what is matched, of the input; they differ for mosaics
  BayerPattern pattern_ = BayerPattern::none;
  int least_step_ = 1;        ///< of the cloud that memory was taken for
  int most_ = 0, range_ = 0;  ///< disparities that memory was taken for, that are searched
  int64_t stamp_ = 0;
  CameraModel camera_;
  Transform sensor_in_robot_;
  std::unique_ptr<Matcher> matcher_;
  CudaMatcher* card_matcher_ = nullptr;  ///< matcher_, where that is one
  std::optional<HalfMatcher> half_matcher_;
  std::optional<Rectifier> rectifier_;
  std::optional<RectificationMonitor> monitor_;
  RowErrorAlarm alarm_;
  bool told_of_misfit_ = false;
  std::vector<uint8_t> left_, right_, confidence_scratch_, fraction_scratch_;
  std::vector<int16_t> disparity_scratch_;
};

}  // namespace

void register_stereo(NodeTypes& types) {
  types.add<StereoNode>("stereo", Layer::perception,
                        "Rectification, dense disparity with confidence, coloured point cloud");
}

}  // namespace takt
