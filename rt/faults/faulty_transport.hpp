// SPDX-License-Identifier: Apache-2.0
// Message faults between a node and its output: a transport around another one. Readers and outputs that no fault names
// are those of the inner transport.
#pragma once
#include <atomic>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "rt/faults/message_fault.hpp"
#include "rt/shm/transport.hpp"
#include "rt/time/clock.hpp"

namespace takt::faults {

/// What one fault did. Written by the thread that runs the node, read by anybody at any time.
struct MessageFaultCount {
  std::atomic<uint64_t> struck{0};    ///< messages it changed, or loans it kept from succeeding
  std::atomic<uint64_t> withheld{0};  ///< messages that it kept from being published
  std::atomic<uint64_t> added{0};     ///< publications beyond those of the node
};

/// The ports with what the faults need beyond them: a delayed message must still be there when it becomes visible, one
/// that comes twice must push no other out. `rates_hz` of each port's producer. Before the pools are made.
void make_room(std::span<PortPlan> ports, std::span<const MessageFault> faults, std::span<const double> rates_hz);

class FaultyTransport final : public Transport {
 public:
  /// Several faults of one output strike in their order. `ports` are those of `inner`. `epoch_ns` is 0 until the run
  /// has one: nothing strikes before. `counts` has one entry per fault, `offered` one per port, where the messages that
  /// nodes hand over are counted if a fault may strike them. Clock, epoch and counts outlive this.
  FaultyTransport(std::unique_ptr<Transport> inner, std::span<const PortPlan> ports, std::vector<MessageFault> faults,
                  const Clock& clock, const std::atomic<int64_t>& epoch_ns, std::span<MessageFaultCount> counts,
                  std::span<std::atomic<uint64_t>> offered);
  ~FaultyTransport() override;

  std::unique_ptr<Writer> make_writer(size_t port) override;
  std::unique_ptr<Reader> make_reader(size_t port) override { return inner_->make_reader(port); }
  uint64_t shared_memory_bytes() const override { return inner_->shared_memory_bytes(); }
  const char* name() const override { return inner_->name(); }
  uint32_t reclaim(uint32_t process) override { return inner_->reclaim(process); }
  void ask_daemon() override { inner_->ask_daemon(); }
  uint32_t chunks_in_use() const override { return inner_->chunks_in_use(); }

 private:
  const std::unique_ptr<Transport> inner_;
  const std::vector<PortPlan> ports_;
  const std::vector<MessageFault> faults_;
  const Clock& clock_;
  const std::atomic<int64_t>& epoch_ns_;
  const std::span<MessageFaultCount> counts_;
  const std::span<std::atomic<uint64_t>> offered_;
};

}  // namespace takt::faults
