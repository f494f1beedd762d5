// SPDX-License-Identifier: Apache-2.0
// The newest message of each output, for as many as want to see it. An output is read and copied once a message, and
// only while somebody looks.
//
//   const auto tap = taps.at(port);
//   while (const auto message = tap->newer_than(seen)) seen = message->sequence, show(message->message());
#pragma once
#include <cstdint>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

#include "graph/language/registry.hpp"
#include "rt/memory/aligned_bytes.hpp"
#include "rt/shm/transport.hpp"

namespace takt::attach {

/// A copy of a message, which lies there as it lay in its chunk. Any thread.
class Tapped {
 public:
  Tapped(const PortPlan& port, const Held& held);
  const void* message() const { return memory_.get(); }
  /// What that makes of it, made once for all; nothing: it is none of that kind.
  const std::optional<std::string>& drawn(Draw draw) const;

  const uint64_t sequence;
  const int64_t stamp_ns;
  const int32_t level;

 private:
  const MessageType& type_;
  const AlignedBytes memory_;
  mutable std::mutex drawing_;
  mutable std::map<Draw, std::optional<std::string>> drawn_;
};

/// An output that somebody looks at. Any thread.
class Tap {
 public:
  Tap(Transport& transport, const std::vector<PortPlan>& ports, size_t port)
      : port_(ports[port]), reader_(transport.make_reader(port)) {}
  /// The newest message that is visible at `now_ns`, if it came after that one; null: there is none.
  std::shared_ptr<const Tapped> newer_than(uint64_t seen, int64_t now_ns);

 private:
  const PortPlan& port_;
  std::mutex mutex_;
  std::unique_ptr<Reader> reader_;
  std::shared_ptr<const Tapped> newest_;
};

/// Any thread. Transport and ports outlive it; it outlives what it gave.
class Taps {
 public:
  Taps(Transport& transport, const std::vector<PortPlan>& ports) : transport_(transport), ports_(ports) {}
  /// The tap of that output, which ends with the last who holds it: there is never a second one of an output, for
  /// which the plan has one observer.
  std::shared_ptr<Tap> at(size_t port);

 private:
  struct Shared {
    std::unique_ptr<Tap> tap;
    size_t holders = 0;
  };
  void let_go(size_t port);

  Transport& transport_;
  const std::vector<PortPlan>& ports_;
  std::mutex mutex_;
  std::map<size_t, Shared> taps_;
};

}  // namespace takt::attach
