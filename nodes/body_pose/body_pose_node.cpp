// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <optional>
#include <string>

#include "nodes/body_pose/body_detector.hpp"
#include "nodes/body_pose/floor.hpp"
#include "rt/msg/ace/body_poses.hpp"
#include "rt/msg/geometry.hpp"
#include "rt/msg/point.hpp"
#include "rt/msg/point_cloud.hpp"
#include "rt/node.hpp"

namespace takt {
namespace {

using namespace body_pose;

class BodyPoseNode final : public Node {
 public:
  void setup(Setup& setup) override {
    const uint32_t capacity = cloud_.capacity().count;
    try {
      detector_.emplace(read_skeleton(setup.directory / skeleton_()), parameters(), capacity);
    } catch (const SkeletonError& error) {
      throw SetupError(error.what());
    } catch (const std::invalid_argument& problem) {
      throw SetupError(std::string(problem.what()) + ", these clouds may have " + std::to_string(capacity));
    }
    in_robot_.resize(capacity);
    bodies_.reserve({0, 0, 1, static_cast<uint32_t>(candidates_())});
  }

  void changed() override { detector_->tune(parameters()); }

  void run(Job& job) override {
    const PointCloud* cloud = cloud_.newest();
    const auto mount = cloud != nullptr && cloud_.is_new() ? mount_of(*cloud) : std::nullopt;
    BodyPoses* out = mount ? bodies_.loan() : nullptr;
    if (out == nullptr) return job.no_result();
    const auto reserve_ns = static_cast<int64_t>(reserve_() * 1e9);
    const auto found = detector_->run(moved(cloud->points.items(), mapping_3d::to_affine(*mount)), eye_of(*mount),
                                      [&] { return job.time_left_ns() > reserve_ns; });
    out->joints = static_cast<int32_t>(detector_->skeleton().links.size());
    out->candidates = static_cast<int32_t>(detector_->candidates().size());
    out->searched = static_cast<float>(detector_->searched());
    for (const DetectedBody& body : found) out->bodies.push_back(to_message(detector_->skeleton(), body));
    bodies_.send(cloud_.stamp_ns());
  }

  void remember(StateArchive&) override {}

 private:
  DetectorParameters parameters() const {
    DetectorParameters p;
    p.segmentation.range_m = range_max_;
    p.segmentation.voxel_m = voxel_;
    p.segmentation.floor_m = floor_;
    p.segmentation.candidates = candidates_;
    p.fit.rotations = rotations_;
    p.fit.search_m = search_;
    p.fit.weight_away = facing_;
    p.error_max = error_max_;
    p.links_min = links_min_;
    return p;
  }

  /// What the cloud says; where it says nothing, what the floor in it says.
  static std::optional<Transform> mount_of(const PointCloud& cloud) {
    const Transform& t = cloud.sensor_in_robot;
    const bool said = t.x != 0 || t.y != 0 || t.z != 0 || t.qx != 0 || t.qy != 0 || t.qz != 0;
    return said ? t : find_floor(cloud.points.items(), {});
  }

  std::span<const Point> moved(std::span<const Point> points, const mapping_3d::Affine& a) {
    const size_t count = std::min(points.size(), in_robot_.size());
    for (size_t i = 0; i < count; ++i) {
      const mapping_3d::Position p = mapping_3d::transformed(a, points[i].x, points[i].y, points[i].z);
      in_robot_[i] = {static_cast<float>(p.x_m), static_cast<float>(p.y_m), static_cast<float>(p.z_m)};
    }
    return std::span(in_robot_).first(count);
  }

  Input<PointCloud> cloud_{this, "cloud", "points in the camera frame; the newest one is searched, once"};
  Output<BodyPoses> bodies_{this, "bodies", "people and their joints in the robot frame, nearest first"};
  Param<std::string> skeleton_{this, "skeleton", "skeletons/human.txt", kPath, "what a body is made of"};
  Param<double> range_max_{this, "range_max", 5.0, {1.0, 10.0}, "m", "farther points are left out", kSizesMemory};
  Param<double> voxel_{this, "voxel", 0.03, {0.01, 0.1}, "m", "the cloud is reduced to one point a voxel"};
  Param<double> floor_{this, "floor", 0.08, {0.0, 0.5}, "m", "lower points are floor"};
  Param<int> candidates_{this, "candidates", 16, {1, 64}, "", "clusters that are looked at, at most", kSizesMemory};
  Param<int> rotations_{this, "rotations", 11, {1, 36}, "", "of each typical pose about the vertical"};
  Param<double> search_{this,        "search", DetectorParameters{}.fit.search_m,
                        {0.05, 1.0}, "m",      "a link ends at most so far from where a typical pose has it"};
  Param<double> facing_{this,        "facing", DetectorParameters{}.fit.weight_away,
                        {0.0, 10.0}, "1",      "penalty of a body that faces away from the sensor; 0: none"};
  Param<double> error_max_{this,         "error_max", DetectorParameters{}.error_max,
                           {0.0, 100.0}, "1",         "fits with a larger error are no bodies"};
  Param<int> links_min_{this, "links_min", DetectorParameters{}.links_min, {1, 15}, "", "links that a body must show"};
  Param<double> reserve_{this, "reserve", 0.005, {0.0, 0.1}, "s", "with less time left than this the search ends"};

  std::optional<BodyDetector> detector_;
  std::vector<Point> in_robot_;
};

}  // namespace

void register_body_pose(NodeTypes& types) {
  types.add<BodyPoseNode>("body_pose", Layer::perception, "People in a point cloud: joints, poses, where they point");
}

}  // namespace takt
