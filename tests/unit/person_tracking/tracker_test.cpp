// SPDX-License-Identifier: Apache-2.0
#include <doctest/doctest.h>

#include <vector>

#include "nodes/person_tracking/follower.hpp"
#include "nodes/person_tracking/person_tracker.hpp"
#include "rt/msg/velocity_command.hpp"

using namespace takt;
using namespace takt::person_tracking;

namespace {

constexpr int64_t kFrame_ns = 66'666'666;

Place at(double x, double y) { return {{x, y}, 0.01 * Eigen::Matrix2d::Identity(), true}; }

/// Steps frame after frame.
struct Run {
  PersonTracker tracker{TrackerParameters{}};
  int64_t now_ns = 0;
  void step(const std::vector<Place>& shirts, const std::vector<Place>& bodies = {}) {
    tracker.step(now_ns += kFrame_ns, shirts, bodies);
  }
  /// A person walks along x at a metre a second for so many frames.
  double walk(int frames) {
    double x = 0;
    for (int i = 0; i < frames; ++i) step({at(x = 0.0667 * i, 3)});
    return x;
  }
};

}  // namespace

TEST_CASE("a shirt counts after three images in a row, once") {
  Run run;
  run.step({at(0, 3)});
  run.step({at(0, 3)});
  CHECK(run.tracker.active());
  CHECK_FALSE(run.tracker.tracked());
  run.step({});
  CHECK_FALSE(run.tracker.active());
  for (int i = 0; i < 3; ++i) run.step({at(0, 3)});
  CHECK(run.tracker.tracked());
  CHECK(run.tracker.number() == 1);
}

TEST_CASE("a pattern whose size and disparities disagree goes on with a track, but begins none") {
  Run run;
  Place unsure = at(0, 3);
  unsure.sure = false;
  for (int i = 0; i < 5; ++i) run.step({unsure});
  CHECK_FALSE(run.tracker.active());
  run.step({unsure, at(0, 3)});
  CHECK(run.tracker.shirt() == 1);
  run.step({unsure});
  run.step({unsure});
  CHECK(run.tracker.tracked());
  for (int i = 0; i < 5; ++i) run.step({});
  run.step({unsure});  // who was hidden is not found again by it
  CHECK(run.tracker.sight() == Sight::none);
  run.step({at(0, 3)});
  CHECK(run.tracker.sight() == Sight::shirt);
}

TEST_CASE("who walks behind something is continued at his speed, and lost after a second") {
  Run run;
  const double x = run.walk(30);
  CHECK(run.tracker.estimate().velocity().x() == doctest::Approx(1).epsilon(0.05));
  for (int i = 0; i < 14; ++i) run.step({});
  CHECK(run.tracker.tracked());
  CHECK(run.tracker.sight() == Sight::none);
  CHECK(run.tracker.estimate().position().x() == doctest::Approx(x + 14.0 / 15).epsilon(0.05));
  CHECK(run.tracker.unseen_s(run.now_ns) == doctest::Approx(14.0 / 15));
  run.step({});
  run.step({});
  CHECK_FALSE(run.tracker.tracked());
}

TEST_CASE("another shirt does not take the place of the one that is followed") {
  Run run;
  const double x = run.walk(30);
  run.step({at(-2, 4), at(x + 0.0667, 3)});
  CHECK(run.tracker.shirt() == 1);
  run.step({at(-2, 4)});
  CHECK(run.tracker.sight() == Sight::none);
  CHECK((run.tracker.estimate().position() - Eigen::Vector2d(x + 0.133, 3)).norm() < 0.1);
}

TEST_CASE("a body near by holds a person whose shirt is hidden, but not for ever; alone it begins nothing") {
  Run run;
  for (int i = 0; i < 5; ++i) run.step({}, {at(0, 3)});
  CHECK_FALSE(run.tracker.active());
  run.walk(30);
  const Eigen::Vector2d there = run.tracker.estimate().position();
  int held = 0;
  for (int i = 0; i < 60; ++i) {
    run.step({}, {at(there.x(), there.y()), at(there.x() + 2, there.y())});
    held += run.tracker.tracked() ? 1 : 0;
  }
  CHECK(held == 45);  // three seconds
  CHECK_FALSE(run.tracker.tracked());
}

TEST_CASE("without images time passes all the same") {
  Run run;
  run.walk(10);
  run.tracker.wait(run.now_ns + 900'000'000);
  CHECK(run.tracker.tracked());
  run.tracker.wait(run.now_ns + 1'100'000'000);
  CHECK_FALSE(run.tracker.tracked());
}

TEST_CASE("the set-point: none at the distance kept, limited, left turns positive, never backwards") {
  const FollowerParameters p;
  const auto is = [](const VelocityCommand& c, double v, double w) {
    CHECK(c.speed_m_s == doctest::Approx(v));
    CHECK(c.turn_rad_s == doctest::Approx(w));
  };
  is(set_point(p, 0, 1.5), 0, 0);
  is(set_point(p, 0, 2), 0.4, 0);
  is(set_point(p, 0, 9), 0.8, 0);
  is(set_point(p, 0, 0.5), 0, 0);
  is(set_point(p, -0.2, 1.4866), 0, 1.5 * std::atan2(0.2, 1.4866));
  is(set_point(p, 3, 0), 0.8, -0.8);
}
