// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <array>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>

struct gpiod_chip;
struct gpiod_line;

namespace takt::gpio {

constexpr size_t kMostLines = 32;

struct LineEvent {
  bool rising = false;
  int64_t stamp_ns = 0;  ///< CLOCK_MONOTONIC
};

/// The calls that the driver makes of a GPIO chip: what stands between it and the kernel, or a double. Lines that were
/// asked for are named by their `slot`, 0..31. One thread; nothing waits. int: 0 or an errno.
class LineChip {
 public:
  LineChip() = default;
  LineChip(const LineChip&) = delete;
  LineChip& operator=(const LineChip&) = delete;
  virtual ~LineChip() = default;

  virtual int open(const std::string& path) = 0;
  /// Gives all lines back.
  virtual void close() = 0;
  /// The offset of the line with that name.
  virtual std::optional<uint32_t> find(const std::string& name) = 0;
  /// As an input with the events of both edges.
  virtual int request_input(size_t slot, uint32_t offset) = 0;
  virtual int request_output(size_t slot, uint32_t offset, bool level) = 0;
  virtual int get(size_t slot, bool& level) = 0;
  virtual int set(size_t slot, bool level) = 0;
  /// The oldest event that waits; EAGAIN if none does.
  virtual int next_event(size_t slot, LineEvent& event) = 0;
};

/// The offset of the line with that name; else the offset that the text is, if it is one.
std::optional<uint32_t> find_line(LineChip& chip, const std::string& text);

/// A chip of this machine, through libgpiod 1.6.
class KernelLineChip final : public LineChip {
 public:
  ~KernelLineChip() override { close(); }
  int open(const std::string& path) override;
  void close() override;
  std::optional<uint32_t> find(const std::string& name) override;
  int request_input(size_t slot, uint32_t offset) override;
  int request_output(size_t slot, uint32_t offset, bool level) override;
  int get(size_t slot, bool& level) override;
  int set(size_t slot, bool level) override;
  int next_event(size_t slot, LineEvent& event) override;

 private:
  gpiod_chip* chip_ = nullptr;
  std::array<gpiod_line*, kMostLines> lines_{};
};

}  // namespace takt::gpio
