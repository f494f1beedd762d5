// SPDX-License-Identifier: Apache-2.0
// What a body is made of, read from a file: links, the angles they allow, typical poses (thesis Sec. 3.3.4, Tab. 3.1).
// Body frame: x to the right of whoever has the body, y ahead, z up.
#pragma once
#include <Eigen/Core>
#include <filesystem>
#include <numbers>
#include <stdexcept>
#include <string>
#include <vector>

#include "rt/msg/ace/body_poses.hpp"

namespace takt::body_pose {

/// Joints of a skeleton, its start included.
constexpr size_t kMostJoints = Body::kMostJoints;

/// A rotation that a link allows: about axis 0, 1, 2 of its frame (x, y, z), rad.
struct Dof {
  int axis = 0;
  double min_rad = 0, max_rad = 0;
};

/// A link leads from the end of its parent to its own end; both are joints, known by the link's number.
struct Link {
  std::string name;
  size_t parent = 0;                                 ///< below the link's own number
  double length_m = 0;                               ///< nominal
  Eigen::Vector3d rest = -Eigen::Vector3d::UnitZ();  ///< unit direction while all angles are 0
  std::vector<Dof> dofs{};                           ///< of an axis along `rest` end points show nothing
  size_t mirrors = 0;           ///< that link points the opposite way: no degree of freedom is left; 0: none
  bool follows_parent = false;  ///< its frame turns with the parent's swing; else it is the body's
  int descendants = 0;          ///< links that hang on this one
};

/// A typical pose: where each link points. Entry 0 is not used.
struct TypicalPose {
  std::string name;
  std::vector<Eigen::Vector3d> directions;  ///< unit, body frame; one for each link
};

/// What points: from one joint to another, as from shoulder to wrist.
struct Pointer {
  size_t from = 0, to = 0;
};

struct Skeleton {
  std::string name;
  std::vector<Link> links;  ///< links[0] is the start, of length 0; parents come first
  std::vector<TypicalPose> poses;
  std::vector<Pointer> pointers;  ///< at most Body::kMostPointers
  double slack_rad = 0.5;         ///< what an axis without degree of freedom may seem to turn, for noise

  int degrees_of_freedom() const;
  /// Throws std::out_of_range.
  size_t link(const std::string& name) const;
};

/// What is wrong with a skeleton file, as "FILE:LINE: ...".
struct SkeletonError : std::runtime_error {
  using std::runtime_error::runtime_error;
};

/// Reads a file as README.md describes it. Throws SkeletonError.
Skeleton read_skeleton(const std::filesystem::path& file);

}  // namespace takt::body_pose
