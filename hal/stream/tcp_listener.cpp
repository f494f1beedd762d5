// SPDX-License-Identifier: Apache-2.0
#include "hal/stream/tcp_listener.hpp"

#include <netinet/in.h>
#include <netinet/tcp.h>
#include <sys/socket.h>

#include <cerrno>
#include <cstring>

namespace takt {

DeviceResult TcpListener::open() {
  close();
  listener_ = Descriptor(socket(AF_INET, SOCK_STREAM | SOCK_NONBLOCK | SOCK_CLOEXEC, 0));
  const int on = 1;
  setsockopt(listener_.get(), SOL_SOCKET, SO_REUSEADDR, &on, sizeof on);
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_port = htons(port_);
  address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  socklen_t size = sizeof address;
  auto* raw = reinterpret_cast<sockaddr*>(&address);
  if (!listener_ || bind(listener_.get(), raw, size) != 0 || listen(listener_.get(), 1) != 0 ||
      getsockname(listener_.get(), raw, &size) != 0) {
    const int error = errno;
    close();
    return device_failure("port " + std::to_string(port_), std::strerror(error), "choose another port");
  }
  port_ = ntohs(address.sin_port);
  return {};
}

void TcpListener::close() {
  client_.close();
  listener_.close();
}

std::optional<size_t> TcpListener::read(std::span<uint8_t> into) {
  if (!listener_) return std::nullopt;
  if (Descriptor client(accept4(listener_.get(), nullptr, nullptr, SOCK_NONBLOCK | SOCK_CLOEXEC)); client) {
    const int on = 1;
    setsockopt(client.get(), IPPROTO_TCP, TCP_NODELAY, &on, sizeof on);
    client_ = std::move(client);
  }
  if (!client_) return 0;
  const auto got = client_.read(into);
  if (!got) client_.close();
  return got.value_or(0);
}

std::optional<size_t> TcpListener::write(std::span<const uint8_t> bytes) {
  if (!listener_) return std::nullopt;
  return client_ ? client_.write(bytes).value_or(0) : 0;
}

}  // namespace takt
