// SPDX-License-Identifier: Apache-2.0
// Installed as <takt/msg/joint_state.hpp>: core, experimental.
#pragma once
#include <cstdint>
#include <span>
#include <string_view>

#include "rt/msg/array.hpp"
#include "rt/msg/field_list.hpp"

namespace takt {

struct JointName {
  using scalar = char;
  char text[32] = {};  ///< ended by 0
};

/// Where the joints of an arm, a head or a gripper are, how fast they move and what they bear. Capacity: count (joints).
///
///     Output<JointState> joints{this, "joints", "of the left arm"};   // in setup: joints.reserve({0, 0, 1, 7});
///
/// All arrays have one entry a joint, in one order; one that is not measured is empty. Of a joint that slides, m instead
/// of rad and N instead of Nm.
struct JointState {
  static constexpr std::string_view type_name = "joint_state";
  Array<JointName> names;
  Array<double> position_rad;
  Array<double> velocity_rad_s;
  Array<double> effort_nm;
  TAKT_FIELDS(JointState, (names, ""), (position_rad, "rad"), (velocity_rad_s, "rad/s"), (effort_nm, "Nm"))
};

}  // namespace takt
