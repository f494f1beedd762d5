// SPDX-License-Identifier: Apache-2.0
// A pose as six numbers, any of which may be held fast.
#pragma once
#include <array>
#include <cstdint>

#include "nodes/ego_motion/rigid.hpp"

namespace takt::laser_fusion {

using ego_motion::Rigid;

/// x, y, z (m); yaw Psi about z, pitch Theta about x, roll Phi about y (rad): R = Rz(Psi) Rx(Theta) Ry(Phi)
/// (thesis Fig. 4.11; order of ).
using PoseParameters = std::array<double, 6>;
enum Parameter : uint8_t { kX, kY, kZ, kYaw, kPitch, kRoll };

/// True: this parameter of a pose stays as it is.
using Locks = std::array<bool, 6>;

Rigid to_rigid(const PoseParameters& parameters);
/// Angles in -pi..pi, pitch in -pi/2..pi/2; at a pitch of +-pi/2 roll is 0.
PoseParameters to_parameters(const Rigid& pose);

}  // namespace takt::laser_fusion
