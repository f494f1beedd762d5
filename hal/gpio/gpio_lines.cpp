// SPDX-License-Identifier: Apache-2.0
#include "hal/gpio/gpio_lines.hpp"

#include <algorithm>
#include <cerrno>
#include <cstring>

#include "hal/gpio/pulse.hpp"

namespace takt::gpio {
namespace {

constexpr int kMostEvents = 64;  ///< of a line in one read: four times what the kernel keeps

}  // namespace

GpioLines::GpioLines(std::string id, GpioLinesSettings settings, std::unique_ptr<LineChip> chip, const Clock& clock)
    : id_(std::move(id)), settings_(std::move(settings)), chip_(std::move(chip)), clock_(clock) {
  const auto add = [&](const std::string& name, Use use) {
    lines_.push_back({&name, use, false, Debounce(settings_.debounce_ns)});
  };
  for (const std::string& name : settings_.inputs) add(name, Use::input);
  for (const std::string& name : settings_.outputs) add(name, Use::output);
  for (const std::string& name : settings_.powered) add(name, Use::powered);
  if (!settings_.trigger.empty()) add(settings_.trigger, Use::trigger);
}

DeviceResult GpioLines::open() {
  if (open_) return {};
  if (lines_.empty() || lines_.size() > kMostLines)
    return device_error(id_, std::to_string(lines_.size()) + " lines are asked for", "name 1..32 lines of the chip");
  const Trouble trouble = claim();
  if (trouble.error == 0) {
    open_ = true;
    return {};
  }
  chip_->close();
  const std::string why = std::strerror(trouble.error);
  if (trouble.line < 0)
    return device_failure(id_, settings_.chip + ": " + why, "name a chip of this machine: gpiodetect");
  const std::string& name = *lines_[static_cast<size_t>(trouble.line)].name;
  return device_failure(id_, settings_.chip + ": line `" + name + "`: " + why,
                        trouble.error == EBUSY ? "end the program that holds it: gpioinfo names it"
                                               : "name a line of the chip, or its offset: gpioinfo");
}

GpioLines::Trouble GpioLines::claim() {
  if (const int error = chip_->open(settings_.chip); error != 0) return {-1, error};
  for (size_t i = 0; i < lines_.size(); ++i) {
    Line& line = lines_[i];
    const auto offset = find_line(*chip_, *line.name);
    const int at = static_cast<int>(i);
    if (!offset) return {at, ENOENT};
    const int error =
        line.use == Use::input ? chip_->request_input(i, *offset) : chip_->request_output(i, *offset, false);
    if (error != 0) return {at, error};
    line.level = false;
  }
  return {};
}

void GpioLines::close() {
  stop();
  if (open_) chip_->close();
  open_ = false;
}

DeviceResult GpioLines::start(int64_t) {
  if (!open_) return device_error(id_, "start before open", "call open() first");
  pulses_ = 0;
  lost_ = false;
  started_ = true;
  LinesReading ignored;
  for (size_t i = 0; i < lines_.size(); ++i) {
    Line& line = lines_[i];
    if (line.use == Use::powered) lost_ = drive(i, true) != 0 || lost_;
    if (line.use != Use::input) continue;
    line.debounce = Debounce(settings_.debounce_ns);
    lost_ = look(i, ignored) != 0 || lost_;
  }
  if (!lost_) return {};
  started_ = false;
  return device_failure(id_, settings_.chip + ": a line does not answer", "look at the chip: gpioinfo");
}

void GpioLines::stop() {
  if (!started_) return;
  started_ = false;
  for (size_t i = 0; i < lines_.size(); ++i) {
    if (lines_[i].use != Use::input) drive(i, false);
  }
}

bool GpioLines::restart(int64_t now_ns) {
  if (!open_) return false;
  if (lost_) {
    started_ = false;
    chip_->close();
    if (claim().error != 0) return false;
  }
  return start(now_ns).has_value();
}

DeclaredCalls GpioLines::declared_calls() const {
  return {bit(JobCall::file) | bit(JobCall::wait) | bit(JobCall::malloc),
          "events are read from the kernel without waiting; libgpiod allocates when a lost chip is opened again"};
}

int GpioLines::drive(size_t line, bool level) {
  lines_[line].level = level;
  return chip_->set(line, level);
}

int GpioLines::look(size_t index, LinesReading& reading) {
  Debounce& debounce = lines_[index].debounce;
  const uint32_t bit = 1u << index;
  LineEvent event;
  int error = 0;
  for (int k = 0; k < kMostEvents && (error = chip_->next_event(index, event)) == 0; ++k) {
    const int64_t stamp_ns = std::min(event.stamp_ns, clock_.now_ns());
    if (!debounce.observe(event.rising, stamp_ns)) continue;
    reading.changed |= bit;
    reading.edge_ns = std::max(reading.edge_ns, stamp_ns);
  }
  if (error != 0 && error != EAGAIN) return error;
  // The level itself: of many edges the kernel drops the oldest.
  bool level = false;
  if ((error = chip_->get(index, level)) != 0) return error;
  const int64_t now_ns = clock_.now_ns();
  if (debounce.observe(level, now_ns)) {
    reading.changed |= bit;
    reading.edge_ns = std::max(reading.edge_ns, now_ns);
  }
  if (debounce.level()) reading.levels |= bit;
  return 0;
}

int GpioLines::give_pulse(size_t line) {
  const Pulse given = pulse(*chip_, line, settings_.pulse_ns, clock_);
  if (given.error != 0) return given.error;
  pulse_stamp_ns_ = given.stamp_ns;
  ++pulses_;
  return 0;
}

LinesReading GpioLines::read(int64_t) {
  LinesReading reading;
  if (!started_) return reading;
  for (size_t i = 0; i < lines_.size() && !lost_; ++i) {
    const Line& line = lines_[i];
    if (line.use == Use::trigger) lost_ = give_pulse(i) != 0;
    else if (line.use == Use::input) lost_ = look(i, reading) != 0;
    else if (line.level) reading.levels |= 1u << i;
  }
  if (lost_) reading = {};
  reading.status = lost_ ? ReadStatus::disconnected : ReadStatus::ok;
  reading.stamp_ns = clock_.now_ns();
  return reading;
}

bool GpioLines::write(uint32_t line, bool level, int64_t) {
  if (!started_ || line >= lines_.size() || lines_[line].use != Use::output) return false;
  lost_ = drive(line, level) != 0 || lost_;
  return !lost_;
}

}  // namespace takt::gpio
