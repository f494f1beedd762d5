// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <memory>
#include <string>

#include "hal/semantic_link/datagram_port.hpp"
#include "hal/semantic_link/packet.hpp"

namespace takt::semantic_link {

struct DbusAddress {
  std::string bus = "session";               ///< session, system, or an address such as unix:path=/run/bus
  std::string service = "io.takt.semantic";  ///< name of the server on the bus
};
/// Whether a bus can have such an address and such a name.
bool valid(const DbusAddress& address);

/// Datagrams over a D-Bus: each is a call of the method Datagram of the interface io.takt.SemanticLink at
/// /io/takt/semantic_link, which both ends have and which nobody answers. The bus itself sees to it that no sender is
/// another one than it says.
class DbusPort final : public DatagramPort {
 public:
  static std::unique_ptr<DbusPort> of_server(std::string id, DbusAddress address);
  static std::unique_ptr<DbusPort> of_client(std::string id, DbusAddress address);
  ~DbusPort() override;

  DeviceResult open() override;
  void close() override;
  Arrival receive(std::span<uint8_t> into) override;
  void send(Peer to, std::span<const uint8_t> bytes) override;
  size_t largest() const override { return kLargestDatagram; }
  pollfd wait() const override;

 private:
  struct Bus;  ///< keeps sdbus-c++ out of this header
  DbusPort(std::string id, DbusAddress address, bool server);

  std::string id_;
  DbusAddress address_;
  bool server_;
  std::unique_ptr<Bus> bus_;
};

}  // namespace takt::semantic_link
