// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <fcntl.h>
#include <poll.h>
#include <spawn.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <sys/wait.h>
#include <unistd.h>

#include <csignal>
#include <string>

#include "tests/temporary_folder.hpp"

extern char** environ;

namespace takt::test {

/// A D-Bus daemon of the test's own, which ends with it.
class PrivateBus {
 public:
  PrivateBus() {
    const std::string path = (folder_.path / "bus").string(), option = "--address=unix:path=" + path;
    const char* arguments[] = {"dbus-daemon", "--session", "--nofork", "--nopidfile", option.c_str(), nullptr};
    if (posix_spawnp(&daemon_, arguments[0], nullptr, nullptr, const_cast<char**>(arguments), environ) != 0) {
      daemon_ = -1;
      return;
    }
    for (int tries = 0; tries < 1000 && !there_; ++tries) {
      there_ = listens(path);
      if (!there_) poll(nullptr, 0, 10);
    }
    address_ = "unix:path=" + path;
  }
  ~PrivateBus() { end(); }
  PrivateBus(const PrivateBus&) = delete;
  PrivateBus& operator=(const PrivateBus&) = delete;
  /// False where there is no dbus-daemon.
  bool there() const { return there_; }
  const std::string& address() const { return address_; }
  void end() {
    if (daemon_ <= 0) return;
    kill(daemon_, SIGKILL);
    waitpid(daemon_, nullptr, 0);
    daemon_ = -1;
  }

 private:
  /// The socket is there before its daemon listens; until then who connects is refused.
  static bool listens(const std::string& path) {
    sockaddr_un address{};
    address.sun_family = AF_UNIX;
    if (path.size() >= sizeof address.sun_path) return false;
    path.copy(address.sun_path, path.size());
    const int probe = socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0);
    const bool taken = connect(probe, reinterpret_cast<const sockaddr*>(&address), sizeof address) == 0;
    close(probe);
    return taken;
  }

  TemporaryFolder folder_;
  pid_t daemon_ = -1;
  bool there_ = false;
  std::string address_;
};

}  // namespace takt::test
