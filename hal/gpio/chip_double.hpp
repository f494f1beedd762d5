// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <atomic>
#include <deque>
#include <functional>
#include <string>
#include <vector>

#include "hal/device_double.hpp"
#include "hal/gpio/line_chip.hpp"
#include "rt/time/clock.hpp"

namespace takt::gpio {

/// Levels that come from outside, bit i for line i.
using LevelSource = std::function<uint32_t(int64_t at_ns)>;

/// A chip with lines that a test sets and looks at, or that a source sets. It keeps events as the kernel does: 16 a
/// line, the oldest dropped. It lives in the calls that are made of it, each after all that happened before, in steps
/// of a millisecond; only misbehave() may come from another thread.
class ChipDouble final : public DeviceDouble {
 public:
  ChipDouble(std::vector<std::string> names, const Clock& clock, LevelSource source = nullptr);
  /// What a driver opens. The double must outlive it.
  std::unique_ptr<LineChip> chip();

  /// From outside, on a line that is no output.
  void set(uint32_t offset, bool level) { set(offset, level, clock_.now_ns()); }
  bool level(uint32_t offset) const { return lines_[offset].level; }
  /// Is told of every rise of an output, in the call that drives it. Before the driver opens the chip.
  void on_rise(std::function<void(uint32_t offset)> told) { on_rise_ = std::move(told); }
  /// How often it was driven high.
  uint32_t rises(uint32_t offset) const { return lines_[offset].rises; }

  DeviceResult plug_in() override { return {}; }
  void run_to(int64_t) override {}
  std::span<const Misbehaviour> known() const override;
  void misbehave(Misbehaviour how) override { how_.store(how); }

 private:
  friend class ChipDoubleFile;
  static constexpr size_t kEvents = 16;
  struct Line {
    std::string name;
    bool level = false, taken = false, is_output = false;
    uint32_t rises = 0;
    std::deque<LineEvent> events;
  };

  void set(uint32_t offset, bool level, int64_t at_ns);
  /// Takes what the source has said since the last call.
  void live();
  bool present() const { return how_.load() != Misbehaviour::unplugged; }

  const Clock& clock_;
  LevelSource source_;
  std::function<void(uint32_t)> on_rise_;
  std::vector<Line> lines_;
  std::atomic<Misbehaviour> how_{Misbehaviour::none};
  int64_t lived_ns_ = INT64_MIN;
};

}  // namespace takt::gpio
