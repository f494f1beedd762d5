// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <netinet/in.h>

#include <memory>
#include <optional>
#include <string>
#include <string_view>

#include "hal/semantic_link/datagram_port.hpp"
#include "hal/stream/descriptor.hpp"

namespace takt::semantic_link {

/// An IPv4 address and a port.
struct UdpAddress {
  uint32_t host = 0x7F000001;  ///< as a number, 127.0.0.1
  uint16_t port = 0;
  bool loopback() const { return host >> 24 == 127; }
  std::string text() const;
};
/// "127.0.0.1:4700"; nothing for anything else.
std::optional<UdpAddress> parse_udp_address(std::string_view text);

/// Datagrams over UDP. They fit an Ethernet frame, so that no router takes them apart.
class UdpPort final : public DatagramPort {
 public:
  static constexpr size_t kLargest = 1400;
  /// Of a server: listens at `address`; port 0: the kernel chooses one, which stays the same from then on.
  static std::unique_ptr<UdpPort> of_server(std::string id, const UdpAddress& address) {
    return std::unique_ptr<UdpPort>(new UdpPort(std::move(id), address, true));
  }
  /// Of a client of the server at `address`.
  static std::unique_ptr<UdpPort> of_client(std::string id, const UdpAddress& address) {
    return std::unique_ptr<UdpPort>(new UdpPort(std::move(id), address, false));
  }

  DeviceResult open() override;
  void close() override { socket_.close(); }
  Arrival receive(std::span<uint8_t> into) override;
  void send(Peer to, std::span<const uint8_t> bytes) override;
  size_t largest() const override { return kLargest; }
  pollfd wait() const override { return {socket_.get(), POLLIN, 0}; }
  const UdpAddress& address() const { return address_; }

 private:
  UdpPort(std::string id, const UdpAddress& address, bool server)
      : id_(std::move(id)), address_(address), server_(server) {}

  std::string id_;
  UdpAddress address_;
  bool server_;
  Descriptor socket_;
};

}  // namespace takt::semantic_link
