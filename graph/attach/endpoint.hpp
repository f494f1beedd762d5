// SPDX-License-Identifier: Apache-2.0
// Where a running graph can be spoken to: a local socket in a folder that belongs to its user alone. A question is one
// line of JSON; an answer is one line of JSON, whose "bytes" says how many raw bytes follow it.
#pragma once
#include <sys/un.h>

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "hal/settings/json.hpp"

namespace takt::attach {

/// Folder of the sockets of this user's runs: $XDG_RUNTIME_DIR/takt, else /run/takt (root), else /tmp/takt.UID. Made
/// with mode 0700 if it is not there; empty with `why` where it cannot be made or belongs to somebody else.
std::filesystem::path socket_folder(std::string& why);

/// Process ids of the runs of this user that can be spoken to.
std::vector<int> running();

/// One connection, of either side. Reads and writes block, at most `patience_ms` each.
class Connection {
 public:
  explicit Connection(int descriptor, int patience_ms = 5000);
  Connection(Connection&& other) noexcept : descriptor_(other.descriptor_), rest_(std::move(other.rest_)) {
    other.descriptor_ = -1;
  }
  Connection(const Connection&) = delete;
  Connection& operator=(const Connection&) = delete;
  Connection& operator=(Connection&&) = delete;
  ~Connection();

  /// Null if the other side is gone, silent for too long or does not speak JSON.
  std::optional<nlohmann::ordered_json> read_line();
  std::optional<std::string> read_bytes(size_t count);
  bool write(const nlohmann::ordered_json& line, const std::string& bytes = "");
  /// True if the other side has gone. Does not wait.
  bool gone() const;

 private:
  bool fill();
  int descriptor_;
  std::string rest_;
};

/// Where the run with that process id listens, in `folder`; nothing with `why` if the path is too long for a socket.
std::optional<sockaddr_un> address_of(const std::filesystem::path& folder, int pid, std::string& why);

/// To the run with that process id.
std::optional<Connection> connect_to(int pid);

}  // namespace takt::attach
