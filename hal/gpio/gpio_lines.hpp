// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <array>
#include <memory>
#include <vector>

#include "hal/gpio/debounce.hpp"
#include "hal/gpio/digital_lines.hpp"
#include "hal/gpio/line_chip.hpp"
#include "rt/time/clock.hpp"

namespace takt::gpio {

/// Lines by name or offset. The device numbers them in this order: inputs, outputs, powered, trigger.
struct GpioLinesSettings {
  std::string chip;
  std::vector<std::string> inputs{};
  std::vector<std::string> outputs{};  ///< low until they are written
  std::vector<std::string> powered{};  ///< outputs that are high from the start to the stop
  std::string trigger{};               ///< output with one pulse per read; empty: none
  int64_t debounce_ns = 0;             ///< a rise of an input counts after so long
  int64_t pulse_ns = 100'000;          ///< at least so long is the trigger high; the job waits for it
};

/// Lines of a GPIO chip. Inputs are read in each read, events beside it: no edge is missed, and none that was missed
/// matters. Outputs fall back to what their hardware rests at when the program ends, in whatever way.
class GpioLines final : public DigitalLines {
 public:
  GpioLines(std::string id, GpioLinesSettings settings, std::unique_ptr<LineChip> chip, const Clock& clock);
  ~GpioLines() override { GpioLines::close(); }
  DeviceResult open() override;
  void close() override;
  DeviceResult start(int64_t epoch_ns) override;
  void stop() override;
  bool restart(int64_t now_ns) override;
  /// Levels are those of the read.
  StampLaw stamp_law(const JobTimes&) const override { return {}; }
  DeclaredCalls declared_calls() const override;
  uint32_t count() const override { return static_cast<uint32_t>(lines_.size()); }
  LinesReading read(int64_t wanted_ns) override;
  bool write(uint32_t line, bool level, int64_t at_ns) override;

  /// Trigger pulses since the start, and when the newest one began (between the call and its return).
  uint32_t pulses() const { return pulses_; }
  int64_t pulse_stamp_ns() const { return pulse_stamp_ns_; }

 private:
  enum class Use : uint8_t { input, output, powered, trigger };
  struct Line {
    const std::string* name;
    Use use;
    bool level = false;  ///< of an output: as it was driven last
    Debounce debounce;
  };
  /// The line that could not be had, and an errno; -1: the chip itself.
  struct Trouble {
    int line = -1, error = 0;
  };

  Trouble claim();
  int look(size_t line, LinesReading& reading);
  int drive(size_t line, bool level);
  int give_pulse(size_t line);

  std::string id_;
  GpioLinesSettings settings_;
  std::unique_ptr<LineChip> chip_;
  const Clock& clock_;
  std::vector<Line> lines_;
  bool open_ = false, started_ = false, lost_ = false;
  uint32_t pulses_ = 0;
  int64_t pulse_stamp_ns_ = 0;
};

}  // namespace takt::gpio
