// SPDX-License-Identifier: Apache-2.0
#include "hal/semantic_link/udp_port.hpp"

#include <arpa/inet.h>
#include <fmt/format.h>
#include <sys/socket.h>

#include <cerrno>
#include <charconv>
#include <cstring>

namespace takt::semantic_link {
namespace {

sockaddr_in socket_address(const UdpAddress& address) {
  sockaddr_in out{};
  out.sin_family = AF_INET;
  out.sin_port = htons(address.port);
  out.sin_addr.s_addr = htonl(address.host);
  return out;
}

Peer peer_of(const UdpAddress& address) { return static_cast<Peer>(uint64_t{address.host} << 16 | address.port); }

UdpAddress address_of(Peer peer) {
  const auto number = static_cast<uint64_t>(peer);
  return {static_cast<uint32_t>(number >> 16), static_cast<uint16_t>(number)};
}

}  // namespace

std::string UdpAddress::text() const {
  return fmt::format("{}.{}.{}.{}:{}", host >> 24, host >> 16 & 255, host >> 8 & 255, host & 255, port);
}

std::optional<UdpAddress> parse_udp_address(std::string_view text) {
  const size_t colon = text.rfind(':');
  if (colon == std::string_view::npos) return std::nullopt;
  in_addr host{};
  UdpAddress address;
  const std::string_view port = text.substr(colon + 1);
  const auto [end, error] = std::from_chars(port.data(), port.data() + port.size(), address.port);
  if (error != std::errc() || end != port.data() + port.size() ||
      inet_pton(AF_INET, std::string(text.substr(0, colon)).c_str(), &host) != 1)
    return std::nullopt;
  address.host = ntohl(host.s_addr);
  return address;
}

DeviceResult UdpPort::open() {
  if (socket_) return {};
  socket_ = Descriptor(socket(AF_INET, SOCK_DGRAM | SOCK_NONBLOCK | SOCK_CLOEXEC, 0));
  // A client's port is the kernel's choice, on the interface that leads to the server.
  sockaddr_in own = socket_address(server_ ? address_ : UdpAddress{address_.loopback() ? INADDR_LOOPBACK : 0, 0});
  socklen_t size = sizeof own;
  auto* raw = reinterpret_cast<sockaddr*>(&own);
  if (!socket_ || bind(socket_.get(), raw, size) != 0 || getsockname(socket_.get(), raw, &size) != 0) {
    const int error = errno;
    socket_.close();
    return device_failure(id_, address_.text() + ": " + std::strerror(error),
                          "choose an `address` of this machine whose port is free (`ss -ulpn` lists the used ones)");
  }
  if (server_) address_.port = ntohs(own.sin_port);
  return {};
}

Arrival UdpPort::receive(std::span<uint8_t> into) {
  if (!socket_) return {Arrival::What::gone, 0, {}};
  sockaddr_in from{};
  socklen_t size = sizeof from;
  const ssize_t got =
      recvfrom(socket_.get(), into.data(), into.size(), MSG_TRUNC, reinterpret_cast<sockaddr*>(&from), &size);
  if (got < 0) return {};
  return {Arrival::What::datagram, static_cast<size_t>(got),
          peer_of({ntohl(from.sin_addr.s_addr), ntohs(from.sin_port)})};
}

void UdpPort::send(Peer to, std::span<const uint8_t> bytes) {
  const sockaddr_in address = socket_address(to == Peer::server ? address_ : address_of(to));
  sendto(socket_.get(), bytes.data(), bytes.size(), MSG_NOSIGNAL, reinterpret_cast<const sockaddr*>(&address),
         sizeof address);
}

}  // namespace takt::semantic_link
