// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <atomic>
#include <cstdint>
#include <span>

#include "rt/faults/faulty_transport.hpp"

namespace takt::faults {

/// How often the faults of a run struck: one mapping, shared with the processes forked after it was made, so that
/// counts outlive a process that is killed. Any thread of any of them.
class StrikeCounts {
 public:
  /// Throws std::runtime_error if there is no memory.
  StrikeCounts(size_t faults, size_t message_faults, size_t ports);
  ~StrikeCounts();
  StrikeCounts(const StrikeCounts&) = delete;
  StrikeCounts& operator=(const StrikeCounts&) = delete;

  std::span<std::atomic<uint64_t>> faults() const { return faults_; }    ///< but for those of messages
  std::span<MessageFaultCount> messages() const { return messages_; }    ///< by message fault
  std::span<std::atomic<uint64_t>> offered() const { return offered_; }  ///< by port: messages handed over by nodes

 private:
  void* memory_ = nullptr;
  size_t bytes_ = 0;
  std::span<std::atomic<uint64_t>> faults_, offered_;
  std::span<MessageFaultCount> messages_;
};

}  // namespace takt::faults
