// SPDX-License-Identifier: Apache-2.0
#include "nodes/body_pose/fitter.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <bit>
#include <limits>

namespace takt::body_pose {

using Eigen::Matrix3f, Eigen::Vector3f;

Fitter::Fitter(const Skeleton& skeleton, const FitParameters& parameters, size_t most_points)
    : skeleton_(skeleton), p_(parameters) {
  const size_t links = skeleton_.links.size(), poses = skeleton_.poses.size();
  for (size_t pose = 0; pose < poses; ++pose)
    for (size_t link = 0; link < links; ++link) {
      size_t first = 0;
      while (skeleton_.poses[first].directions[link] != skeleton_.poses[pose].directions[link]) ++first;
      first_with_direction_.push_back(static_cast<uint32_t>(first));
    }
  for (auto* axis : {&x_, &y_, &z_, &near_x_, &near_y_, &near_z_}) axis->resize(most_points);
  solved_.reserve(links * poses);
  for (auto& list : of_link_) list.reserve(poses);
  used_.resize((most_points + 63) / 64);
  for (auto& words : outlying_) words.resize(used_.size());
  close_.resize(used_.size() * links * poses);
}

void Fitter::begin(const Cluster& cluster) {
  cluster_ = cluster;
  cluster_.points = cluster.points.first(std::min(cluster.points.size(), most_points()));
  words_ = (cluster_.points.size() + 63) / 64;
  for (size_t i = 0; i < cluster_.points.size(); ++i) {
    x_[i] = cluster_.points[i].x;
    y_[i] = cluster_.points[i].y;
    z_[i] = cluster_.points[i].z;
  }
  weigh();
  best_ = {};
  best_.error = std::numeric_limits<double>::infinity();
}

void Fitter::weigh() {
  for (auto& words : outlying_) std::fill_n(words.begin(), words_, uint64_t{0});
  weight_of_all_ = 0;
  for (size_t i = 0; i < cluster_.points.size(); ++i) {
    const uint32_t weight = weight_of(p_, cluster_.start, cluster_.points[i]);
    for (uint32_t k = 0; k + 1 < weight; ++k) outlying_[k][i / 64] |= uint64_t{1} << i % 64;
    weight_of_all_ += weight;
  }
}

size_t Fitter::weight_of_used() const {
  size_t sum = 0;
  for (size_t w = 0; w < words_; ++w) {
    sum += static_cast<size_t>(std::popcount(used_[w]));
    for (const auto& words : outlying_) sum += static_cast<size_t>(std::popcount(used_[w] & words[w]));
  }
  return sum;
}

void Fitter::try_rotation(int k) {
  body_ = rotation_about_vertical(yaw_of(k, p_.rotations));
  solved_.clear();
  for (auto& list : of_link_) list.clear();
  std::array<uint32_t, kMostJoints> chain{};
  for (size_t pose = 0; pose < skeleton_.poses.size(); ++pose) {
    chain[0] = kNone;
    for (size_t link = 1; link < skeleton_.links.size(); ++link) chain[link] = solve(link, pose, chain);
    judge(pose, k, chain);
  }
}

/// `chain`: of the links before this one what is solved for the present pose, kNone where missing.
uint32_t Fitter::solve(size_t i, size_t pose, std::span<const uint32_t> chain) {
  const Link& link = skeleton_.links[i];
  if (link.parent != 0 && chain[link.parent] == kNone) return kNone;
  const uint32_t direction = first_with_direction_[pose * skeleton_.links.size() + i];
  const Solved key{chain[link.parent], link.mirrors == 0 ? kNone : chain[link.mirrors], direction};
  for (const uint32_t other : of_link_[i]) {
    const Solved& s = solved_[other];
    if (s.parent == key.parent && s.partner == key.partner && s.direction == key.direction)
      return s.found ? other : kNone;
  }
  const auto number = static_cast<uint32_t>(solved_.size());
  Solved& now = solved_.emplace_back(key);
  of_link_[i].push_back(number);

  const Vector3f start = link.parent == 0 ? cluster_.start : solved_[now.parent].end;
  const bool follows = link.follows_parent && link.parent != 0;
  const Matrix3f& frame = follows ? solved_[now.parent].follow : body_;
  if (now.partner != kNone) {
    const Link& partner = skeleton_.links[link.mirrors];
    const Vector3f from = partner.parent == 0 ? cluster_.start : solved_[chain[partner.parent]].end;
    find_end(make_mirrored_task(link, start, frame, partner, solved_[now.partner].end - from), now);
  } else {
    find_end(make_task(link, start, frame, body_ * skeleton_.poses[direction].directions[i].cast<float>()), now);
    if (!now.found && follows && link.mirrors == 0)
      find_end(make_task(link, start, frame, frame * link.rest.cast<float>()), now);
  }
  if (!now.found) return kNone;
  mark_close(number, start);
  return number;
}

/// findBestFit of Alg. 3.3.
void Fitter::find_end(const LinkTask& task, Solved& solved) {
  double least = std::numeric_limits<double>::infinity();
  size_t along = 0;
  bool gathered = false;
  const auto reach = static_cast<float>(p_.search_m * p_.search_m);
  for (size_t i = 0; i < cluster_.points.size(); ++i) {
    const Vector3f end(x_[i], y_[i], z_[i]);
    if ((end - task.aim).squaredNorm() > reach) continue;
    const auto e2 = shape_error(p_, task, end);
    if (!e2 || *e2 >= least) continue;
    const Vector3f offset = end - task.start;
    if (!angles_allow(skeleton_, *task.link, task.frame, offset.normalized())) continue;
    if (!gathered) gather(task);
    gathered = true;
    const size_t points = count_along(task.start, end);
    const auto e1 = density_error(p_, cluster_.density, points, offset.norm());
    if (!e1 || !(*e1 + *e2 < least)) continue;
    least = *e1 + *e2;
    solved.end = end;
    solved.found = true;
    along = points;
  }
  if (!solved.found && task.link->descendants > 0) find_hidden_end(task, solved);
  if (!solved.found) return;
  const Vector3f offset = solved.end - task.start;
  solved.follow = frame_of_followers(*task.link, task.frame, offset.normalized());
  solved.distance_m = (solved.end - task.aim).norm();
  solved.thin = solved.hidden || static_cast<double>(along) / offset.norm() < p_.density_low * cluster_.density;
}

void Fitter::find_hidden_end(const LinkTask& task, Solved& solved) const {
  double least = std::numeric_limits<double>::infinity();
  const auto reach = static_cast<float>(p_.search_m * p_.search_m);
  for (size_t i = 0; i < cluster_.points.size(); i += kHidingStep) {
    const HiddenEnds hidden = hidden_ends(p_, task, cluster_.eye, {x_[i], y_[i], z_[i]});
    for (size_t k = 0; k < hidden.count; ++k) {
      const Vector3f& end = hidden.ends[k];
      if ((end - task.aim).squaredNorm() > reach) continue;
      const auto e2 = shape_error(p_, task, end);
      if (!e2 || !(*e2 < least)) continue;
      if (!angles_allow(skeleton_, *task.link, task.frame, (end - task.start).normalized())) continue;
      if (!is_covered(p_, cluster_, task, end)) continue;
      least = *e2;
      solved.end = end;
      solved.found = solved.hidden = true;
    }
  }
}

/// The points in the box around everything that can lie along the link.
void Fitter::gather(const LinkTask& task) {
  const auto reach = static_cast<float>(p_.search_m * 1.001), tube = static_cast<float>(p_.tube_m * 1.001);
  const Vector3f low = (task.aim.array() - reach).matrix().cwiseMin(task.start).array() - tube;
  const Vector3f high = (task.aim.array() + reach).matrix().cwiseMax(task.start).array() + tube;
  near_ = 0;
  for (size_t i = 0; i < cluster_.points.size(); ++i) {
    near_x_[near_] = x_[i];
    near_y_[near_] = y_[i];
    near_z_[near_] = z_[i];
    near_ += static_cast<size_t>((x_[i] >= low.x()) & (x_[i] <= high.x()) & (y_[i] >= low.y()) & (y_[i] <= high.y()) &
                                 (z_[i] >= low.z()) & (z_[i] <= high.z()));
  }
}

size_t Fitter::count_along(const Vector3f& from, const Vector3f& to) const {
  const Segment segment(from, to);
  const auto squared = static_cast<float>(p_.tube_m * p_.tube_m);
  int32_t count = 0;
  for (size_t i = 0; i < near_; ++i)
    count += segment.squared_distance(near_x_[i], near_y_[i], near_z_[i]) <= squared ? 1 : 0;
  return static_cast<size_t>(count);
}

void Fitter::mark_close(uint32_t number, const Vector3f& from) {
  const Segment segment(from, solved_[number].end);
  const auto squared = static_cast<float>(p_.close_m * p_.close_m);
  uint64_t* words = close_.data() + number * words_;
  for (size_t w = 0; w < words_; ++w) {
    const size_t first = 64 * w, count = std::min<size_t>(64, cluster_.points.size() - first);
    uint64_t bits = 0;
    for (size_t i = 0; i < count; ++i)
      bits |= uint64_t{segment.squared_distance(x_[first + i], y_[first + i], z_[first + i]) <= squared} << i;
    words[w] = bits;
  }
}

/// Keeps a pose that is better than all before.
void Fitter::judge(size_t pose, int k, std::span<const uint32_t> chain) {
  PoseError error;
  error.away = away(cluster_.start, cluster_.eye, yaw_of(k, p_.rotations));
  std::fill_n(used_.begin(), words_, uint64_t{0});
  for (size_t i = 1; i < skeleton_.links.size(); ++i) {
    if (chain[i] == kNone) {
      error.missing += p_.missing_penalty * (1 + skeleton_.links[i].descendants);
      continue;
    }
    const Solved& s = solved_[chain[i]];
    error.distance_m += s.distance_m;
    if (s.thin) error.thin += p_.thin_penalty;
    const uint64_t* close = close_.data() + chain[i] * words_;
    for (size_t w = 0; w < words_; ++w) used_[w] |= close[w];
  }
  const double total = error.total(p_, weight_of_used(), weight_of_all_);
  if (!(total < best_.error)) return;
  best_.error = total;
  best_.pose = pose;
  best_.yaw_rad = yaw_of(k, p_.rotations);
  best_.ends[0] = cluster_.start;
  best_.fitted = {true};
  for (size_t i = 1; i < skeleton_.links.size(); ++i) {
    best_.fitted[i] = chain[i] != kNone;
    best_.hidden[i] = best_.fitted[i] && solved_[chain[i]].hidden;
    best_.ends[i] = best_.fitted[i] ? solved_[chain[i]].end : Vector3f::Zero();
  }
}

}  // namespace takt::body_pose
