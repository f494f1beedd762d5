// SPDX-License-Identifier: Apache-2.0
// Poses of messages and of the simulation as Eigen has them.
#pragma once
#include <Eigen/Geometry>

#include "hal/sim/simulation.hpp"
#include "rt/msg/geometry.hpp"

namespace takt::test {

inline Eigen::Isometry3d isometry(const Transform& t) {
  Eigen::Isometry3d out = Eigen::Isometry3d::Identity();
  out.linear() = Eigen::Quaterniond(t.qw, t.qx, t.qy, t.qz).normalized().toRotationMatrix();
  out.translation() = Eigen::Vector3d(t.x, t.y, t.z);
  return out;
}

inline Eigen::Isometry3d isometry(const sim::CameraPose& pose) {
  Eigen::Isometry3d out = Eigen::Isometry3d::Identity();
  out.linear() = pose.rotation;
  out.translation() = pose.position;
  return out;
}

}  // namespace takt::test
