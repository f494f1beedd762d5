// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "hal/device.hpp"

namespace takt {

struct InteractionReading {
  ReadStatus status = ReadStatus::no_data;
  int64_t stamp_ns = 0;   ///< when the task was given
  uint32_t number = 0;    ///< rises with each task; 0: none yet
  std::string_view task;  ///< in words; valid until the next read
};

/// What people talk to the robot with: a touch screen and a loudspeaker, a terminal, a script. See Device for the life
/// cycle and the thread rules.
class Interaction : public Device {
 public:
  /// Longer ones are not taken.
  static constexpr size_t kLongestTask = 240;

  /// The newest task given until `wanted_ns`, at most one new one a read; `ok` also where nobody has said anything.
  virtual InteractionReading read(int64_t wanted_ns) = 0;
  /// Tells the person; false if that cannot be done now.
  virtual bool say(std::string_view text) = 0;
  /// Before the first read: tasks up to this number were given before the process was started again; `last` is that one
  /// in words, empty if nobody knows it any more.
  virtual void go_on_after(uint32_t number, std::string_view last) {
    static_cast<void>(number), static_cast<void>(last);
  }
  /// Whether answer() means anything to it.
  virtual bool takes_answers() const { return false; }
  /// The next task, from a screen in another process. Between two jobs, on their thread. False: read() has not given
  /// the answer before yet, or this one is longer than a task.
  virtual bool answer(std::string_view) { return false; }
};

}  // namespace takt
