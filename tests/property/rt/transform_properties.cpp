// SPDX-License-Identifier: Apache-2.0
// The transform buffer against an obvious reference: rotation matrices, linear search, numerical derivatives.
#include <doctest/doctest.h>

#include <Eigen/Core>
#include <Eigen/Eigenvalues>
#include <Eigen/Geometry>
#include <cmath>
#include <functional>
#include <map>
#include <random>

#include "rt/msg/geometry.hpp"
#include "rt/transform/transform_buffer.hpp"
#include "tests/property_scale.hpp"

using namespace takt;

namespace {

using Vector6 = Eigen::Matrix<double, 6, 1>;
using Matrix6 = Eigen::Matrix<double, 6, 6, Eigen::RowMajor>;

struct Rigid {
  Eigen::Matrix3d r = Eigen::Matrix3d::Identity();
  Eigen::Vector3d t = Eigen::Vector3d::Zero();
};

/// Rodrigues' formula.
Eigen::Matrix3d exponential(const Eigen::Vector3d& v) {
  const double angle = v.norm();
  if (angle < 1e-12) return Eigen::Matrix3d::Identity();
  Eigen::Matrix3d k;
  k << 0, -v.z(), v.y(), v.z(), 0, -v.x(), -v.y(), v.x(), 0;
  k /= angle;
  return Eigen::Matrix3d::Identity() + std::sin(angle) * k + (1 - std::cos(angle)) * k * k;
}

Eigen::Vector3d logarithm(const Eigen::Matrix3d& r) {
  const double angle = std::acos(std::clamp((r.trace() - 1) / 2, -1.0, 1.0));
  if (angle < 1e-9) return Eigen::Vector3d(r(2, 1) - r(1, 2), r(0, 2) - r(2, 0), r(1, 0) - r(0, 1)) / 2;
  return angle / (2 * std::sin(angle)) * Eigen::Vector3d(r(2, 1) - r(1, 2), r(0, 2) - r(2, 0), r(1, 0) - r(0, 1));
}

Rigid rigid(const Transform& t) {
  const double w = t.qw, x = t.qx, y = t.qy, z = t.qz;
  Rigid out;
  out.r << 1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y), 2 * (x * y + w * z),
      1 - 2 * (x * x + z * z), 2 * (y * z - w * x), 2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y);
  out.t = {t.x, t.y, t.z};
  return out;
}

Rigid operator*(const Rigid& a, const Rigid& b) { return {a.r * b.r, a.t + a.r * b.t}; }
Rigid inverse_of(const Rigid& a) { return {a.r.transpose(), -(a.r.transpose() * a.t)}; }

/// The error model of pose_math.hpp, applied.
Rigid disturbed(const Rigid& mean, const Vector6& error) {
  return {exponential(error.tail<3>()) * mean.r, mean.t + error.head<3>()};
}
Vector6 error_of(const Rigid& pose, const Rigid& mean) {
  Vector6 error;
  error << pose.t - mean.t, logarithm(pose.r * mean.r.transpose());
  return error;
}

/// d error(f) / d error(input), by central differences.
Matrix6 jacobian(const std::function<Rigid(const Rigid&)>& f, const Rigid& at) {
  Matrix6 j;
  constexpr double h = 1e-5;
  const Rigid mean = f(at);
  for (int i = 0; i < 6; ++i) {
    const Vector6 step = Vector6::Unit(i) * h;
    j.col(i) = (error_of(f(disturbed(at, step)), mean) - error_of(f(disturbed(at, -step)), mean)) / (2 * h);
  }
  return j;
}

Matrix6 covariance(const UncertainPose& p) { return Eigen::Map<const Matrix6>(p.covariance.data()); }

struct RandomPose {
  std::mt19937 engine;
  explicit RandomPose(uint64_t seed) : engine(seed) {}
  double uniform(double low, double high) { return low + (high - low) * static_cast<double>(engine()) / 4294967296.0; }
  int64_t below(int64_t n) { return static_cast<int64_t>(engine() % static_cast<uint64_t>(n)); }
  UncertainPose pose() {
    UncertainPose p;
    p.transform = {uniform(-5, 5), uniform(-5, 5), uniform(-5, 5), uniform(-1, 1),
                   uniform(-1, 1), uniform(-1, 1), uniform(-1, 1)};
    Matrix6 a;
    for (int i = 0; i < 36; ++i) a.data()[i] = uniform(-0.1, 0.1);
    Eigen::Map<Matrix6>(p.covariance.data()) = a * a.transpose();
    return normalised(p);
  }
};

void check_equal(const UncertainPose& got, const Rigid& mean, const Matrix6& expected) {
  const Rigid r = rigid(got.transform);
  CHECK((r.t - mean.t).norm() < 1e-9);
  CHECK((r.r - mean.r).norm() < 1e-9);
  const Matrix6 c = covariance(got);
  CHECK((c - expected).norm() < 1e-6 * (1 + expected.norm()));
  CHECK((c - c.transpose()).cwiseAbs().maxCoeff() == 0);
  CHECK(std::abs(got.transform.qw * got.transform.qw + got.transform.qx * got.transform.qx +
                 got.transform.qy * got.transform.qy + got.transform.qz * got.transform.qz - 1) < 1e-12);
}

}  // namespace

TEST_CASE("composition and inverse agree with matrices and numerical derivatives") {
  RandomPose random(test::seed(1));
  for (int i = 0; i < test::rounds(300); ++i) {
    const UncertainPose a = random.pose(), b = random.pose();
    const Rigid ra = rigid(a.transform), rb = rigid(b.transform);
    const Matrix6 ja = jacobian([&](const Rigid& x) { return x * rb; }, ra);
    const Matrix6 jb = jacobian([&](const Rigid& x) { return ra * x; }, rb);
    check_equal(compose(a, b), ra * rb, ja * covariance(a) * ja.transpose() + jb * covariance(b) * jb.transpose());
    const Matrix6 ji = jacobian([](const Rigid& x) { return inverse_of(x); }, ra);
    check_equal(inverse(a), inverse_of(ra), ji * covariance(a) * ji.transpose());
  }
}

TEST_CASE("composition is associative and the inverse of the inverse is the pose") {
  RandomPose random(test::seed(2));
  for (int i = 0; i < test::rounds(300); ++i) {
    const UncertainPose a = random.pose(), b = random.pose(), c = random.pose();
    const UncertainPose left = compose(compose(a, b), c);
    check_equal(compose(a, compose(b, c)), rigid(left.transform), covariance(left));
    check_equal(inverse(inverse(a)), rigid(a.transform), covariance(a));
  }
}

TEST_CASE("interpolation agrees with the exponential map and is an upper bound of the uncertainty") {
  RandomPose random(test::seed(3));
  for (int i = 0; i < test::rounds(300); ++i) {
    const UncertainPose a = random.pose(), b = random.pose();
    const Rigid ra = rigid(a.transform), rb = rigid(b.transform);
    const Eigen::Vector3d turn = logarithm(rb.r * ra.r.transpose());
    if (turn.norm() > 3.1) continue;  // the shorter arc is not unique at pi
    const double s = random.uniform(0, 1);
    const UncertainPose got = interpolate(a, b, s);
    const Rigid expected{exponential(s * turn) * ra.r, (1 - s) * ra.t + s * rb.t};
    check_equal(got, expected, (1 - s) * covariance(a) + s * covariance(b));
    const Matrix6 independent = (1 - s) * (1 - s) * covariance(a) + s * s * covariance(b);
    const Matrix6 spare = covariance(got) - independent;
    CHECK(Eigen::SelfAdjointEigenSolver<Eigen::Matrix<double, 6, 6>>(spare).eigenvalues().minCoeff() > -1e-12);
  }
}

TEST_CASE("a track answers as a linear search over all it was given would") {
  for (uint32_t seed = 10; seed < 10 + test::rounds(10u); ++seed) {
    RandomPose random(test::seed(seed));
    const auto capacity = static_cast<size_t>(1 + random.below(8));
    const int64_t gap = 1 + random.below(30);
    PoseTrack track(capacity, gap);
    std::map<int64_t, UncertainPose> kept;
    for (int step = 0; step < 500; ++step) {
      const int64_t stamp = step + random.below(40);
      const UncertainPose pose = random.pose();
      const InsertResult result = track.insert(stamp, pose);
      if (kept.count(stamp) != 0) {
        CHECK(result == InsertResult::replaced);
        kept[stamp] = pose;
      } else if (kept.size() == capacity && stamp < kept.begin()->first) {
        CHECK(result == InsertResult::out_of_range);
      } else {
        CHECK(result == InsertResult::inserted);
        kept[stamp] = pose;
        if (kept.size() > capacity) kept.erase(kept.begin());
      }
      REQUIRE(track.size() == kept.size());
      const int64_t asked = step + random.below(60) - 10;
      const auto got = track.at(asked);
      const int64_t oldest = kept.begin()->first, newest = kept.rbegin()->first;
      if (asked < oldest) {
        CHECK(got.error().problem == TransformProblem::too_old);
      } else if (asked > newest) {
        CHECK(got.error().problem == TransformProblem::too_new);
      } else if (kept.count(asked) != 0) {
        REQUIRE(got);
        check_equal(*got, rigid(kept[asked].transform), covariance(kept[asked]));
      } else {
        int64_t before = oldest, after = newest;
        for (const auto& [s, p] : kept) {
          if (s < asked) before = s;
          if (s > asked && s < after) after = s;
        }
        if (after - before > gap) {
          CHECK(got.error().problem == TransformProblem::gap_too_long);
        } else {
          REQUIRE(got);
          const UncertainPose expected = interpolate(
              kept[before], kept[after], static_cast<double>(asked - before) / static_cast<double>(after - before));
          check_equal(*got, rigid(expected.transform), covariance(expected));
        }
      }
    }
  }
}

TEST_CASE("any two frames of a random tree are joined as their matrices say") {
  for (uint32_t seed = 30; seed < 30 + test::rounds(30u); ++seed) {
    RandomPose random(test::seed(seed));
    TransformBuffer buffer;
    constexpr int kFrames = 8;
    std::vector<Rigid> in_root(kFrames);
    for (int i = 0; i < kFrames; ++i) {
      const FrameId child = buffer.frame("frame " + std::to_string(i));
      if (i == 0) continue;
      const auto parent = static_cast<FrameId>(random.below(i));
      const UncertainPose pose = random.pose();
      if (random.below(3) == 0) {
        buffer.add_fixed(parent, child, pose);
      } else {
        buffer.add(parent, child, 2, 1000);
        buffer.insert(child, 0, pose);
        buffer.insert(child, 1000, pose);
      }
      in_root[static_cast<size_t>(i)] = in_root[parent] * rigid(pose.transform);
    }
    for (FrameId target = 0; target < kFrames; ++target)
      for (FrameId source = 0; source < kFrames; ++source) {
        const auto got = buffer.lookup(target, source, 500);
        REQUIRE(got);
        const Rigid expected = inverse_of(in_root[target]) * in_root[source];
        const Rigid r = rigid(got->transform);
        CHECK((r.t - expected.t).norm() < 1e-9);
        CHECK((r.r - expected.r).norm() < 1e-9);
        const auto back = buffer.lookup(source, target, 500);
        REQUIRE(back);
        check_equal(inverse(*back), expected, covariance(*got));
      }
  }
}
