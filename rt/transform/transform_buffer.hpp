// SPDX-License-Identifier: Apache-2.0
// Installed as <takt/transform/transform_buffer.hpp>: core, experimental.
// Where frames were, at the stamp of the data. A node owns one buffer and fills it only from its own latched inputs, so
// that the latch rule and replay hold. There is no "latest": whoever asks names a stamp, and gets a pose or a reason.
#pragma once
#include <cstdint>
#include <string>
#include <string_view>
#include <tl/expected.hpp>
#include <vector>

#include "rt/state_archive.hpp"
#include "rt/transform/pose_math.hpp"

namespace takt {

enum class TransformProblem : uint8_t {
  unknown_frame,  ///< not declared, or no chain of pairs joins the two
  empty,          ///< no pose yet
  too_old,        ///< before the oldest kept pose
  too_new,        ///< after the newest pose: it has not been measured yet
  gap_too_long,   ///< between two poses that lie too far apart to interpolate
};
std::string_view to_string(TransformProblem problem);

/// Why there is no pose, and which pair of frames is to blame. Trivially copyable: making one allocates nothing.
struct TransformError {
  TransformProblem problem = TransformProblem::unknown_frame;
  uint16_t parent = 0, child = 0;  ///< FrameId of the pair; of the two asked for if the frame is unknown
  int64_t asked_ns = 0;
  int64_t oldest_ns = 0, newest_ns = 0;  ///< of the pair; for gap_too_long the poses on both sides
};

using FrameId = uint16_t;

struct StampedPose {
  int64_t stamp_ns = 0;
  UncertainPose pose;
};

enum class InsertResult : uint8_t {
  inserted,
  replaced,      ///< there was a pose of that stamp (the same message latched twice)
  out_of_range,  ///< older than all of a full track: dropped
  invalid,       ///< not finite, zero quaternion, or a pair that is fixed or undeclared: dropped
};

/// Poses of one child in one parent over time; at most `capacity`, the oldest makes room.
class PoseTrack {
 public:
  /// Allocates; nothing else here does. capacity >= 1, max_gap_ns > 0.
  PoseTrack(size_t capacity, int64_t max_gap_ns);
  InsertResult insert(int64_t stamp_ns, const UncertainPose& pose);
  /// At exactly that stamp, or interpolated between its two neighbours if they are at most max_gap apart. O(log n).
  tl::expected<UncertainPose, TransformError> at(int64_t stamp_ns) const;
  size_t size() const { return poses_.size(); }
  void remember(StateArchive& archive) { TAKT_STATE(archive, poses_); }

 private:
  size_t capacity_;
  int64_t max_gap_ns_;
  std::vector<StampedPose> poses_;  ///< ascending stamps
};

/// Frames and the pairs between them: a forest, each frame with one parent. One thread at a time.
class TransformBuffer {
 public:
  /// Before start. A frame of that name, made on first mention.
  FrameId frame(std::string_view name);
  /// Before start: `child` moves in `parent`. Throws std::invalid_argument if child has a parent already, if the two
  /// would close a cycle, or if capacity or max_gap is not positive.
  void add(FrameId parent, FrameId child, size_t capacity, int64_t max_gap_ns);
  /// Before start: `child` is fixed in `parent`.
  void add_fixed(FrameId parent, FrameId child, const UncertainPose& child_in_parent);

  InsertResult insert(FrameId child, int64_t stamp_ns, const UncertainPose& child_in_parent);

  /// Pose of `source` in `target` at that stamp: up from both to their common ancestor, every pair interpolated at the
  /// same stamp. The covariances of the pairs are taken as independent.
  tl::expected<UncertainPose, TransformError> lookup(FrameId target, FrameId source, int64_t stamp_ns) const;

  /// For reports: "head in robot at 1.250000 s: too new, the newest pose is from 1.200000 s". Allocates.
  std::string describe(const TransformError& error) const;

 private:
  static constexpr FrameId kNoFrame = 0xffff;
  struct Frame {
    std::string name;
    FrameId parent = kNoFrame;
    bool fixed = false;
    UncertainPose pose;            ///< if fixed
    std::vector<PoseTrack> track;  ///< none or one
  };

  Frame& join(FrameId parent, FrameId child);
  tl::expected<UncertainPose, TransformError> in_parent(FrameId child, int64_t stamp_ns) const;
  tl::expected<UncertainPose, TransformError> in_ancestor(FrameId frame, FrameId ancestor, int64_t stamp_ns) const;
  size_t depth(FrameId frame) const;

  std::vector<Frame> frames_;
};

}  // namespace takt
