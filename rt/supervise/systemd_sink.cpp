// SPDX-License-Identifier: Apache-2.0
// The protocol of sd_notify(3), which systemd documents as stable: datagrams to the socket that NOTIFY_SOCKET names.
#include "rt/supervise/systemd_sink.hpp"

#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

#include <algorithm>
#include <charconv>
#include <cstddef>
#include <cstdlib>
#include <string_view>

namespace takt {
namespace {

/// The number in a variable of the environment; 0 if it holds none.
int64_t number_of(const char* variable) {
  const char* const text = std::getenv(variable);
  if (text == nullptr) return 0;
  const std::string_view all(text);
  int64_t number = 0;
  const auto [end, error] = std::from_chars(all.data(), all.data() + all.size(), number);
  return error == std::errc{} && end == all.data() + all.size() ? number : 0;
}

class SystemdSink final : public WatchdogSink {
 public:
  explicit SystemdSink(std::string_view socket) {
    if (socket.size() >= sizeof to_.sun_path || (socket[0] != '/' && socket[0] != '@')) return;
    to_.sun_family = AF_UNIX;
    std::copy(socket.begin(), socket.end(), to_.sun_path);
    to_bytes_ = static_cast<socklen_t>(offsetof(sockaddr_un, sun_path) + socket.size() + (socket[0] == '/'));
    if (socket[0] == '@') to_.sun_path[0] = '\0';  // an abstract one
    const bool for_us = std::getenv("WATCHDOG_PID") == nullptr || number_of("WATCHDOG_PID") == getpid();
    if (for_us) timeout_ns_ = std::clamp<int64_t>(number_of("WATCHDOG_USEC"), 0, INT64_MAX / 1000) * 1000;
  }
  int64_t timeout_ns() const override { return timeout_ns_; }
  void ready() override { notify("READY=1"); }
  void feed() override { notify("WATCHDOG=1"); }
  void status(const std::string& text) override { notify("STATUS=" + text); }
  void end() override { notify("STOPPING=1"); }

 private:
  // A notification that does not get through is one that systemd misses: it acts then, as it should.
  void notify(const std::string& state) const {
    const int from = socket(AF_UNIX, SOCK_DGRAM | SOCK_CLOEXEC, 0);
    if (from < 0) return;
    static_cast<void>(
        !sendto(from, state.data(), state.size(), MSG_NOSIGNAL, reinterpret_cast<const sockaddr*>(&to_), to_bytes_));
    close(from);
  }
  sockaddr_un to_{};
  socklen_t to_bytes_ = 0;
  int64_t timeout_ns_ = 0;
};

}  // namespace

std::unique_ptr<WatchdogSink> systemd_sink() {
  const char* const socket = std::getenv("NOTIFY_SOCKET");
  if (socket == nullptr || *socket == '\0') return nullptr;
  return std::make_unique<SystemdSink>(socket);
}

}  // namespace takt
