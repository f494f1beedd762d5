// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <poll.h>

#include <cstddef>
#include <cstdint>
#include <span>

#include "hal/device.hpp"

namespace takt::semantic_link {

/// Somebody at the other side of a port; each port has its own numbers for them.
enum class Peer : uint64_t { server = 0 };  ///< of a client's port: where its server should be

struct Arrival {
  enum class What : uint8_t { nothing, datagram, gone };
  What what = What::nothing;
  size_t size = 0;  ///< larger than the bytes given if it did not fit
  Peer from{};
};

/// Carries datagrams: each arrives whole, once, several times, late or never. No call waits but open(). One thread at a
/// time.
class DatagramPort {
 public:
  DatagramPort() = default;
  DatagramPort(const DatagramPort&) = delete;
  DatagramPort& operator=(const DatagramPort&) = delete;
  virtual ~DatagramPort() = default;

  /// Calling it again while open changes nothing.
  virtual DeviceResult open() = 0;
  virtual void close() = 0;
  /// The next one that has come; `gone` until it is opened again.
  virtual Arrival receive(std::span<uint8_t> into) = 0;
  /// What cannot be sent now is lost.
  virtual void send(Peer to, std::span<const uint8_t> bytes) = 0;
  /// Of one datagram, bytes.
  virtual size_t largest() const = 0;
  /// What to wait for until receive() or a send that did not get away may have something to do.
  virtual pollfd wait() const = 0;
};

}  // namespace takt::semantic_link
