// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "hal/device.hpp"
#include "rt/msg/ace/action.hpp"

namespace takt {

struct ActorReading {
  ReadStatus status = ReadStatus::no_data;
  int64_t stamp_ns = 0;
  ActionOutcome outcome;  ///< of the newest command
};

/// What carries actions out: an arm, a switch, a person who is asked. See Device for the life cycle and the thread
/// rules.
class Actor : public Device {
 public:
  /// The action wanted from `at_ns` on, repeated each job: a number that was given before changes nothing. What is
  /// under way when another number comes is given up. False if the device cannot take it.
  virtual bool command(const ActionCommand& command, int64_t at_ns) = 0;

  /// How far the newest command is at `wanted_ns`. Returns at the latest at `deadline_ns`.
  virtual ActorReading read(int64_t wanted_ns, int64_t deadline_ns) = 0;
};

}  // namespace takt
