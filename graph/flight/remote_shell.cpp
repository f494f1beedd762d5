// SPDX-License-Identifier: Apache-2.0
#include "graph/flight/remote_shell.hpp"

#include <fcntl.h>
#include <poll.h>
#include <spawn.h>
#include <sys/socket.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <csignal>
#include <cstring>
#include <utility>

namespace takt::flight {
namespace {

constexpr size_t kBuffer = 64 << 10;
constexpr size_t kLongestLine = 64 << 10;
constexpr int kLookMs = 200;  // for a reason to stop

}  // namespace

std::string shell_word(std::string_view text) {
  std::string word = "'";
  for (const char c : text) c == '\'' ? word += "'\\''" : word += c;
  return word + "'";
}

tl::expected<RemoteShell, std::string> RemoteShell::here() { return start({"sh"}); }

tl::expected<RemoteShell, std::string> RemoteShell::over(const std::string& ssh, const std::string& host) {
  return start({"sh", "-c", "exec " + ssh + " \"$@\"", "sh", host, "sh"});
}

tl::expected<RemoteShell, std::string> RemoteShell::start(const std::vector<std::string>& words) {
  std::vector<char*> arguments;
  for (const std::string& word : words) arguments.push_back(const_cast<char*>(word.c_str()));
  arguments.push_back(nullptr);
  // A socket: to write to one that is gone needs no signal.
  std::array<int, 2> to{}, from{};
  if (socketpair(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0, to.data()) != 0) return tl::unexpected(std::strerror(errno));
  if (pipe2(from.data(), O_CLOEXEC) != 0) {
    const int reason = errno;
    for (const int end : to) close(end);
    return tl::unexpected(std::strerror(reason));
  }
  posix_spawn_file_actions_t actions;
  posix_spawn_file_actions_init(&actions);
  posix_spawn_file_actions_adddup2(&actions, to[1], STDIN_FILENO);
  posix_spawn_file_actions_adddup2(&actions, from[1], STDOUT_FILENO);
  pid_t process = -1;
  const int reason = posix_spawn(&process, "/bin/sh", &actions, nullptr, arguments.data(), environ);
  posix_spawn_file_actions_destroy(&actions);
  close(to[1]);
  close(from[1]);
  RemoteShell shell(reason == 0 ? process : -1, to[0], from[0]);
  if (reason != 0) return tl::unexpected(std::string("/bin/sh: ") + std::strerror(reason));
  return shell;
}

RemoteShell::RemoteShell(RemoteShell&& other) noexcept
    : process_(std::exchange(other.process_, -1)),
      to_(std::exchange(other.to_, -1)),
      from_(std::exchange(other.from_, -1)),
      stopped_(std::move(other.stopped_)),
      buffer_(std::move(other.buffer_)),
      taken_(other.taken_) {}

RemoteShell::~RemoteShell() {
  if (process_ > 0) kill(process_, SIGTERM);  // it may wait for a machine that has gone
  end();
}

int RemoteShell::end() {
  for (int* descriptor : {&to_, &from_})
    if (*descriptor >= 0) close(std::exchange(*descriptor, -1));
  if (process_ <= 0) return 0;
  int status = 0;
  while (waitpid(process_, &status, 0) < 0 && errno == EINTR) {
  }
  process_ = -1;
  return WIFSIGNALED(status) ? 128 + WTERMSIG(status) : WEXITSTATUS(status);
}

void RemoteShell::say(std::string_view script) {
  const std::string line = std::string(script) + "\n";
  for (std::string_view rest = line; !rest.empty();) {
    const ssize_t sent = send(to_, rest.data(), rest.size(), MSG_NOSIGNAL);
    if (sent < 0 && errno == EINTR) continue;
    if (sent <= 0) return;
    rest.remove_prefix(static_cast<size_t>(sent));
  }
}

bool RemoteShell::fill() {
  pollfd wait{from_, POLLIN, 0};
  for (;;) {
    if (stopped_ && stopped_()) return false;
    const int ready = poll(&wait, 1, kLookMs);
    if (ready == 0 || (ready < 0 && errno == EINTR)) continue;
    buffer_.resize(kBuffer);
    const ssize_t got = ready < 0 ? -1 : ::read(from_, buffer_.data(), buffer_.size());
    if (got < 0 && errno == EINTR) continue;
    buffer_.resize(static_cast<size_t>(std::max<ssize_t>(got, 0)));
    taken_ = 0;
    return got > 0;
  }
}

size_t RemoteShell::read(std::span<std::byte> into) {
  if (into.empty() || (taken_ == buffer_.size() && !fill())) return 0;
  const size_t size = std::min(into.size(), buffer_.size() - taken_);
  std::memcpy(into.data(), buffer_.data() + taken_, size);
  taken_ += size;
  return size;
}

std::optional<std::string> RemoteShell::line() {
  std::string text;
  for (std::byte next{}; text.size() < kLongestLine && read({&next, 1}) == 1; text += static_cast<char>(next))
    if (next == std::byte{'\n'}) return text;
  return std::nullopt;
}

}  // namespace takt::flight
