// SPDX-License-Identifier: Apache-2.0
// What the parts of the replayer share.
#pragma once
#include <cstring>
#include <new>
#include <set>

#include "rt/memory/aligned_bytes.hpp"
#include "rt/record/replayer.hpp"

namespace takt::record {

/// A message in memory of its own.
struct Replayer::Stored {
  explicit Stored(const PortPlan& port) : bytes(port.chunk_bytes()), memory(aligned_bytes(bytes)) { place(port); }
  /// Empty again. What a node does not write itself is no zero by chance.
  void place(const PortPlan& port) {
    std::memset(memory.get(), 0xA5, bytes);
    header = ::new (memory.get()) MessageHeader{};
    port.type->place(memory.get() + sizeof(MessageHeader), port.capacity);
  }
  void* message() { return header + 1; }
  const void* message() const { return header + 1; }

  size_t bytes;
  AlignedBytes memory;
  MessageHeader* header = nullptr;
};

struct Replayer::Port {
  uint16_t channel = 0;
  std::set<uint64_t> remade;          ///< sequences that the jobs to be run published in the record
  std::map<uint64_t, uint64_t> uses;  ///< jobs that are still to hold it, by sequence
  std::map<uint64_t, std::shared_ptr<Stored>> messages;
  std::shared_ptr<Stored> newest;
  std::vector<std::shared_ptr<Stored>> spare;
  uint64_t before = 0;  ///< the newest one that is not made again
  std::unique_ptr<PortWriter> writer;
  std::vector<std::byte> packed;
};

/// What a task goes on from, of a restart or a snapshot.
inline const Restart& restart_of(const RecordedEvent& event) {
  const auto* const snapshot = std::get_if<Snapshot>(&event.what);
  return snapshot != nullptr ? snapshot->from : std::get<Restart>(event.what);
}

/// A node that is told what it remembered needs no more.
template <class Each>
void Replayer::for_each_handed_over(const RecordedEvent& event, const Each& each) const {
  const auto* const snapshot = std::get_if<Snapshot>(&event.what);
  if (snapshot != nullptr && (snapshot->state > 0 || &event != beginnings_[event.task].snapshot)) return;
  const std::vector<size_t>& ports = plan_.tasks[event.task].ports;
  for (const Restart::Output& output : restart_of(event).outputs)
    if (output.output < ports.size() && output.handed_over > 0) each(output.output, output.handed_over);
}

}  // namespace takt::record
