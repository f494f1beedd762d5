// SPDX-License-Identifier: Apache-2.0
// Runs one node without a graph: places messages in plain memory and hands them to its ports.
#pragma once
#include <cstdlib>
#include <filesystem>
#include <memory>
#include <stdexcept>
#include <string>
#include <string_view>
#include <vector>

#include "rt/node.hpp"
#include "rt/sched/port_access.hpp"

namespace takt::test {

struct FreeMemory {
  void operator()(void* memory) const { std::free(memory); }
};

/// A message of type T in its own chunk.
template <class T>
class Box {
 public:
  explicit Box(const Capacity& capacity = {}) {
    const auto& type = MessageType::of<T>();
    const size_t bytes = (sizeof(MessageHeader) + type.bytes(capacity) + 63) / 64 * 64;
    memory_.reset(std::aligned_alloc(64, bytes));
    header_ = ::new (memory_.get()) MessageHeader;
    type.place(header_ + 1, capacity);
  }
  MessageHeader& header() { return *header_; }
  T& operator*() { return *reinterpret_cast<T*>(header_ + 1); }
  T* operator->() { return &**this; }

 private:
  std::unique_ptr<void, FreeMemory> memory_;
  MessageHeader* header_ = nullptr;
};

/// Gives the same chunk for each loan; the port notes whether the node sent it.
template <class T>
class BoxWriter final : public Writer {
 public:
  BoxWriter(OutputPort& port) : capacity_(port.capacity()), box_(capacity_), port_(&port) {
    PortAccess::attach(port, this);
    PortAccess::mark_read(port);
  }
  MessageHeader* loan() override {
    if (refuses && sent()) return ++refused, nullptr;
    MessageType::of<T>().place(&*box_, capacity_);
    return &box_.header();
  }
  void publish(int64_t, int64_t, int64_t) override {}
  void discard() override {}
  bool repeat(int64_t, int64_t) override { return false; }
  WriterStatistics statistics() const override { return {}; }

  T& message() { return *box_; }
  const MessageHeader* loaned() { return &box_.header(); }
  bool sent() const { return PortAccess::sent(*port_); }
  int64_t stamp_ns() const { return PortAccess::stamp_ns(*port_); }
  void clear() { PortAccess::reset(*port_); }
  bool refuses = false;  ///< a second message between two clear(), as the runtime does in one job
  uint64_t refused = 0;

 private:
  Capacity capacity_;
  Box<T> box_;
  OutputPort* port_;
};

inline InputPort& input(Node& node, std::string_view name) {
  for (InputPort* port : node.inputs())
    if (port->name() == name) return *port;
  throw std::logic_error("the node has no input " + std::string(name));
}

/// Sets a parameter, as the graph file would before start.
inline void set(Node& node, std::string_view name, const ParamValue& value) {
  for (ParamBase* param : node.params()) {
    if (param->name() != name) continue;
    if (const auto done = param->set(value); !done) throw std::logic_error(std::string(name) + " " + done.error());
    return;
  }
  throw std::logic_error("the node has no parameter " + std::string(name));
}

/// Latches one message; `sequence` above the last one makes it new.
template <class T>
void latch(InputPort& port, Box<T>& box, int64_t stamp_ns, uint64_t sequence, size_t slot = 0) {
  PortAccess::held(port)[slot] = {&box.header(), sequence, stamp_ns, 0, 0};
  PortAccess::set_held(port, slot + 1, false, sequence - 1 - slot);
}

/// Stands at 0. At namespace scope: a local static registers its destructor on first use, which allocates now and then,
/// and tests count the allocations of their first job.
inline const VirtualClock standing_clock;

inline bool run(Node& node, uint64_t index = 0) {
  Job job(standing_clock, index, 0, 100'000'000, 0, "full");
  node.run(job);
  return !job.without_result();
}

inline void set_up(Node& node, const std::filesystem::path& output = ".") {
  Setup setup{standing_clock, ".", output, 0, std::nullopt, 0};
  node.setup(setup);
}

}  // namespace takt::test
