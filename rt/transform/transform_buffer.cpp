// SPDX-License-Identifier: Apache-2.0
#include "rt/transform/transform_buffer.hpp"

#include <algorithm>
#include <cstdio>
#include <stdexcept>

namespace takt {
namespace {

tl::unexpected<TransformError> problem(TransformProblem what, int64_t asked_ns, int64_t oldest_ns = 0,
                                       int64_t newest_ns = 0) {
  return tl::unexpected<TransformError>({what, 0, 0, asked_ns, oldest_ns, newest_ns});
}

std::string seconds(int64_t ns) {
  char text[32];
  std::snprintf(text, sizeof text, "%.6f s", static_cast<double>(ns) * 1e-9);
  return text;
}

}  // namespace

std::string_view to_string(TransformProblem problem) {
  switch (problem) {
    case TransformProblem::unknown_frame: return "unknown frame";
    case TransformProblem::empty: return "empty";
    case TransformProblem::too_old: return "too old";
    case TransformProblem::too_new: return "too new";
    case TransformProblem::gap_too_long: return "gap too long";
  }
  return "?";
}

PoseTrack::PoseTrack(size_t capacity, int64_t max_gap_ns) : capacity_(capacity), max_gap_ns_(max_gap_ns) {
  poses_.reserve(capacity);
}

InsertResult PoseTrack::insert(int64_t stamp_ns, const UncertainPose& pose) {
  if (!is_valid(pose)) return InsertResult::invalid;
  auto at = std::lower_bound(poses_.begin(), poses_.end(), stamp_ns,
                             [](const StampedPose& kept, int64_t stamp) { return kept.stamp_ns < stamp; });
  if (at != poses_.end() && at->stamp_ns == stamp_ns) {
    at->pose = normalised(pose);
    return InsertResult::replaced;
  }
  if (poses_.size() == capacity_) {
    if (at == poses_.begin()) return InsertResult::out_of_range;
    // The oldest goes; those between it and the gap move up, which leaves the place right in front of `at`.
    std::move(poses_.begin() + 1, at, poses_.begin());
    *(at - 1) = {stamp_ns, normalised(pose)};
    return InsertResult::inserted;
  }
  poses_.insert(at, {stamp_ns, normalised(pose)});  // within the reserved capacity
  return InsertResult::inserted;
}

tl::expected<UncertainPose, TransformError> PoseTrack::at(int64_t stamp_ns) const {
  if (poses_.empty()) return problem(TransformProblem::empty, stamp_ns);
  const int64_t oldest = poses_.front().stamp_ns, newest = poses_.back().stamp_ns;
  if (stamp_ns < oldest) return problem(TransformProblem::too_old, stamp_ns, oldest, newest);
  if (stamp_ns > newest) return problem(TransformProblem::too_new, stamp_ns, oldest, newest);
  const auto after = std::lower_bound(poses_.begin(), poses_.end(), stamp_ns,
                                      [](const StampedPose& kept, int64_t stamp) { return kept.stamp_ns < stamp; });
  if (after->stamp_ns == stamp_ns) return after->pose;
  const auto before = after - 1;
  const int64_t gap = after->stamp_ns - before->stamp_ns;
  if (gap > max_gap_ns_) return problem(TransformProblem::gap_too_long, stamp_ns, before->stamp_ns, after->stamp_ns);
  const double fraction = static_cast<double>(stamp_ns - before->stamp_ns) / static_cast<double>(gap);
  return interpolate(before->pose, after->pose, fraction);
}

FrameId TransformBuffer::frame(std::string_view name) {
  for (size_t i = 0; i < frames_.size(); ++i)
    if (frames_[i].name == name) return static_cast<FrameId>(i);
  if (frames_.size() == kNoFrame) throw std::invalid_argument("more than 65,535 frames");
  frames_.emplace_back().name = name;
  return static_cast<FrameId>(frames_.size() - 1);
}

TransformBuffer::Frame& TransformBuffer::join(FrameId parent, FrameId child) {
  if (parent >= frames_.size() || child >= frames_.size())
    throw std::invalid_argument("frame number is not from frame()");
  if (frames_[child].parent != kNoFrame)
    throw std::invalid_argument("frame " + frames_[child].name + " has a parent already (" +
                                frames_[frames_[child].parent].name + "), it cannot also lie in " +
                                frames_[parent].name);
  for (FrameId above = parent; above != kNoFrame; above = frames_[above].parent)
    if (above == child)
      throw std::invalid_argument("frame " + frames_[child].name + " in " + frames_[parent].name +
                                  " would close a cycle");
  frames_[child].parent = parent;
  return frames_[child];
}

void TransformBuffer::add(FrameId parent, FrameId child, size_t capacity, int64_t max_gap_ns) {
  if (capacity == 0 || max_gap_ns <= 0)
    throw std::invalid_argument("a pair of frames needs a capacity of 1 or more and a longest gap above 0");
  join(parent, child).track.emplace_back(capacity, max_gap_ns);
}

void TransformBuffer::add_fixed(FrameId parent, FrameId child, const UncertainPose& child_in_parent) {
  if (!is_valid(child_in_parent))
    throw std::invalid_argument("a fixed pose must be finite with a quaternion that is not zero");
  Frame& frame = join(parent, child);
  frame.fixed = true;
  frame.pose = normalised(child_in_parent);
}

InsertResult TransformBuffer::insert(FrameId child, int64_t stamp_ns, const UncertainPose& child_in_parent) {
  if (child >= frames_.size() || frames_[child].track.empty()) return InsertResult::invalid;
  return frames_[child].track.front().insert(stamp_ns, child_in_parent);
}

tl::expected<UncertainPose, TransformError> TransformBuffer::in_parent(FrameId child, int64_t stamp_ns) const {
  const Frame& frame = frames_[child];
  if (frame.fixed) return frame.pose;
  auto pose = frame.track.front().at(stamp_ns);
  if (!pose) {
    pose.error().parent = frame.parent;
    pose.error().child = child;
  }
  return pose;
}

tl::expected<UncertainPose, TransformError> TransformBuffer::in_ancestor(FrameId frame, FrameId ancestor,
                                                                         int64_t stamp_ns) const {
  UncertainPose pose;
  for (; frame != ancestor; frame = frames_[frame].parent) {
    const auto step = in_parent(frame, stamp_ns);
    if (!step) return step;
    pose = compose(*step, pose);
  }
  return pose;
}

size_t TransformBuffer::depth(FrameId frame) const {
  size_t levels = 0;
  for (FrameId above = frames_[frame].parent; above != kNoFrame; above = frames_[above].parent) ++levels;
  return levels;
}

tl::expected<UncertainPose, TransformError> TransformBuffer::lookup(FrameId target, FrameId source,
                                                                    int64_t stamp_ns) const {
  const tl::unexpected<TransformError> unknown({TransformProblem::unknown_frame, target, source, stamp_ns, 0, 0});
  if (target >= frames_.size() || source >= frames_.size()) return unknown;
  FrameId a = target, b = source;
  for (size_t da = depth(a), db = depth(b); a != b;) {
    if (da >= db) a = frames_[a].parent;
    if (db > da) b = frames_[b].parent;
    if (a == kNoFrame || b == kNoFrame) return unknown;
    da = depth(a);
    db = depth(b);
  }
  const auto source_in_common = in_ancestor(source, a, stamp_ns);
  if (!source_in_common || target == a) return source_in_common;
  const auto target_in_common = in_ancestor(target, a, stamp_ns);
  if (!target_in_common) return target_in_common;
  if (source == a) return inverse(*target_in_common);
  return compose(inverse(*target_in_common), *source_in_common);
}

std::string TransformBuffer::describe(const TransformError& error) const {
  const auto name = [&](FrameId id) { return id < frames_.size() ? frames_[id].name : "frame " + std::to_string(id); };
  std::string text = name(error.child) + " in " + name(error.parent) + " at " + seconds(error.asked_ns) + ": ";
  text += to_string(error.problem);
  switch (error.problem) {
    case TransformProblem::unknown_frame: return text + ", no chain of poses joins the two; declare the missing pair";
    case TransformProblem::empty: return text + ", no pose has arrived yet";
    case TransformProblem::too_old:
      return text + ", the oldest kept pose is from " + seconds(error.oldest_ns) + "; raise the capacity";
    case TransformProblem::too_new: return text + ", the newest pose is from " + seconds(error.newest_ns);
    case TransformProblem::gap_too_long:
      return text + ", the poses around it are from " + seconds(error.oldest_ns) + " and " + seconds(error.newest_ns);
  }
  return text;
}

}  // namespace takt
