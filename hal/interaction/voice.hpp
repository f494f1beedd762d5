// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <functional>
#include <string>

#include "hal/device.hpp"

namespace takt {

struct Sentence {
  int64_t at_ns = 0;  ///< when the robot said it, since the epoch of the run
  std::string text;
};

/// What makes a sentence heard. It may wait and allocate: a Loudspeaker calls it on a thread of its own.
class Voice {
 public:
  Voice() = default;
  Voice(const Voice&) = delete;
  Voice& operator=(const Voice&) = delete;
  virtual ~Voice() = default;

  /// Checks everything, and leaves no trace. Calling it again changes nothing.
  virtual DeviceResult open() = 0;
  /// Before the first sentence. `goes_on`: an earlier process of this run has spoken before, its file is not begun
  /// anew. False: it cannot be written.
  virtual bool start(bool goes_on) = 0;
  /// Returns when it is said. Asks `go_on` every few milliseconds and leaves off when that is false. False: not said.
  virtual bool speak(const Sentence& sentence, const std::function<bool()>& go_on) = 0;
  /// True: quicker than speech (a file). What still waits at the end of the run is said then.
  virtual bool catches_up() const = 0;
  /// Why the last speak() was false, for people; on the thread that called it.
  virtual std::string problem() const = 0;
};

}  // namespace takt
