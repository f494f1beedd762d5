// SPDX-License-Identifier: Apache-2.0
// How a running graph is spoken to: over a local socket in a SocketFolder. A question is one line of JSON; an answer is
// one line of JSON, whose "bytes" says how many raw bytes follow it.
#pragma once
#include <optional>
#include <string>
#include <tl/expected.hpp>
#include <vector>

#include "graph/attach/socket_folder.hpp"
#include "hal/settings/json.hpp"

namespace takt::attach {

/// Process ids of the runs that can be spoken to: of this user; if there are none, of the service (see SocketFolder).
/// Replays are not among them, as long as there is a run.
std::vector<int> running();

/// The one that an observer follows: `wanted`, or the one that there is. Error: there is none, or several.
tl::expected<int, std::string> chosen_run(int wanted);

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
  /// True if a line may be there, or the end; waits for it so long.
  bool readable(int wait_ms) const;
  /// True if the other side has gone. Does not wait.
  bool gone() const;
  /// To wait for with others in poll(2). What came with an earlier line does not show there: see readable().
  int descriptor() const { return descriptor_; }

 private:
  bool fill();
  int descriptor_;
  std::string rest_;
};

/// To the run or replay with that process id, of this user or of the service.
std::optional<Connection> connect_to(int pid);

}  // namespace takt::attach
