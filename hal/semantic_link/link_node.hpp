// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <memory>

#include "hal/device_node.hpp"
#include "hal/semantic_link/link_device.hpp"
#include "rt/msg/text_status.hpp"

namespace takt::semantic_link {

/// What both nodes share: a port's messages to the other end, those of the other end to a port, and the line `link`.
class LinkNode : public DeviceNode {
 public:
  explicit LinkNode(std::unique_ptr<LinkDevice> device) : device_(std::move(device)) {}
  Device& device() override { return *device_; }

 protected:
  static constexpr uint32_t kLine = 400;
  LinkDevice& end() { return *device_; }
  /// Passes a message on, once.
  template <class T>
  void give(Kind kind, const Input<T>& input) {
    if (input.is_new()) device_->give(kind, input.newest(), input.stamp_ns());
  }
  template <class T>
  void reserve(Kind kind, Output<T>& output) {
    output.reserve(info_of(kind).capacity);
  }
  /// Sends what has come since the last job, unless it is older than `oldest_ns`.
  template <class T>
  void pass(Kind kind, Output<T>& output, int64_t oldest_ns) {
    const Parcel* parcel = device_->take(kind);
    if (parcel == nullptr) return;
    if (parcel->stamp_ns < oldest_ns) return device_->count_too_old();
    T* message = output.loan();
    if (message != nullptr && LinkDevice::unpack(kind, *parcel, message)) output.send(parcel->stamp_ns);
  }
  void say(Output<TextStatus>& output, int64_t stamp_ns);

 private:
  std::unique_ptr<LinkDevice> device_;
};

}  // namespace takt::semantic_link
