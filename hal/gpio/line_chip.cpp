// SPDX-License-Identifier: Apache-2.0
#include "hal/gpio/line_chip.hpp"

#include <gpiod.h>

#include <cerrno>
#include <charconv>

namespace takt::gpio {
namespace {

constexpr const char* kConsumer = "takt";

}  // namespace

std::optional<uint32_t> find_line(LineChip& chip, const std::string& text) {
  if (const auto offset = chip.find(text)) return offset;
  uint32_t offset = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), offset);
  return error == std::errc{} && end == text.data() + text.size() ? std::optional(offset) : std::nullopt;
}

int KernelLineChip::open(const std::string& path) {
  close();
  chip_ = gpiod_chip_open(path.c_str());
  return chip_ != nullptr ? 0 : errno;
}

void KernelLineChip::close() {
  if (chip_ != nullptr) gpiod_chip_close(chip_);
  chip_ = nullptr;
  lines_ = {};
}

std::optional<uint32_t> KernelLineChip::find(const std::string& name) {
  gpiod_line* line = gpiod_chip_find_line(chip_, name.c_str());
  if (line == nullptr) return std::nullopt;
  return gpiod_line_offset(line);
}

int KernelLineChip::request_input(size_t slot, uint32_t offset) {
  lines_[slot] = gpiod_chip_get_line(chip_, offset);
  if (lines_[slot] == nullptr) return errno;
  return gpiod_line_request_both_edges_events(lines_[slot], kConsumer) == 0 ? 0 : errno;
}

int KernelLineChip::request_output(size_t slot, uint32_t offset, bool level) {
  lines_[slot] = gpiod_chip_get_line(chip_, offset);
  if (lines_[slot] == nullptr) return errno;
  return gpiod_line_request_output(lines_[slot], kConsumer, level ? 1 : 0) == 0 ? 0 : errno;
}

int KernelLineChip::get(size_t slot, bool& level) {
  const int value = gpiod_line_get_value(lines_[slot]);
  if (value < 0) return errno;
  level = value != 0;
  return 0;
}

int KernelLineChip::set(size_t slot, bool level) {
  return gpiod_line_set_value(lines_[slot], level ? 1 : 0) == 0 ? 0 : errno;
}

int KernelLineChip::next_event(size_t slot, LineEvent& event) {
  const timespec at_once{};
  const int waits = gpiod_line_event_wait(lines_[slot], &at_once);
  if (waits == 0) return EAGAIN;
  gpiod_line_event read{};
  if (waits < 0 || gpiod_line_event_read(lines_[slot], &read) != 0) return errno;
  event.rising = read.event_type == GPIOD_LINE_EVENT_RISING_EDGE;
  event.stamp_ns = int64_t{read.ts.tv_sec} * 1'000'000'000 + read.ts.tv_nsec;
  return 0;
}

}  // namespace takt::gpio
