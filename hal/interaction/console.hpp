// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <array>
#include <string>

#include "hal/interaction/interaction.hpp"
#include "hal/stream/descriptor.hpp"

namespace takt {

struct ConsoleSettings {
  std::string input = "/dev/stdin";    ///< terminal, FIFO or file; one task a line
  std::string output = "/dev/stdout";  ///< where speech is printed; files grow
};

/// Somebody at a terminal, or another program at a FIFO. Lines may come in pieces; empty ones and what follows a `#`
/// are left out; one that is too long is said to be. A terminal that is hung up is disconnected; the end of a file is
/// none.
class Console final : public Interaction {
 public:
  Console(std::string id, ConsoleSettings settings) : id_(std::move(id)), settings_(std::move(settings)) {}
  DeviceResult open() override;
  void close() override;
  DeviceResult start(int64_t) override;
  void stop() override { started_ = false; }
  bool restart(int64_t now_ns) override;
  StampLaw stamp_law(const JobTimes&) const override { return {}; }
  InteractionReading read(int64_t wanted_ns) override;
  bool say(std::string_view text) override;
  void go_on_after(uint32_t number, std::string_view) override { number_ = number; }
  DeclaredCalls declared_calls() const override;

 private:
  bool fill();
  bool take_line(int64_t at_ns);

  std::string id_;
  ConsoleSettings settings_;
  bool terminal_ = false;
  Descriptor in_, out_;
  std::array<char, 1024> bytes_;  ///< read and not taken
  size_t count_ = 0;
  bool skipping_ = false;  ///< the rest of a line that is too long
  std::array<char, kLongestTask> task_;
  size_t task_size_ = 0;
  uint32_t number_ = 0;
  int64_t stamp_ns_ = 0;
  bool started_ = false;
};

}  // namespace takt
