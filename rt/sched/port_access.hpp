// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <utility>
#include <vector>

#include "rt/node.hpp"

namespace takt {

/// The runtime's side of the ports; nodes never see this.
class PortAccess {
 public:
  static void connect(InputPort& input, const Capacity& capacity) {
    input.connected_ = true;
    input.capacity_ = capacity;
  }
  static void stamped_by(OutputPort& output, std::vector<const InputPort*> inputs) {
    output.stamped_by_ = std::move(inputs);
  }
  static void mark_read(OutputPort& output) { output.connected_ = true; }
  static void attach(OutputPort& output, Writer* writer) { output.writer_ = writer; }

  static std::array<Held, InputPort::kMaxDepth>& held(InputPort& input) { return input.held_; }
  static size_t held_count(const InputPort& input) { return input.held_count_; }
  static void set_held(InputPort& input, size_t count, bool stale, uint64_t last_seen_before) {
    input.held_count_ = count;
    input.stale_ = stale;
    input.last_seen_before_ = last_seen_before;
  }

  static void hand_over(OutputPort& output, const void* message) { output.handed_over_ = message; }
  static bool sent(const OutputPort& output) { return output.sent_; }
  static void set_level(OutputPort& output, int level) { output.loaned_->level = level; }  ///< of a sent message
  static int64_t stamp_ns(const OutputPort& output) { return output.stamp_ns_; }
  static void reset(OutputPort& output) {
    output.sent_ = false;
    output.loaned_ = nullptr;
  }
};

}  // namespace takt
