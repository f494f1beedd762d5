// SPDX-License-Identifier: Apache-2.0
// What the quality controller promises, on random nodes and loads.
#include <doctest/doctest.h>

#include <algorithm>
#include <random>
#include <vector>

#include "rt/sched/quality.hpp"
#include "tests/property_scale.hpp"

namespace {

using namespace takt;
constexpr int64_t kSecond = QualityControl::kSecond;

struct QualityScene {
  std::vector<QualityLevel> levels{{"0", 1.0}};
  int64_t period_ns = 0, budget_ns = 0, deadline_ns = 0;
};

class RandomLoad {
 public:
  explicit RandomLoad(uint64_t seed) : engine_(seed) {}
  double uniform(double low, double high) { return std::uniform_real_distribution<double>(low, high)(engine_); }
  int whole(int low, int high) { return std::uniform_int_distribution<int>(low, high)(engine_); }
  QualityScene scene() {
    QualityScene s;
    const int levels = whole(2, static_cast<int>(kMaxLevels));
    for (int l = 1; l < levels; ++l) s.levels.push_back({"worse", s.levels.back().cost * uniform(0.2, 0.8)});
    s.period_ns = static_cast<int64_t>(1e9 / uniform(0.5, 60));
    s.deadline_ns = static_cast<int64_t>(static_cast<double>(s.period_ns) * uniform(0.5, 1));
    s.budget_ns = static_cast<int64_t>(static_cast<double>(s.deadline_ns) * uniform(0.1, 1));
    return s;
  }

 private:
  std::mt19937_64 engine_;
};

/// A run of jobs whose CPU time at level 0 is `load` in parts of the budget.
class Run {
 public:
  explicit Run(const QualityScene& scene)
      : scene_(scene), control_(scene_.levels, scene_.budget_ns, scene_.deadline_ns) {}
  int level() const { return control_.level(); }
  int64_t now_ns() const { return jobs_ * scene_.period_ns; }
  void job(double load) {
    const int before = level();
    const double cost = scene_.levels[static_cast<size_t>(before)].cost;
    const auto exec_ns = static_cast<int64_t>(load * cost * static_cast<double>(scene_.budget_ns));
    overruns += exec_ns > scene_.budget_ns;
    control_.observe({now_ns(), exec_ns, exec_ns, false});
    REQUIRE(level() >= 0);
    REQUIRE(level() < static_cast<int>(scene_.levels.size()));
    raises += level() < before;
    lowers += level() > before;
    ++jobs_;
  }
  int overruns = 0, raises = 0, lowers = 0;

 private:
  const QualityScene scene_;
  QualityControl control_;
  int64_t jobs_ = 0;
};

}  // namespace

TEST_CASE("level 0 stays as long as the largest load plus half of the range fits") {
  RandomLoad random(test::seed(1));
  for (int round = 0; round < test::rounds(300); ++round) {
    Run run(random.scene());
    const double range = random.uniform(0, 0.6), top = 1 - range / 2;
    for (int k = 0; k < 2000; ++k) {
      run.job(random.uniform(top - range, top));
      REQUIRE(run.level() == 0);
    }
  }
}

TEST_CASE("a constant load with 5 % of noise settles: no level is taken back and left again but blindly") {
  RandomLoad random(test::seed(2));
  for (int round = 0; round < test::rounds(300); ++round) {
    const QualityScene scene = random.scene();
    Run run(scene);
    for (int k = random.whole(0, 20); k > 0; --k) run.job(random.uniform(0, 3));  // whatever went before
    const double load = random.uniform(0.1, 4);
    const int64_t wait = std::max(QualityControl::kBlind, QualityControl::kBlindJobs * scene.period_ns);
    const auto settle = static_cast<int>(6 * kSecond / scene.period_ns) + 20;
    for (int k = 0; k < settle; ++k) run.job(load * random.uniform(0.95, 1.05));
    const int raises = run.raises, lowers = run.lowers, overruns = run.overruns;
    const int64_t begin = run.now_ns();
    for (int k = 0; k < 3000; ++k) run.job(load * random.uniform(0.95, 1.05));
    const auto blind = static_cast<int>((run.now_ns() - begin) / wait) + 1;
    CAPTURE(load);
    CHECK(run.raises - raises <= 2 * blind);  // a blind raise that fails may first fall too deep
    CHECK(run.lowers - lowers <= blind);
    if (load * scene.levels.back().cost < 0.95) CHECK(run.overruns - overruns <= blind);
  }
}

TEST_CASE("after any past, a load that fits brings level 0 back within the stated bounds") {
  RandomLoad random(test::seed(3));
  for (int round = 0; round < test::rounds(500); ++round) {
    const QualityScene scene = random.scene();
    Run run(scene);
    const double worst = random.uniform(0.5, 5);
    for (int k = random.whole(1, 3000); k > 0; --k) run.job(random.uniform(0, worst));
    const double load = random.uniform(0, QualityControl::kRaiseAt);
    const int64_t begin = run.now_ns(), period = scene.period_ns;
    while (run.level() != 0) {
      run.job(load);
      REQUIRE(run.now_ns() - begin <= std::max({QualityControl::kLongestBar, QualityControl::kHold + period,
                                                QualityControl::kHoldJobs * period}) +
                                          2 * period);
    }
    const int64_t end = run.now_ns();
    if (period * 2 <= kSecond) CHECK(end - begin <= 5 * kSecond);
    for (int k = 0; k < 500; ++k) run.job(load);
    CHECK(run.level() == 0);
  }
}

TEST_CASE(
    "whatever the load does, level 0 is left at most once in a bar, and failing again and again makes it longer") {
  RandomLoad random(test::seed(4));
  for (int round = 0; round < test::rounds(200); ++round) {
    Run run(random.scene());
    const double low = random.uniform(0, 1), high = random.uniform(1, 3), share = random.uniform(0, 0.3);
    int64_t left_ns = -kSecond * 100, taken_ns = left_ns;
    int in_a_row = 0;
    for (int k = 0; k < 3000; ++k) {
      const int before = run.level();
      const int64_t now = run.now_ns();
      run.job(random.uniform(0, 1) < share ? high : low);
      if (before != 0 && run.level() == 0) taken_ns = now;
      if (before != 0 || run.level() == 0) continue;
      const int64_t bars[] = {QualityControl::kFirstBar, 2 * QualityControl::kFirstBar, QualityControl::kLongestBar};
      REQUIRE(now - left_ns >= bars[std::min(in_a_row, 2)]);
      in_a_row = now - taken_ns < QualityControl::kSettled ? in_a_row + 1 : 0;
      left_ns = now;
    }
  }
}
