// SPDX-License-Identifier: Apache-2.0
#include "graph/evaluate/ego_motion_drive.hpp"

#include <doctest/doctest.h>

#include <cmath>
#include <cstring>
#include <numbers>

#include "graph/evaluate/ego_motion_score.hpp"
#include "nodes/ego_motion/evaluate.hpp"
#include "rt/msg/geometry.hpp"

using namespace takt;
using namespace takt::command;

namespace {

bool same(const cv::Mat& a, const cv::Mat& b) {
  return a.size() == b.size() && std::memcmp(a.data, b.data, a.total() * a.elemSize()) == 0;
}

double mean_of(const cv::Mat& image) { return cv::mean(image)[0]; }

}  // namespace

TEST_CASE("a generated drive: equal for equal seeds, its disparity and its motion are those of its images") {
  const DriveCondition condition{.name = "test", .speed_m_s = 0.8, .turn_deg_s = 60};
  const Drive drive = generate_drive(condition, 1, 4, 128), again = generate_drive(condition, 1, 2, 128);
  REQUIRE(drive.frames.size() == 4);
  for (size_t i = 0; i < 2; ++i) {
    CHECK(same(drive.frames[i].left, again.frames[i].left));
    CHECK(same(drive.frames[i].right, again.frames[i].right));
  }
  CHECK_FALSE(same(drive.frames[0].left, generate_drive(condition, 2, 1, 128).frames[0].left));
  CHECK_FALSE(same(drive.frames[0].left, drive.frames[0].right));

  // The floor far from everything else: the camera's height above it gives the disparity.
  const auto& first = drive.frames[0];
  const CameraModel& c = drive.camera;
  const Eigen::Vector3d ray = first.pose.R * Eigen::Vector3d(0, (450 - c.cv_px) / c.focal_px, 1);
  const double depth = -first.pose.t.z() / ray.z();
  CHECK(std::abs(first.disparity.at<int16_t>(450, 320) - c.focal_px * c.baseline_m / depth) < 1.5);

  const nlohmann::ordered_json result = score(drive, follow(drive, {}));
  CHECK(result["steps"] == 3);
  CHECK(result["refused_pct"] == 0);
  CHECK(result["median_mm"] < 1);
  CHECK(result["median_deg"] < 0.02);
  CHECK(result["baseline"]["zero motion"]["median_mm"] > 5);
}

TEST_CASE("conditions: exposure blurs, brightness changes, a covered lens is refused and rightly so") {
  const DriveCondition plain{.name = "test", .turn_deg_s = 60};
  DriveCondition blurred = plain, covered = plain, bright = plain;
  blurred.exposure_s = 0.03;
  covered.covered_every = 3;
  bright.right_gain = 0.5;
  const auto contrast = [](const Drive& drive) {
    cv::Scalar mean, deviation;
    cv::meanStdDev(drive.frames[0].left, mean, deviation);
    return deviation[0];
  };
  const Drive sharp = generate_drive(plain, 1, 2, 128);
  CHECK(contrast(generate_drive(blurred, 1, 1, 128)) < 0.98 * contrast(sharp));
  const Drive uneven = generate_drive(bright, 1, 1, 128);
  CHECK(mean_of(uneven.frames[0].right) / mean_of(sharp.frames[0].right) == doctest::Approx(0.5).epsilon(0.02));

  const Drive drive = generate_drive(covered, 1, 6, 128);
  const nlohmann::ordered_json result = score(drive, follow(drive, {}));
  CHECK(result["refused_pct"] == doctest::Approx(60));  // to the third and from it, to the sixth
  CHECK(result["refused_rightly_pct"] == 100);
  CHECK(result["accepted_wrong_pct"] == 0);
}

TEST_CASE("step errors") {
  using namespace ego_motion;
  const Rigid truth{rotation({0, 0.1, 0}), {0, 0, 1}},
      off{rotation({0, 0.1 + std::numbers::pi / 180, 0}), {0, 0.03, 1.04}};
  CHECK(step_error(off, truth).metres == doctest::Approx(0.05));
  CHECK(step_error(off, truth).degrees == doctest::Approx(1));
  UncertainPose pose{to_transform(off), {}};
  for (size_t axis = 0; axis < 6; ++axis) pose.covariance[7 * axis] = axis < 3 ? 0.01 * 0.01 : 1;
  CHECK(normalised_error_squared(pose, truth) == doctest::Approx(25).epsilon(1e-3));
}
