// SPDX-License-Identifier: Apache-2.0
// A simulated camera with lens distortion and a right camera that is not parallel, its calibration file and the stereo
// node, in virtual time, against the world's ground truth; and the same with a calibration of other cameras.
#include <doctest/doctest.h>

#include <Eigen/Geometry>
#include <cmath>

#include "nodes/stereo/calibration_file.hpp"
#include "nodes/stereo/rectify.hpp"
#include "rt/msg/geometry.hpp"
#include "rt/msg/point.hpp"
#include "rt/msg/point_cloud.hpp"
#include "tests/unit/compose/drive.hpp"
#include "tests/unit/compose/isometry.hpp"

using namespace takt;
using test::isometry;

namespace {

class CloudProbe final : public Node {
 public:
  std::vector<Point> points;  ///< of the newest cloud
  Transform sensor_in_robot;
  int64_t stamp = 0;

  void setup(Setup&) override {}
  void run(Job&) override {
    const PointCloud* cloud = cloud_.newest();
    if (cloud == nullptr) return;
    points.assign(cloud->points.items().begin(), cloud->points.items().end());
    sensor_in_robot = cloud->sensor_in_robot;
    stamp = cloud_.stamp_ns();
  }

 private:
  Input<PointCloud> cloud_{this, "cloud", ""};
};

/// The lab seen through that calibration for two seconds; empty: none.
test::Drive<CloudProbe> drive_with(const std::string& calibration) {
  const std::string nodes = R"(
    stereo: {type: stereo, in: {pair: head_camera.pair}, params: {calibration: ")" +
                            calibration + R"("}}
    probe: {type: probe, in: {cloud: stereo.cloud}}
)";
  return {{.devices = R"(
  head_camera: {kind: stereo_camera, rig: @/rigs/xb3_raw.yaml, rate: 15}
)",
           .nodes = nodes,
           .schedule = R"(
  head_camera: {rate: 15, budget: 5ms}
  stereo: {rate: 15, offset: 10ms, budget: 5ms, criticality: high}
  probe: {rate: 15, offset: 30ms, budget: 1ms}
)"},
          2'000'000'000};
}

const std::string kTrueFile = test::graph_folder() / "rigs" / "xb3_raw_calibration.yaml";

}  // namespace

TEST_CASE(
    "raw pairs are rectified by the rig's calibration: points lie where the world has them, and nothing is told") {
  auto drive = drive_with(kTrueFile);
  CHECK(drive.faults().empty());
  const CloudProbe& seen = drive.probe();
  // The same place without distortion: where its pixels are, and what depth they have, is known.
  const StereoRig ideal = test::rig_of("head_camera", "xb3.yaml");
  std::vector<float> truth(static_cast<size_t>(ideal.width) * static_cast<size_t>(ideal.height));
  drive.world().true_disparity(ideal, seen.stamp, truth.data());
  const Eigen::Isometry3d sensor_in_ideal =
      isometry(camera_in_robot(ideal, 0, 0)).inverse() * isometry(seen.sensor_in_robot);
  size_t inside = 0, good = 0;
  for (const Point& point : seen.points) {
    const Eigen::Vector3d p = sensor_in_ideal * Eigen::Vector3d(point.x, point.y, point.z);
    const long u = std::lround(ideal.focal_px * p.x() / p.z() + ideal.cu_px),
               v = std::lround(ideal.focal_px * p.y() / p.z() + ideal.cv_px);
    if (u < 0 || v < 0 || u >= ideal.width || v >= ideal.height) continue;
    ++inside;
    const double found = ideal.focal_px * ideal.baseline_m / p.z();
    good += std::abs(found - static_cast<double>(truth[static_cast<size_t>(v * ideal.width + u)])) <= 1;
  }
  MESSAGE(inside << " points, within 1 px " << 100.0 * static_cast<double>(good) / static_cast<double>(inside) << " %");
  CHECK(inside > truth.size() / 4 * 7 / 10);  // every second pixel of every second row
  CHECK(static_cast<double>(good) > 0.9 * static_cast<double>(inside));
}

TEST_CASE("raw pairs rectified by the calibration of parallel cameras: told that results are wrong") {
  const takt::test::TemporaryFolder folder;
  stereo::StereoCalibration parallel = stereo::read_calibration(kTrueFile);
  parallel.rotation = {1, 0, 0, 0, 1, 0, 0, 0, 1};
  parallel.translation_m = {-0.24, 0, 0};
  const std::string file = folder.path / "parallel.yaml";
  stereo::write_calibration(file, parallel, "");
  const auto drive = drive_with(file);
  REQUIRE_FALSE(drive.faults().empty());
  CHECK(drive.faults().size() <= 2);  // doubtful perhaps on the way
  CHECK(drive.faults().back().kind == Fault::wrong);
  CHECK(std::string(drive.faults().back().what.text()).find("stereo: rows of the rectified pair differ by") == 0);
}

TEST_CASE("raw pairs without calibration: told once, and nothing is matched") {
  const auto drive = drive_with("");
  REQUIRE(drive.faults().size() == 1);
  CHECK(drive.faults().front().kind == Fault::wrong);
  CHECK(std::string(drive.faults().front().what.text()).find("`calibration` is not set") != std::string::npos);
  CHECK(drive.probe().points.empty());
}
