// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <cstdlib>
#include <memory>
#include <new>

#include "rt/node.hpp"
#include "rt/sched/port_access.hpp"

namespace takt::test {

/// One chunk of memory behind an output, so that a node's job can run without a runtime.
class FakeWriter final : public Writer {
 public:
  explicit FakeWriter(OutputPort& output) : output_(output) {
    const size_t bytes = sizeof(MessageHeader) + output.type().bytes(output.capacity());
    memory_.reset(static_cast<std::byte*>(std::aligned_alloc(64, (bytes + 63) / 64 * 64)));
    PortAccess::attach(output, this);
    PortAccess::mark_read(output);
  }
  MessageHeader* loan() override {
    auto* header = ::new (memory_.get()) MessageHeader;
    output_.type().place(header + 1, output_.capacity());
    return header;
  }
  void publish(int64_t, int64_t, int64_t) override {}
  void discard() override {}
  bool repeat(int64_t, int64_t) override { return false; }
  WriterStatistics statistics() const override { return {}; }

  /// What the last job sent; null if it sent nothing.
  template <class T>
  const T* sent() const {
    return PortAccess::sent(output_)
               ? reinterpret_cast<const T*>(reinterpret_cast<const MessageHeader*>(memory_.get()) + 1)
               : nullptr;
  }
  int64_t stamp_ns() const { return PortAccess::stamp_ns(output_); }

 private:
  struct Free {
    void operator()(std::byte* p) const { std::free(p); }
  };
  OutputPort& output_;
  std::unique_ptr<std::byte, Free> memory_;
};

}  // namespace takt::test
