// SPDX-License-Identifier: Apache-2.0
// Fits a skeleton to a cluster of points: Alg. 3.3 with nothing done twice. What a link's fit depends on is where its
// parent ended and where the pose points it, so poses that agree so far share it; a candidate's density is counted only
// where its shape leaves it a chance, and among the points that can lie along it. Same fit as fit_reference(), bit by
// bit.
#pragma once
#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "nodes/body_pose/fit_rules.hpp"

namespace takt::body_pose {

class Fitter {
 public:
  /// Takes the memory for clusters of up to `most_points`; fit() allocates nothing.
  Fitter(const Skeleton& skeleton, const FitParameters& parameters, size_t most_points);
  /// From the next fit() on.
  void tune(const FitParameters& parameters) { p_ = parameters; }

  /// The best pose at the best rotation. Asks may_go_on() before each rotation but the first; when that says no, the
  /// best so far, with the share that was tried. At most most_points points.
  template <class MayGoOn>
  Fit fit(const Cluster& cluster, const MayGoOn& may_go_on) {
    begin(cluster);
    int tried = 0;
    do try_rotation(rotation_at(tried, p_.rotations));
    while (++tried < p_.rotations && may_go_on());
    best_.searched = static_cast<double>(tried) / p_.rotations;
    return best_;
  }

  const Skeleton& skeleton() const { return skeleton_; }
  const FitParameters& parameters() const { return p_; }
  size_t most_points() const { return x_.size(); }

 private:
  static constexpr uint32_t kNone = UINT32_MAX;
  /// A link fitted at the present rotation, and for which poses that holds.
  struct Solved {
    uint32_t parent = 0, partner = 0;  ///< solved_ of these links, kNone if missing
    uint32_t direction = 0;            ///< first pose with the same direction of this link
    bool found = false, hidden = false, thin = false;
    float distance_m = 0;  ///< from where the pose would have the end
    Eigen::Vector3f end = Eigen::Vector3f::Zero();
    Eigen::Matrix3f follow = Eigen::Matrix3f::Identity();  ///< frame of links that follow
  };

  void begin(const Cluster& cluster);
  void try_rotation(int k);
  void judge(size_t pose, int k, std::span<const uint32_t> chain);
  uint32_t solve(size_t link, size_t pose, std::span<const uint32_t> chain);
  void find_end(const LinkTask& task, Solved& solved);
  void find_hidden_end(const LinkTask& task, Solved& solved) const;
  void gather(const LinkTask& task);
  size_t count_along(const Eigen::Vector3f& from, const Eigen::Vector3f& to) const;
  void mark_close(uint32_t solved, const Eigen::Vector3f& from);
  void weigh();
  size_t weight_of_used() const;

  Skeleton skeleton_;
  FitParameters p_;
  std::vector<uint32_t> first_with_direction_;  ///< of pose * links + link
  Cluster cluster_;
  std::vector<float> x_, y_, z_;                 ///< of the cluster
  std::vector<float> near_x_, near_y_, near_z_;  ///< of the points that can lie along the present link
  size_t near_ = 0, words_ = 0;
  Eigen::Matrix3f body_ = Eigen::Matrix3f::Identity();
  std::vector<Solved> solved_;                              ///< of the present rotation
  std::array<std::vector<uint32_t>, kMostJoints> of_link_;  ///< in solved_
  std::vector<uint64_t> close_;                             ///< words_ for each of solved_: the points it explains
  std::vector<uint64_t> used_;
  std::array<std::vector<uint64_t>, kMostWeight - 1> outlying_;  ///< [k]: points that count more than k + 1 times
  size_t weight_of_all_ = 0;
  Fit best_;
};

}  // namespace takt::body_pose
