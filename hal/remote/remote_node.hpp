// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <deque>
#include <memory>
#include <string>
#include <vector>

#include "hal/device_node.hpp"
#include "hal/remote/inbox.hpp"

namespace takt {

/// Where the messages of another machine come in; see Device for the life cycle and the thread rules.
class RemoteSource : public Device {
 public:
  /// In setup. Waits until that machine has said how large they can become. Throws SetupError if it never will.
  virtual Capacity capacity(std::string_view output) = 0;
  /// After open(): of an output, in the order of the node's.
  virtual Inbox& inbox(size_t output) = 0;
  /// Whether that machine is there, at the release of a job.
  virtual ReadStatus status(int64_t release_ns) = 0;

  // What receives runs before and after the device.
  DeviceResult open() override { return {}; }
  void close() override {}
  DeviceResult start(int64_t) override { return {}; }
  void stop() override {}
};

/// What a node or device of another machine gives, as a device of this one. Each job hands on the next message of each
/// output whose time has come, with the stamp that it has; later ones wait for the next job.
///
/// Without outputs it stands for the other machine as such: it is there, or it is lost.
class RemoteNode final : public DeviceNode {
 public:
  struct Port {
    std::string name, doc;
    const MessageType* type = nullptr;
  };
  /// `source` null: a shell, with ports to look at and to connect.
  RemoteNode(std::vector<Port> ports, std::unique_ptr<RemoteSource> source);
  void setup(Setup& setup) override;
  void run(Job& job) override;
  Device& device() override { return *source_; }

 private:
  /// An output of any type.
  class Any final : public OutputPort {
   public:
    using OutputPort::OutputPort;
    void* loan() { return loan_message(); }
  };
  bool hand_on(Inbox& inbox, Any& output, int64_t release_ns);

  const std::vector<Port> ports_;
  std::deque<Any> outputs_;
  std::unique_ptr<RemoteSource> source_;
};

}  // namespace takt
