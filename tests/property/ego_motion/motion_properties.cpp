// SPDX-License-Identifier: Apache-2.0
#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <random>
#include <string>
#include <vector>

#include "nodes/ego_motion/estimator.hpp"
#include "nodes/ego_motion/evaluate.hpp"
#include "nodes/ego_motion/motion_kernel.hpp"
#include "rt/transform/pose_math.hpp"
#include "tests/on_each_target.hpp"
#include "tests/property_scale.hpp"

using namespace takt;
using namespace takt::ego_motion;

namespace {

constexpr Optics kOptics{492.8, 0.24};

/// Points before a camera of 640 x 480, 1.5 to 10 m away, as two frames see them.
class Views {
 public:
  explicit Views(uint64_t seed) : random_(seed) {}
  double uniform(double low, double high) { return std::uniform_real_distribution<double>(low, high)(random_); }
  double normal(double sigma) { return std::normal_distribution<double>(0, sigma)(random_); }

  Rigid motion(double metres, double radians) {
    return {rotation({uniform(-radians, radians), uniform(-radians, radians), uniform(-radians, radians)}),
            {uniform(-metres, metres), uniform(-metres, metres), uniform(-metres, metres)}};
  }

  /// Noise of a standard deviation in px on everything but the place of the corner before, which defines the patch.
  std::vector<Observation> observe(const Rigid& T, int count, double noise_px, double outliers, double unmatched,
                                   double shared_px = 0) {
    std::vector<Observation> all;
    const double shared_x = normal(shared_px), shared_y = normal(shared_px), shared_d = normal(shared_px);
    while (all.size() < static_cast<size_t>(count)) {
      const double f = kOptics.focal_px, fB = f * kOptics.baseline_m, Z = uniform(1.5, 10);
      const Eigen::Vector3d before(uniform(-320, 320) * Z / f, uniform(-240, 240) * Z / f, Z), now = T * before;
      if (now.z() < 0.5) continue;
      Observation o{f * before.x() / Z,
                    f * before.y() / Z,
                    fB / Z + normal(noise_px),
                    f * now.x() / now.z() + normal(noise_px) + shared_x,
                    f * now.y() / now.z() + normal(noise_px) + shared_y,
                    fB / now.z() + normal(noise_px) + shared_d / kDisparityWeight};
      if (uniform(0, 1) < outliers) o.x_current += uniform(-40, 40), o.y_current += uniform(-40, 40);
      if (uniform(0, 1) < unmatched) o.d_current = -1;
      all.push_back(o);
    }
    return all;
  }

 private:
  std::mt19937 random_;
};

}  // namespace

TEST_CASE("sums over observations equal those of one after the other bit by bit on every SIMD target") {
  test::on_each_target([] {
    Views views(test::seed(21));
    for (int round = 0; round < test::rounds(60); ++round) {
      const Rigid T = views.motion(0.3, 0.1);
      const auto observations = views.observe(T, static_cast<int>(views.uniform(1, 70)), 0.3, 0.2, 0.2);
      ObservationTable table(observations.size());
      table.fill(observations, kOptics);
      Rigid other = views.motion(0.01, 0.002) * T;
      if (round % 7 == 0) other.t.z() -= 3;  // brings some behind the camera
      const Motion12 at = to_array(other);
      std::vector<double> fast_use(80), slow_use(80);
      const MotionKernels &fast = motion_kernels(), &slow = motion_references();
      fast.mark(table, at, 2, fast_use.data());
      slow.mark(table, at, 2, slow_use.data());
      for (size_t i = 0; i < observations.size(); ++i) CHECK(fast_use[i] == slow_use[i]);
      CHECK(fast.score(table, at, 1).cost == slow.score(table, at, 1).cost);
      CHECK(fast.score(table, at, 1).inside == slow.score(table, at, 1).inside);
      for (const double scale : {0.0, 0.5}) {
        const Weights weights{slow_use.data(), scale};
        CHECK(fast.normal(table, at, weights).matrix == slow.normal(table, at, weights).matrix);
        CHECK(fast.normal(table, at, weights).vector == slow.normal(table, at, weights).vector);
        CHECK(fast.scatter(table, at, weights).matrix == slow.scatter(table, at, weights).matrix);
        CHECK(fast.scatter(table, at, weights).shared == slow.scatter(table, at, weights).shared);
      }
    }
  });
}

TEST_CASE("a residual of the table is that of the observation") {
  Views views(test::seed(22));
  const auto observations = views.observe(views.motion(0.3, 0.1), 50, 0.3, 0.2, 0.2);
  ObservationTable table(observations.size());
  table.fill(observations, kOptics);
  for (int round = 0; round < test::rounds(20); ++round) {
    const Rigid T = views.motion(0.3, 0.1);
    const double limit = views.uniform(1, 30);
    size_t inside = 0;
    for (const Observation& o : observations) inside += residual_px(T, o, kOptics) < limit;
    CHECK(motion_references().score(table, to_array(T), limit).inside == inside);
  }
}

// A consistent normalised error squared of 6 parameters has the mean 6, and its mean over n independent runs the
// standard deviation sqrt(12 / n): 0.17 for 400 runs of a pose. The band is that +-3.3 times (99.9 %), and on top half
// as much again for what is first order only. A step's covariance is estimated from its own corners, and the inverse of
// an estimated covariance is too large in the mean: by n / (n - 7) for n effective corners (Hotelling), of which the
// weights leave about half. So the steps' band reaches up to 6 n / (n - 14). (Of a pose ten such covariances are added
// up.)
TEST_CASE("the stated covariance of a step and of the accumulated pose is consistent with the errors made") {
  struct Case {
    std::string name;
    int corners;
    double noise_px, outliers, unmatched, shared_px;
  };
  constexpr int kSteps = 10;
  const int runs = test::rounds(400);
  const double wider = std::sqrt(400.0 / runs);  // than with 400 runs
  for (const Case& c : {Case{"plain", 200, 0.15, 0, 0, 0}, Case{"noisy", 200, 0.3, 0, 0, 0},
                        Case{"fine", 200, 0.03, 0, 0, 0}, Case{"outliers, missing disparities", 200, 0.15, 0.3, 0.2, 0},
                        Case{"few corners", 40, 0.15, 0, 0, 0}, Case{"shared error", 200, 0.1, 0, 0, 0.05}}) {
    CAPTURE(c.name);
    Views views(test::seed(23));
    double step_mean = 0, pose_mean = 0;
    int unsolved = 0;
    EstimatorParameters parameters;
    parameters.shared_px = c.shared_px;
    MotionEstimator estimator(parameters, static_cast<size_t>(c.corners));
    for (int run = 0; run < runs; ++run) {
      UncertainPose pose;
      Rigid truth;
      for (int step = 0; step < kSteps;) {
        const Rigid T = views.motion(0.15, 0.1);
        const auto seen = views.observe(T, c.corners, c.noise_px, c.outliers, c.unmatched, c.shared_px);
        const Estimate e = estimator.estimate(seen, kOptics, {}, static_cast<uint64_t>(step));
        unsolved += !e.solved;
        if (!e.solved) continue;
        ++step;
        const UncertainPose moved = camera_in_previous(e);
        step_mean += normalised_error_squared(moved, T.inverse()) / (runs * kSteps);
        pose = compose(pose, moved);
        truth = truth * T.inverse();
      }
      pose_mean += normalised_error_squared(pose, truth) / runs;
    }
    MESSAGE(c.name << ": mean normalised error squared of a step " << step_mean << ", of a pose " << pose_mean << "; "
                   << unsolved << " steps without a motion");
    // No good sample was among those drawn: that often by design.
    CHECK(unsolved <= test::at_most(runs * kSteps, 1 - parameters.success));
    const double corners = c.corners * (1 - c.outliers);
    CHECK(step_mean > 6 - 0.5 * wider);
    CHECK(step_mean < (6 + 0.3 * wider) * corners / (corners - 14));
    CHECK(pose_mean > 6 - 0.9 * wider);
    CHECK(pose_mean < 6 + 0.9 * wider);
  }
}
