// SPDX-License-Identifier: Apache-2.0
#include <doctest/doctest.h>

#include <cmath>
#include <set>

#include "nodes/body_pose/fitter.hpp"
#include "rt/msg/point.hpp"
#include "tests/unit/body_pose/skeletons.hpp"

using namespace takt;
using namespace takt::body_pose;
using Eigen::Vector3f;
using test::kWithoutEnd;
using test::shipped;

namespace {

/// A body of bare bones that stands in a typical pose: points along its links, joints included.
std::vector<Point> bones(const Skeleton& skeleton, size_t pose, const Vector3f& start, std::vector<Vector3f>& joints) {
  std::vector<Point> points;
  joints.assign(skeleton.links.size(), start);
  for (size_t i = 1; i < skeleton.links.size(); ++i) {
    const Link& link = skeleton.links[i];
    const Vector3f from = joints[link.parent], along = skeleton.poses[pose].directions[i].cast<float>();
    joints[i] = from + along * static_cast<float>(link.length_m);
    for (int k = 1; k <= 20; ++k) {
      const Vector3f p = from + along * static_cast<float>(link.length_m * k / 20);
      points.push_back({p.x(), p.y(), p.z()});
    }
    points.back() = {joints[i].x(), joints[i].y(), joints[i].z()};
  }
  return points;
}

}  // namespace

TEST_CASE("oracle 8: all links fitted exactly, all points used, density fine: the error is 0") {
  PoseError error;
  CHECK(error.total({}, 100, 100) == 0);
  CHECK(error.total({}, 0, 0) == 0);
  FitParameters p;
  p.weight_distance = 2;
  p.weight_missing = 3;
  p.weight_unused = 5;
  p.weight_thin = 7;
  p.weight_away = 11;
  error.distance_m = 0.1;
  error.missing = 0.2;
  error.thin = 0.3;
  error.away = 0.4;
  CHECK(error.total(p, 75, 100) == doctest::Approx(0.2 + 0.6 + 5 * 0.25 + 2.1 + 4.4));
}

TEST_CASE("bones in a typical pose are found where they are, in that pose, with next to no error") {
  const Skeleton skeleton = shipped("human");
  const FitParameters p;
  Fitter fitter(skeleton, p, 1000);
  for (const size_t pose : {0u, 7u, 18u, 25u}) {
    INFO(skeleton.poses[pose].name);
    std::vector<Vector3f> joints;
    const std::vector<Point> points = bones(skeleton, pose, {0, 0, 1.6f}, joints);
    const Cluster cluster{points, {0, 0, 1.6f}, reference_density(points, p.tube_m)};
    const Fit fit = fitter.fit(cluster, kWithoutEnd);
    CHECK(fit.error < 0.7);
    CHECK(fit.searched == 1);
    CHECK(is_valid(skeleton, p, fit));
    double sum = 0;
    for (size_t i = 1; i < joints.size(); ++i) {
      CHECK(fit.fitted[i]);
      sum += (fit.ends[i] - joints[i]).norm();
    }
    if (fit.yaw_rad == 0) CHECK(sum / 15 < 0.05);
  }
}

TEST_CASE("a link that is not there is missing with all that hangs on it, and costs more the more that is") {
  const Skeleton skeleton = shipped("crane");
  FitParameters p;
  Fitter fitter(skeleton, p, 1000);
  std::vector<Vector3f> joints;
  const std::vector<Point> whole = bones(skeleton, 0, {0, 2, 1.7f}, joints);
  const double density = reference_density(whole, p.tube_m);
  const auto without = [&](const std::string& first, const std::string& second) {
    std::vector<Point> points;
    for (size_t i = 1; i < skeleton.links.size(); ++i)
      if (skeleton.links[i].name != first && skeleton.links[i].name != second)
        points.insert(points.end(), whole.begin() + static_cast<ptrdiff_t>(20 * (i - 1)),
                      whole.begin() + static_cast<ptrdiff_t>(20 * i));
    return fitter.fit({points, {0, 2, 1.7f}, density}, kWithoutEnd);
  };
  const Fit all = without("", ""), no_rope = without("rope", ""), no_jib = without("jib", "rope");
  CHECK(std::count(all.fitted.begin(), all.fitted.end(), true) == 6);
  CHECK_FALSE(no_rope.fitted[skeleton.link("rope")]);
  CHECK(no_rope.fitted[skeleton.link("jib")]);
  CHECK_FALSE(no_jib.fitted[skeleton.link("rope")]);
  CHECK(all.error < no_rope.error);
  CHECK(no_rope.error < no_jib.error);
}

TEST_CASE("angles are measured in the frame of the link: an elbow bends one way, an arm does not go through the back") {
  const Skeleton s = shipped("human");
  const Eigen::Matrix3f body = Eigen::Matrix3f::Identity();
  const Link& upper = s.links[s.link("upper_arm_left")];
  const Link& lower = s.links[s.link("lower_arm_left")];
  const auto unit = [](float x, float y, float z) { return Vector3f(x, y, z).normalized(); };
  CHECK(angles_allow(s, upper, body, unit(0, 0, -1)));
  CHECK(angles_allow(s, upper, body, unit(0, 1, 0)));
  CHECK(angles_allow(s, upper, body, unit(-1, 0, 0)));
  CHECK(angles_allow(s, upper, body, unit(-0.3f, 0.3f, 1)));
  CHECK_FALSE(angles_allow(s, upper, body, unit(0, -1, 0)));
  CHECK_FALSE(angles_allow(s, upper, body, unit(1, 0, 0)));
  // The arm held out to the side: the forearm may go ahead and not far back.
  const Eigen::Matrix3f follow = frame_of_followers(upper, body, unit(-1, 0, 0));
  CHECK(angles_allow(s, lower, follow, unit(-1, 0, 0)));
  CHECK(angles_allow(s, lower, follow, unit(0, 1, 0)));
  CHECK_FALSE(angles_allow(s, lower, follow, unit(0, -1, 0)));
  // Turned with the body.
  const Eigen::Matrix3f half = rotation_about_vertical(std::numbers::pi);
  CHECK_FALSE(angles_allow(s, upper, half, unit(0, 1, 0)));
  CHECK(angles_allow(s, upper, half, unit(0, -1, 0)));
}

TEST_CASE("the swing is the shortest rotation, its axis across the link") {
  const Vector3f down = -Vector3f::UnitZ();
  CHECK(swing(down, down).norm() == 0);
  CHECK((swing(down, Vector3f::UnitY()) - Vector3f(1.570796f, 0, 0)).norm() < 1e-5f);
  CHECK(swing(down, Vector3f::UnitZ()).norm() == doctest::Approx(std::numbers::pi));
}

TEST_CASE("validation: a link half as long again as the mean of the others is none (Eq. 3.11)") {
  const Skeleton skeleton = shipped("crane");
  std::vector<Vector3f> joints;
  bones(skeleton, 0, {0, 2, 1.7f}, joints);
  Fit fit;
  for (size_t i = 0; i < joints.size(); ++i) fit.ends[i] = joints[i], fit.fitted[i] = true;
  CHECK(is_valid(skeleton, {}, fit));
  Fit large = fit;
  for (Vector3f& end : large.ends) end *= 1.25f;  // all of it larger: the mean goes along
  CHECK(is_valid(skeleton, {}, large));
  fit.ends[skeleton.link("rope")] += Vector3f(0, 0, -0.25f);
  CHECK_FALSE(is_valid(skeleton, {}, fit));
}

TEST_CASE("rotations are all tried, far from one another first") {
  for (const int n : {1, 2, 3, 4, 6, 11, 12, 36}) {
    std::set<int> seen;
    for (int i = 0; i < n; ++i) seen.insert(rotation_at(i, n));
    CHECK(seen.size() == static_cast<size_t>(n));
  }
  CHECK(rotation_at(1, 11) == 4);
}

TEST_CASE("what no point shows may be behind one, a nominal length from its start") {
  Link link;
  link.length_m = 0.3;
  const LinkTask task = make_task(link, {0.2f, 2, 1.4f}, Eigen::Matrix3f::Identity(), {0, -1, 0});
  const Vector3f eye(0, 0, 1.2f), hand(0.15f, 1.5f, 1.35f);
  const FitParameters p;
  const HiddenEnds behind = hidden_ends(p, task, eye, hand);
  REQUIRE(behind.count == 2);
  for (const Vector3f& end : behind.ends) {
    CHECK((end - task.start).norm() == doctest::Approx(0.3));
    CHECK((end - hand).norm() >= p.behind_m);
    CHECK((end - eye).normalized().dot((hand - eye).normalized()) == doctest::Approx(1));
  }
  // A hand held out at the eye covers an arm; one that is lifted beside the head does not cover the arm that hangs.
  const std::vector<Point> arm{{0.19f, 1.9f, 1.39f}, {0.17f, 1.7f, 1.37f}, {0.15f, 1.5f, 1.35f}};
  const Cluster cluster{arm, task.start, 0, eye};
  CHECK(is_covered(p, cluster, task, {0.19f, 1.7f, 1.39f}));
  CHECK_FALSE(is_covered(p, cluster, task, {0.2f, 2, 1.1f}));
  CHECK(hidden_ends(p, task, eye, behind.ends[0]).count == 1);       // what is seen there hides only the far one
  CHECK(hidden_ends(p, task, eye, {0.2f, 3, 1.4f}).count == 0);      // all that it hides is too far
  CHECK(hidden_ends(p, task, eye, {0.9f, 1.5f, 1.35f}).count == 0);  // a line of sight that passes by
}

TEST_CASE("a fit that is told to end gives its best so far") {
  const Skeleton skeleton = shipped("human");
  FitParameters p;
  Fitter fitter(skeleton, p, 1000);
  std::vector<Vector3f> joints;
  const std::vector<Point> points = bones(skeleton, 3, {0, 2, 1.6f}, joints);
  const Cluster cluster{points, {0, 2, 1.6f}, reference_density(points, p.tube_m)};
  int asked = 0;
  const Fit some = fitter.fit(cluster, [&] { return ++asked < 3; });
  CHECK(some.searched == doctest::Approx(3.0 / 11));
  CHECK(some.error >= fitter.fit(cluster, kWithoutEnd).error);
}
