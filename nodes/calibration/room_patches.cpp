// SPDX-License-Identifier: Apache-2.0
#include "nodes/calibration/room_patches.hpp"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>

namespace takt::calibration {
namespace {

using Eigen::Matrix3d, Eigen::Vector3d;
using Gradient = Eigen::Matrix<double, 6, 1>;

constexpr size_t kLeastOfPatch = 10;
constexpr double kThickest = 0.02, kNarrowest = 0.1;  // shares of variances

struct CubeSums {
  size_t points = 0;
  Vector3d sum = Vector3d::Zero();
  Matrix3d squares = Matrix3d::Zero();
};

/// Distances along the normal `n` of a patch (robot frame at that heading) by x, y, z, yaw, pitch and roll of the
/// mount; `arm` is the return seen from the scanner, along the robot's axes.
Gradient gradient_of(const Vector3d& n, const Vector3d& arm, const Matrix3d& turn, double yaw_rad) {
  const Vector3d pitch_axis(std::cos(yaw_rad), std::sin(yaw_rad), 0);
  Gradient out;
  out << n, n.dot(Vector3d::UnitZ().cross(arm)), n.dot(pitch_axis.cross(arm)), n.dot(turn.col(1).cross(arm));
  return out;
}

}  // namespace

RoomPatches::RoomPatches(std::span<const Point> room, double edge_m) : cubes_(edge_m) {
  std::map<cloud::VoxelIndex, CubeSums> sums;
  for (const Point& p : room) {
    if (!cubes_.holds(p)) continue;
    CubeSums& cube = sums[cubes_.voxel_of(raised(p))];
    const Vector3d place(p.x, p.y, p.z);
    ++cube.points;
    cube.sum += place;
    cube.squares += place * place.transpose();
  }
  for (const auto& [index, cube] : sums) {
    if (cube.points < kLeastOfPatch) continue;
    const auto n = static_cast<double>(cube.points);
    const Vector3d middle = cube.sum / n;
    const Eigen::SelfAdjointEigenSolver<Matrix3d> solver(cube.squares / n - middle * middle.transpose());
    const Vector3d variance = solver.eigenvalues();  // rising
    if (variance(0) > kThickest * variance(1) || variance(1) < kNarrowest * variance(2)) continue;
    patches_.emplace(index, Patch{middle, solver.eigenvectors().col(0)});
  }
}

const Patch* RoomPatches::at(const Point& place) const {
  if (!cubes_.holds(place)) return nullptr;
  const auto found = patches_.find(cubes_.voxel_of(raised(place)));
  return found == patches_.end() ? nullptr : &found->second;
}

PatchFit step_onto(const RoomPatches& room, const LaserSweep& sweep, const PoseParameters& mount,
                   const PatchFitParameters& p) {
  const Rigid pose = laser_fusion::to_rigid(mount);
  Eigen::Matrix<double, 6, 6> information = Eigen::Matrix<double, 6, 6>::Zero();
  Gradient gradient = Gradient::Zero();
  size_t tried = 0, pairs = 0;
  PatchFit fit{mount, 0, 0};
  for (size_t i = 0; i < sweep.returns.size(); i += stride(sweep.returns.size(), p.returns)) {
    ++tried;
    const Eigen::AngleAxisd heading(sweep.returns[i].heading_rad, Vector3d::UnitZ());
    const Vector3d arm = pose.R * in_scanner(sweep.returns[i]), place = heading * (arm + pose.t);
    const Patch* patch =
        room.at({static_cast<float>(place.x()), static_cast<float>(place.y()), static_cast<float>(place.z())});
    if (patch == nullptr) continue;
    const double distance_m = patch->normal.dot(place - patch->middle);
    if (std::abs(distance_m) > p.cut_m) continue;
    ++pairs;
    fit.residual_m += std::abs(distance_m);
    const double weight = 1 / (1 + distance_m * distance_m / (p.scale_m * p.scale_m));
    const Gradient by_mount = gradient_of(heading.inverse() * patch->normal, arm, pose.R, mount[laser_fusion::kYaw]);
    information += weight * by_mount * by_mount.transpose();
    gradient += weight * distance_m * by_mount;
  }
  fit.residual_m /= static_cast<double>(std::max<size_t>(pairs, 1));
  fit.paired = static_cast<double>(pairs) / static_cast<double>(std::max<size_t>(tried, 1));
  if (pairs < laser_fusion::kLeastPairs) return fit;
  for (Eigen::Index i = 0; i < 6; ++i) {
    if (!p.locks[static_cast<size_t>(i)]) continue;
    information.row(i).setZero();
    information.col(i).setZero();
    information(i, i) = 1;
    gradient(i) = 0;
  }
  const Gradient step = information.ldlt().solve(gradient);
  for (size_t i = 0; i < 6; ++i) fit.mount[i] -= step(static_cast<Eigen::Index>(i));
  return fit;
}

}  // namespace takt::calibration
