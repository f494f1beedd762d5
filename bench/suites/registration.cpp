// SPDX-License-Identifier: Apache-2.0
// A generation of genetic ICP is one evaluation of a pose and one fit. Here it stands against the same with a kd-tree,
// built once. And the longest that the node laser_fusion works without a look at what is left of its budget.
#include <cstdio>

#include "bench/interleaved.hpp"
#include "bench/kd_tree.hpp"
#include "bench/suite.hpp"
#include "nodes/laser_fusion/generated_pair.hpp"
#include "nodes/laser_fusion/genetic_icp.hpp"
#include "nodes/laser_fusion/laser_fusion.hpp"
#include "nodes/laser_fusion/matcher.hpp"
#include "rt/msg/point.hpp"
#include "rt/time/clock.hpp"

namespace takt::bench {

std::vector<Row> run_registration(const Options& options);

namespace {

using namespace laser_fusion;

constexpr uint32_t kGenerations = 2000, kEvaluations = 400;
constexpr size_t kLaserPoints = 20'000, kVisionPoints = 76'800;  // of the node

template <class Work>
double per_second(uint32_t count, Work work) {
  const int64_t begin = thread_cpu_ns();
  work();
  return count / (static_cast<double>(thread_cpu_ns() - begin) * 1e-9);
}

/// Judges a pose as Matcher does, its neighbours found by a kd-tree of the moving cloud.
class KdTreeMatcher {
 public:
  explicit KdTreeMatcher(const CloudPair& pair)
      : fixed_(pair.laser.points),
        moving_{pair.vision.points},
        tree_(3, moving_, nanoflann::KDTreeSingleIndexAdaptorParams(10)),
        nearest_(fixed_.size()) {
    tree_.buildIndex();
  }
  Quality evaluate(const Rigid& moving_in_fixed) {
    const Eigen::Matrix3f r = moving_in_fixed.R.transpose().cast<float>();
    const Eigen::Vector3f t = moving_in_fixed.t.cast<float>();
    for (size_t i = 0; i < fixed_.size(); ++i) {
      const Eigen::Vector3f place = r * (Eigen::Vector3f(fixed_[i].x, fixed_[i].y, fixed_[i].z) - t);
      tree_.knnSearch(place.data(), 1, &nearest_[i].index, &nearest_[i].distance2);
    }
    return judge({fixed_, moving_.points, nearest_}, {}, sums_);
  }
  const PairSums& pairs() const { return sums_; }

 private:
  std::span<const Point> fixed_;
  KdTreePoints moving_;
  KdTree tree_;
  std::vector<Nearest> nearest_;
  PairSums sums_;
};

/// Poses as a search has them: a mutation of the true one, and the ICP steps from there.
std::vector<Rigid> poses_of(const CloudPair& pair, Matcher& matcher) {
  std::vector<Rigid> poses;
  std::mt19937_64 random(3);
  std::uniform_real_distribution<> share(-1, 1);
  while (poses.size() < kEvaluations) {
    PoseParameters pose = to_parameters(pair.vision_in_laser);
    const size_t mutated = random() % 6;
    pose[mutated] += GeneticParameters{}.mutation[mutated] * share(random);
    for (int step = 0; step < 20; ++step) {
      poses.push_back(to_rigid(pose));
      if (matcher.evaluate(poses.back()); matcher.pairs().pairs < kLeastPairs) break;
      pose = fit_rigid(matcher.pairs(), pose, {});
    }
  }
  poses.resize(kEvaluations);
  return poses;
}

template <class AnyMatcher>
double evaluations_per_second(AnyMatcher& matcher, const std::vector<Rigid>& poses, double& checksum) {
  checksum = 0;
  return per_second(kEvaluations, [&] {
    for (const Rigid& pose : poses) {
      checksum += matcher.evaluate(pose).score;
      if (matcher.pairs().pairs >= kLeastPairs) checksum += fit_rigid(matcher.pairs()).t.x();
    }
  });
}

void add(std::vector<Row>& rows, const std::string& name, const Compared& compared) {
  Row row{"registration/" + name, "1/s", 0, {}, {}, {}, {}, "one thread"};
  row.samples = compared.changed;
  add_pair(rows, std::move(row), "nanoflann", compared.pairs);
}

/// What laser_fusion does between two questions whether to go on: taking a pair of clouds, and each portion after it.
void add_portions(std::vector<Row>& rows, size_t rounds) {
  const auto row = [](const char* name) {
    return Row{std::string("registration/fusion/") + name, "ms", 0, {}, {}, {}, {}, "one thread, CPU time"};
  };
  Row taking = row("taking"), portion = row("portion");
  const CloudPair pair = generate_pair({.points = kVisionPoints, .offset_m = 0.3, .offset_rad = 0.3}, 1);
  const auto laser = std::span(pair.laser.points).first(kLaserPoints);
  LaserFusion fusion(kLaserPoints, kVisionPoints, {.genetic = {.generations = kGenerations}});
  for (size_t round = 0; round < rounds; ++round) {
    taking.samples.add(cpu_ms([&] { fusion.begin(laser, pair.vision.view(), {}, round); }));
    int64_t asked_ns = thread_cpu_ns();
    bool first = true;
    const auto asked = [&] {
      const int64_t now_ns = thread_cpu_ns();
      if (!first) portion.samples.add(static_cast<double>(now_ns - asked_ns) * 1e-6);
      first = false;
      asked_ns = now_ns;
      return true;
    };
    fusion.run(asked);
    asked();
    fusion.finish();
  }
  for (Row* r : {&taking, &portion}) {
    r->value = r->samples.quantile(0.5).value_or(0);
    rows.push_back(std::move(*r));
  }
}

}  // namespace

std::vector<Row> run_registration(const Options& options) {
  const auto rounds = static_cast<size_t>(options.rounds_or(20));
  const CloudPair pair = generate_pair({}, 1);
  Matcher matcher(pair.laser.points.size(), pair.vision.points.size(), {});
  matcher.set(pair.laser.points, pair.vision.points);
  KdTreeMatcher kd_tree(pair);
  const std::vector<Rigid> poses = poses_of(pair, matcher);
  std::vector<Row> rows;
  double ours = 0, theirs = 0;
  const auto reference = [&] { return evaluations_per_second(kd_tree, poses, theirs); };

  std::fprintf(stderr, "registration: evaluation and fit, %zu rounds\n", rounds);
  add(rows, "evaluations/1000+1000",
      compare(rounds, reference, [&] { return evaluations_per_second(matcher, poses, ours); }));
  if (!(std::abs(ours - theirs) < 1e-3 * std::abs(theirs)))  // Eigen rounds another way than the table's transform
    throw std::runtime_error("registration: the table and nanoflann find different neighbours");

  std::fprintf(stderr, "registration: generations, %zu rounds\n", rounds);
  GeneticIcp genetic(matcher, {.generations = kGenerations});
  uint64_t seed = 0;
  add(rows, "generations/1000+1000", compare(rounds, reference, [&] {
        genetic.begin({}, ++seed);
        return per_second(kGenerations, [&] { genetic.run([] { return true; }); });
      }));

  std::fprintf(stderr, "registration: portions of laser_fusion, %zu rounds\n", rounds);
  add_portions(rows, rounds);
  return rows;
}

}  // namespace takt::bench
