// SPDX-License-Identifier: Apache-2.0
#include "hal/stream/tcp_connection.hpp"

#include <netdb.h>
#include <netinet/in.h>
#include <netinet/tcp.h>
#include <poll.h>
#include <sys/socket.h>

#include <cerrno>
#include <cstring>
#include <memory>

namespace takt {
namespace {

constexpr int kAnswerWithin_ms = 150;

/// Of a numeric address; null if it is none.
std::unique_ptr<addrinfo, void (*)(addrinfo*)> resolve(const std::string& address) {
  const size_t colon = address.rfind(':');
  std::string host = address.substr(0, colon);
  if (host.size() > 2 && host.front() == '[' && host.back() == ']') host = host.substr(1, host.size() - 2);
  const std::string port = colon == std::string::npos ? "" : address.substr(colon + 1);
  addrinfo hints{}, *found = nullptr;
  hints.ai_socktype = SOCK_STREAM;
  hints.ai_flags = AI_NUMERICHOST | AI_NUMERICSERV;
  const bool good = !host.empty() && !port.empty() && getaddrinfo(host.c_str(), port.c_str(), &hints, &found) == 0;
  return {good ? found : nullptr, freeaddrinfo};
}

/// 0, or why there is no connection.
int connect_within(int socket, const addrinfo& to) {
  if (connect(socket, to.ai_addr, to.ai_addrlen) == 0) return 0;
  if (errno != EINPROGRESS) return errno;
  pollfd wait{socket, POLLOUT, 0};
  if (poll(&wait, 1, kAnswerWithin_ms) <= 0) return ETIMEDOUT;
  int error = 0;
  socklen_t size = sizeof error;
  getsockopt(socket, SOL_SOCKET, SO_ERROR, &error, &size);
  return error;
}

}  // namespace

DeviceResult TcpConnection::open() {
  socket_.close();
  const auto to = resolve(address_);
  if (!to)
    return device_error(id_, "`" + address_ + "` is no address",
                        "write the device's numbers and its port, for instance 192.168.0.1:2111");
  socket_ = Descriptor(socket(to->ai_family, SOCK_STREAM | SOCK_NONBLOCK | SOCK_CLOEXEC, 0));
  const int error = socket_ ? connect_within(socket_.get(), *to) : errno;
  if (error != 0) {
    socket_.close();
    return device_failure(id_, address_ + ": " + std::strerror(error),
                          "is the device on, and in this network? `ping` it");
  }
  const int on = 1;
  setsockopt(socket_.get(), IPPROTO_TCP, TCP_NODELAY, &on, sizeof on);
  return {};
}

}  // namespace takt
