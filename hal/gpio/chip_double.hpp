// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <deque>
#include <string>
#include <vector>

#include "hal/gpio/line_chip.hpp"
#include "rt/time/clock.hpp"

namespace takt::gpio {

/// A chip with lines that a test sets and looks at. It keeps events as the kernel does: 16 a line, the oldest dropped.
class ChipDouble {
 public:
  ChipDouble(std::vector<std::string> names, const Clock& clock);
  /// What a driver opens. The double must outlive it.
  std::unique_ptr<LineChip> chip();

  /// From outside, on a line that is no output.
  void set(uint32_t offset, bool level);
  bool level(uint32_t offset) const { return lines_[offset].level; }
  /// How often it was driven high.
  uint32_t rises(uint32_t offset) const { return lines_[offset].rises; }
  void unplug() { present_ = false; }
  void plug_in() { present_ = true; }

 private:
  friend class ChipDoubleFile;
  static constexpr size_t kEvents = 16;
  struct Line {
    std::string name;
    bool level = false, taken = false, is_output = false;
    uint32_t rises = 0;
    std::deque<LineEvent> events;
  };

  const Clock& clock_;
  std::vector<Line> lines_;
  bool present_ = true;
};

}  // namespace takt::gpio
