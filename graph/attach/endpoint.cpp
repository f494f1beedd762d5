// SPDX-License-Identifier: Apache-2.0
#include "graph/attach/endpoint.hpp"

#include <poll.h>
#include <sys/socket.h>
#include <sys/time.h>
#include <unistd.h>

#include <cerrno>
#include <csignal>
#include <utility>

namespace takt::attach {
namespace {

constexpr size_t kLongestLine = 4'000'000;

/// Where runs are looked for, the own ones first.
std::vector<SocketFolder> folders() {
  const Surroundings where = Surroundings::of_this_process();
  std::string passed_over;
  std::vector<SocketFolder> all;
  if (auto own = SocketFolder::own(where, passed_over)) all.push_back(std::move(*own));
  if (auto service = SocketFolder::of_service(where)) all.push_back(std::move(*service));
  return all;
}

}  // namespace

std::vector<int> running() {
  const std::vector<SocketFolder> places = folders();
  for (const auto whom : {SocketFolder::Of::run, SocketFolder::Of::replay})
    for (const SocketFolder& folder : places) {
      std::vector<int> pids;
      for (const int pid : folder.pids(whom)) {
        if (kill(pid, 0) == 0 || errno == EPERM) pids.push_back(pid);
        else folder.remove_socket(pid, whom);  // it was killed
      }
      if (!pids.empty()) return pids;
    }
  return {};
}

tl::expected<int, std::string> chosen_run(int wanted) {
  if (wanted > 0) return wanted;
  const std::vector<int> runs = running();
  if (runs.size() == 1) return runs.front();
  return tl::unexpected(runs.empty() ? "no run is there; start one with `takt run GRAPH`"
                                     : "there are several runs; say which one with --run PID");
}

Connection::Connection(int descriptor, int patience_ms) : descriptor_(descriptor) {
  const timeval patience{patience_ms / 1000, patience_ms % 1000 * 1000};
  setsockopt(descriptor_, SOL_SOCKET, SO_RCVTIMEO, &patience, sizeof patience);
  setsockopt(descriptor_, SOL_SOCKET, SO_SNDTIMEO, &patience, sizeof patience);
}

Connection::~Connection() {
  if (descriptor_ >= 0) close(descriptor_);
}

bool Connection::fill() {
  char buffer[65536];
  const ssize_t got = recv(descriptor_, buffer, sizeof buffer, 0);
  if (got <= 0) return false;
  rest_.append(buffer, static_cast<size_t>(got));
  return true;
}

std::optional<nlohmann::ordered_json> Connection::read_line() {
  size_t end;
  while ((end = rest_.find('\n')) == std::string::npos)
    if (rest_.size() > kLongestLine || !fill()) return std::nullopt;
  const std::string line = rest_.substr(0, end);
  rest_.erase(0, end + 1);
  auto parsed = nlohmann::ordered_json::parse(line, nullptr, false);
  if (parsed.is_discarded()) return std::nullopt;
  return parsed;
}

std::optional<std::string> Connection::read_bytes(size_t count) {
  constexpr size_t kAtOnce = 1 << 20;  // no more room than bytes come for
  std::string bytes = rest_.substr(0, count);
  rest_.erase(0, count);
  for (size_t have = bytes.size(); have < count;) {
    bytes.resize(std::min(count, have + kAtOnce));
    const ssize_t got = recv(descriptor_, bytes.data() + have, bytes.size() - have, MSG_WAITALL);
    if (got <= 0) return std::nullopt;
    have += static_cast<size_t>(got);
    bytes.resize(have);
  }
  return bytes;
}

bool Connection::write(const nlohmann::ordered_json& line, const std::string& bytes) {
  const std::string all = line.dump(-1, ' ', false, nlohmann::ordered_json::error_handler_t::replace) + "\n" + bytes;
  for (size_t sent = 0; sent < all.size();) {
    const ssize_t count = send(descriptor_, all.data() + sent, all.size() - sent, MSG_NOSIGNAL);
    if (count <= 0) return false;
    sent += static_cast<size_t>(count);
  }
  return true;
}

bool Connection::readable(int wait_ms) const {
  if (rest_.find('\n') != std::string::npos) return true;
  pollfd wait{descriptor_, POLLIN, 0};
  return poll(&wait, 1, wait_ms) > 0;
}

bool Connection::gone() const {
  char next = 0;
  return recv(descriptor_, &next, 1, MSG_PEEK | MSG_DONTWAIT) == 0;
}

std::optional<Connection> connect_to(int pid) {
  for (const SocketFolder& folder : folders())
    for (const auto whom : {SocketFolder::Of::run, SocketFolder::Of::replay}) {
      const int descriptor = socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0);
      if (descriptor < 0) return std::nullopt;
      const sockaddr_un address = folder.address(pid, whom);
      if (connect(descriptor, reinterpret_cast<const sockaddr*>(&address), sizeof address) == 0)
        return Connection(descriptor);
      close(descriptor);
    }
  return std::nullopt;
}

}  // namespace takt::attach
