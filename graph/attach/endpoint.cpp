// SPDX-License-Identifier: Apache-2.0
#include "graph/attach/endpoint.hpp"

#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/time.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <csignal>
#include <cstdlib>
#include <cstring>

namespace takt::attach {
namespace {

constexpr size_t kLongestLine = 4'000'000;

std::filesystem::path wanted_folder() {
  const char* runtime = std::getenv("XDG_RUNTIME_DIR");
  if (runtime != nullptr && *runtime != 0 && access(runtime, W_OK) == 0) return std::filesystem::path(runtime) / "takt";
  if (geteuid() == 0 && access("/run", W_OK) == 0) return "/run/takt";
  return "/tmp/takt." + std::to_string(geteuid());
}

}  // namespace

std::filesystem::path socket_folder(std::string& why) {
  const std::filesystem::path folder = wanted_folder();
  if (mkdir(folder.c_str(), 0700) != 0 && errno != EEXIST) {
    why = folder.string() + ": " + std::strerror(errno);
    return {};
  }
  struct stat facts {};
  if (lstat(folder.c_str(), &facts) != 0 || !S_ISDIR(facts.st_mode) || facts.st_uid != geteuid() ||
      (facts.st_mode & 077) != 0) {
    why = folder.string() + " is no folder of this user alone (mode 0700); remove it";
    return {};
  }
  return folder;
}

std::vector<int> running() {
  std::string why;
  std::vector<int> pids;
  const auto folder = socket_folder(why);
  std::error_code error;
  for (const auto& entry : std::filesystem::directory_iterator(folder, error)) {
    const int pid = std::atoi(entry.path().stem().c_str());
    if (entry.path().extension() != ".sock" || pid <= 0) continue;
    if (kill(pid, 0) == 0 || errno == EPERM) pids.push_back(pid);
    else std::filesystem::remove(entry.path(), error);  // it was killed
  }
  std::sort(pids.begin(), pids.end());
  return pids;
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
  while (rest_.size() < count)
    if (!fill()) return std::nullopt;
  std::string bytes = rest_.substr(0, count);
  rest_.erase(0, count);
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

bool Connection::gone() const {
  char next = 0;
  return recv(descriptor_, &next, 1, MSG_PEEK | MSG_DONTWAIT) == 0;
}

std::optional<sockaddr_un> address_of(const std::filesystem::path& folder, int pid, std::string& why) {
  const std::string path = folder / (std::to_string(pid) + ".sock");
  sockaddr_un address{};
  address.sun_family = AF_UNIX;
  if (path.size() >= sizeof address.sun_path) {
    why = path + " is too long for a socket; choose a shorter XDG_RUNTIME_DIR";
    return std::nullopt;
  }
  std::memcpy(address.sun_path, path.c_str(), path.size());
  return address;
}

std::optional<Connection> connect_to(int pid) {
  std::string why;
  const auto folder = socket_folder(why);
  if (folder.empty()) return std::nullopt;
  const auto address = address_of(folder, pid, why);
  if (!address) return std::nullopt;
  const int descriptor = socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0);
  if (descriptor < 0) return std::nullopt;
  if (connect(descriptor, reinterpret_cast<const sockaddr*>(&*address), sizeof *address) != 0) {
    close(descriptor);
    return std::nullopt;
  }
  return Connection(descriptor);
}

}  // namespace takt::attach
