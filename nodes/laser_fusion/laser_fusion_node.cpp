// SPDX-License-Identifier: Apache-2.0
#include <charconv>
#include <cmath>
#include <optional>
#include <string>

#include "nodes/laser_fusion/laser_fusion.hpp"
#include "rt/msg/geometry.hpp"
#include "rt/msg/point_cloud.hpp"
#include "rt/msg/pose.hpp"
#include "rt/node.hpp"

namespace takt {
namespace {

using namespace laser_fusion;

/// Words of the parameter `locked`, as in PoseParameters.
constexpr std::array<std::string_view, 6> kParameterNames{"x", "y", "z", "yaw", "pitch", "roll"};

Locks locks_of(const std::string& text) {
  Locks locks{};
  for (size_t begin = 0; begin < text.size();) {
    const size_t end = std::min(text.find(',', begin), text.size());
    const std::string_view word = std::string_view(text).substr(begin, end - begin);
    const auto name = std::find(kParameterNames.begin(), kParameterNames.end(), word);
    if (name == kParameterNames.end())
      throw SetupError("locked names \"" + std::string(word) +
                       "\", must be words of x, y, z, yaw, pitch, roll with commas between");
    locks[static_cast<size_t>(name - kParameterNames.begin())] = true;
    begin = end + 1;
  }
  return locks;
}

class LaserFusionNode final : public Node {
 public:
  void setup(Setup&) override {
    try {
      fusion_.emplace(laser_.capacity().count, vision_.capacity().count, parameters());
    } catch (const std::invalid_argument& problem) {
      throw SetupError(problem.what());
    }
    fused_.reserve(laser_.capacity());
    match_.reserve(laser_.capacity());
  }

  void changed() override { fusion_->tune(parameters()); }

  void run(Job& job) override {
    if (fusion_->idle() && !begin()) return job.no_result();
    const uint32_t first = fusion_->generation();
    const auto reserve_ns = static_cast<int64_t>(reserve_() * 1e9);
    const auto most = static_cast<uint32_t>(per_job_());
    fusion_->run([&] {
      const bool enough = fusion_->searching() && fusion_->generation() >= first + most;
      return !enough && job.time_left_ns() > reserve_ns;
    });
    if (!fusion_->has_pose()) return job.no_result();
    tell_pose(job);
    if (fusion_->done()) tell_clouds(job);
  }

  void remember(StateArchive& archive) override {
    TAKT_STATE(archive, fusion_, laser_stamp_ns_, vision_stamp_ns_, laser_in_robot_);
  }

 private:
  LaserFusionParameters parameters() const {
    LaserFusionParameters p;
    p.search_points = static_cast<size_t>(points_());
    p.vision_points = static_cast<size_t>(vision_points_());
    p.quality.metric = metric_() == 0 ? Metric::truncated : Metric::thesis;
    p.quality.cut_m = cut_;
    p.genetic.population = static_cast<size_t>(population_());
    p.genetic.generations = static_cast<uint32_t>(generations_());
    p.genetic.patience = static_cast<uint32_t>(patience_());
    p.genetic.locks = locks_of(locked_);
    for (const Parameter axis : {kX, kY, kZ}) p.genetic.mutation[axis] = mutation_distance_;
    for (const Parameter angle : {kYaw, kPitch, kRoll}) p.genetic.mutation[angle] = mutation_angle_;
    p.clusters = {cluster_link_, static_cast<size_t>(cluster_least_())};
    p.fusion = {sigma_, confidence_min_};
    return p;
  }

  /// Takes a pair of clouds of which one is new; false without.
  bool begin() {
    const PointCloud *laser = laser_.newest(), *vision = vision_.newest();
    if (!laser || !vision || !(laser_.is_new() || vision_.is_new())) return false;
    laser_stamp_ns_ = laser_.stamp_ns();
    vision_stamp_ns_ = vision_.stamp_ns();
    laser_in_robot_ = laser->sensor_in_robot;
    const Rigid start = ego_motion::from_transform(laser->sensor_in_robot).inverse() *
                        ego_motion::from_transform(vision->sensor_in_robot);
    fusion_->begin(laser->points.items(), {vision->points.items(), vision->colours.items()}, start,
                   static_cast<uint64_t>(seed_()), fused_.connected() || match_.connected());
    return true;
  }

  void tell_pose(Job& job) {
    Pose* pose = pose_.loan();
    if (!pose) return job.no_result();
    pose->transform = ego_motion::to_transform(fusion_->vision_in_laser());
    pose_.send(vision_stamp_ns_);
  }

  void tell_clouds(Job& job) {
    const bool trusted = std::isfinite(fusion_->quality().score) && fusion_->share() >= share_min_;
    PointCloud* fused = trusted && fused_.connected() ? fused_.loan() : nullptr;
    PointCloud* match = trusted && match_.connected() ? match_.loan() : nullptr;
    if (!trusted || (fused_.connected() && !fused) || (match_.connected() && !match)) job.no_result();
    for (PointCloud* cloud : {fused, match})
      if (cloud) cloud->sensor_in_robot = laser_in_robot_;
    for (const auto& [point, colour, confidence] : fusion_->finish()) {
      if (fused) fused->points.push_back(point), fused->colours.push_back(colour);
      if (match) match->points.push_back(point), match->colours.push_back(confidence_colour(confidence));
    }
    if (fused) fused_.send(laser_stamp_ns_);
    if (match) match_.send(laser_stamp_ns_);
  }

  Input<PointCloud> laser_{this, "laser", "points of a laser sweep, in its frame"};
  Input<PointCloud> vision_{this, "vision", "coloured points of a camera, in its frame"};
  Output<Pose> pose_{this, "pose",
                     "the camera in the laser's frame, best so far, from each job; its covariance is not known: 0"};
  Output<PointCloud> fused_{this, "fused", "once the search is done: laser points with colours, in the laser's frame"};
  Output<PointCloud> match_{this, "match", "the same points; green is their match probability in 1/255, red the rest"};
  Param<int> points_{this, "points", 1000, {50, 20'000}, "", "of each cloud in the search, at most", kSizesMemory};
  Param<int> vision_points_{this,        "vision_points", 10'000, {50, 200'000}, "", "that lend their colours, at most",
                            kSizesMemory};
  Choice metric_{this,
                 "metric",
                 "truncated",
                 {"truncated", "thesis"},
                 "what is minimised: the mean of min(distance, cut), or Eq. 4.18, which wrong poses can win"};
  Param<double> cut_{this, "cut", 0.25, {0.005, 10.0}, "m", "points at most so far apart are pairs"};
  Param<int> population_{
      this, "population", 100, {2, 10'000}, "", "poses that have offspring; 50 to 200 advised", kSizesMemory};
  Param<int> generations_{this, "generations", 25'000, {1, 10'000'000}, "", "ICP steps of a search"};
  Param<int> patience_{this, "patience", 1000, {0, 10'000'000}, "", "without a gain it begins anew; 0: never"};
  Param<int> per_job_{this, "per_job", 1000, {8, 1'000'000}, "", "of these, in one job"};
  Param<double> mutation_distance_{
      this, "mutation_distance", 0.5, {0.0, 10.0}, "m", "a mutation moves along an axis by at most so much"};
  Param<double> mutation_angle_{
      this, "mutation_angle", 1.05, {0.0, 3.15}, "rad", "a mutation turns about an axis by at most so much"};
  Param<std::string> locked_{this, "locked", "", "", "words of x,y,z,yaw,pitch,roll: these stay as mounted"};
  Param<double> cluster_link_{this, "cluster_link", 0.5, {0.01, 10.0}, "m", "points so near hang together"};
  Param<int> cluster_least_{this, "cluster_least", 10, {1, 1000}, "", "points of a cluster that takes part"};
  Param<double> sigma_{this, "sigma", 0.1, {0.001, 2.0}, "m", "of the match probability"};
  Param<double> confidence_min_{
      this, "confidence_min", 0.1, {0.01, 1.0}, "1", "laser points of a lower match probability are left out"};
  Param<double> share_min_{
      this, "share_min", 0.25, {0.0, 1.0}, "1", "no cloud is given if fewer laser points of the search have a partner"};
  Param<double> reserve_{this,       "reserve", 0.002,
                         {0.0, 1.0}, "s",       "with less time left a job ends, and the next one goes on"};
  Param<int> seed_{this, "seed", 1, {0, 1'000'000}, "", "of the search: the same clouds give the same pose"};

  std::optional<LaserFusion> fusion_;
  int64_t laser_stamp_ns_ = 0, vision_stamp_ns_ = 0;
  Transform laser_in_robot_;
};

}  // namespace

void register_laser_fusion(NodeTypes& types) {
  types.add<LaserFusionNode>("laser_fusion", Layer::perception,
                             "Pose of a camera's cloud in a laser sweep by genetic ICP; laser points with colours");
}

}  // namespace takt
