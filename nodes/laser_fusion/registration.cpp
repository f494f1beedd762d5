// SPDX-License-Identifier: Apache-2.0
#include "nodes/laser_fusion/registration.hpp"

#include <algorithm>
#include <stdexcept>

#include "nodes/cloud/count_kernel.hpp"
#include "nodes/laser_fusion/clusters.hpp"
#include "nodes/laser_fusion/generalised_icp.hpp"
#include "nodes/laser_fusion/icp.hpp"
#include "nodes/laser_fusion/thinning.hpp"

namespace takt::laser_fusion {
namespace {

constexpr size_t kMostPoints = 40'000, kVoxels = size_t{1} << 20;  // of a refinement
constexpr double kCutOfSpacing = 1.25, kLastCutOfSpacing = 3, kLinkOfSpacing = 3;
constexpr float kFinest = 1e-3f;  // voxels that are tried first, in extents of the cloud

std::vector<Point> thinned(const cloud::CloudView& cloud, size_t points) {
  cloud::VoxelGrid grid(cloud.points.size());
  std::vector<Point> out(points);
  cloud::CloudBuffer buffer(out, {});
  const cloud::Bounds bounds = cloud::bounds_of(cloud.points, cloud::kFarthest_m);
  float extent_m = 1e-3f;
  for (int a = 0; bounds.points > 0 && a < 3; ++a) extent_m = std::max(extent_m, bounds.high[a] - bounds.low[a]);
  thin_out({cloud.points, {}}, kFinest * extent_m, grid, buffer);
  out.resize(buffer.size());
  return out;
}

}  // namespace

Registration::Registration(const cloud::CloudView& fixed, const cloud::CloudView& moving,
                           const RegistrationParameters& parameters)
    : parameters_(parameters), fixed_(thinned(fixed, kMostPoints)), moving_(thinned(moving, kMostPoints)) {
  std::vector<Point> few_fixed = thinned({fixed_, {}}, parameters.points);
  std::vector<Point> few_moving = thinned({moving_, {}}, parameters.points);
  const double spacing_m = std::max(spacing_of(few_fixed), spacing_of(few_moving));
  QualityParameters quality{.metric = parameters.metric};
  quality.cut_m = parameters.cut_m > 0 ? parameters.cut_m : kCutOfSpacing * spacing_m;
  last_cut_m_ = std::min(quality.cut_m, kLastCutOfSpacing * std::max(spacing_of(fixed_), spacing_of(moving_)));
  ClusterFilter clusters(parameters.points);
  for (std::vector<Point>* points : {&few_fixed, &few_moving}) {
    points->resize(clusters.filter(*points, {kLinkOfSpacing * spacing_m, parameters.least_cluster}));
    if (points->size() < kLeastPairs)
      throw std::invalid_argument("has fewer than 6 points that are finite and hang together with others");
  }
  thinned_.emplace(few_fixed.size(), few_moving.size(), quality);
  thinned_->set(few_fixed, few_moving);
}

Rigid Registration::search(const Rigid& start) {
  GeneticIcp genetic(*thinned_, parameters_.genetic);
  genetic.begin(start, parameters_.seed);
  genetic.run([] { return true; });
  return genetic.best();
}

Rigid Registration::plain(const Rigid& start) {
  return icp(*thinned_, start, {.eps_conv = parameters_.genetic.eps_conv, .locks = parameters_.genetic.locks})
      .moving_in_fixed;
}

Rigid Registration::generalised(const Rigid& start) {
  GeneralisedIcp icp(*thinned_);
  const double last_m = cut_m();
  Rigid pose = start;
  for (const double times : {4.0, 2.0, 1.0}) {
    thinned_->set_cut(times * last_m);
    pose = icp.run(pose);
  }
  return pose;
}

Rigid Registration::refined(const Rigid& pose) {
  const QualityParameters quality{.cut_m = cut_m()};
  Matcher all(fixed_.size(), moving_.size(), quality, kVoxels);
  all.set(fixed_, moving_);
  Rigid best = pose;
  for (double cut_m = quality.cut_m;; cut_m = std::max(cut_m / 2, last_cut_m_)) {
    all.set_cut(cut_m);
    best = icp(all, best, {.eps_conv = 1e-5 * cut_m, .locks = parameters_.genetic.locks}).moving_in_fixed;
    if (cut_m <= last_cut_m_) return best;
  }
}

Quality Registration::judged_by_thesis(const Rigid& pose) {
  Matcher matcher(fixed_points(), moving_points(), {.metric = Metric::thesis});
  matcher.set(thinned_->fixed(), thinned_->moving());
  return matcher.evaluate(pose);
}

}  // namespace takt::laser_fusion
