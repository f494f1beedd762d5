// SPDX-License-Identifier: Apache-2.0
#include "graph/run/web_beside.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <poll.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstdio>
#include <cstring>
#include <stdexcept>

#include "graph/cli/other_program.hpp"
#include "rt/time/clock.hpp"

namespace takt::command {
namespace {

constexpr int64_t kPatienceNs = 10'000'000'000;
constexpr ptrdiff_t kLines = 2;  ///< what it says once it is up: the page, and Foxglove

/// In the process that is to become the program.
[[noreturn]] void wait_and_become(int go, int told, char* const* arguments) {
  char word = 0;
  if (read(go, &word, 1) != 1) _exit(0);  // whoever would have said so has ended
  dup2(told, STDOUT_FILENO);
  execv(arguments[0], arguments);
  _exit(127);
}

void make_pipe(int (&ends)[2]) {
  if (pipe2(ends, O_CLOEXEC) != 0) throw std::runtime_error(std::string("a pipe: ") + std::strerror(errno));
}

}  // namespace

WebBeside::WebBeside(std::vector<std::string> arguments) {
  int go[2], told[2];
  make_pipe(go), make_pipe(told);
  std::vector<char*> words;
  for (std::string& argument : arguments) words.push_back(argument.data());
  words.push_back(nullptr);
  const pid_t parent = fork();
  if (parent == 0) {
    // Of nobody's children, so that whoever waits for all of this process's does not meet it.
    if (fork() != 0) _exit(0);
    close(go[1]), close(told[0]);
    wait_and_become(go[0], told[1], words.data());
  }
  close(go[0]), close(told[1]);
  go_ = go[1], told_ = told[0];
  if (parent > 0) waitpid(parent, nullptr, 0);
}

WebBeside::~WebBeside() {
  if (go_ >= 0) close(go_);
  if (told_ >= 0) close(told_);
}

tl::expected<void, std::string> WebBeside::begin() {
  const char word = 1;
  const bool asked = write(go_, &word, 1) == 1;
  std::string said;
  const MonotonicClock clock;
  const int64_t until_ns = clock.now_ns() + kPatienceNs;
  while (asked && std::count(said.begin(), said.end(), '\n') < kLines) {
    pollfd from{told_, POLLIN, 0};
    const int64_t left_ms = (until_ns - clock.now_ns()) / 1'000'000;
    if (left_ms <= 0 || poll(&from, 1, static_cast<int>(left_ms)) == 0)
      return tl::make_unexpected(std::string("--web: takt-web is not up after 10 s"));
    char text[512];
    const ssize_t bytes = read(told_, text, sizeof text);
    if (bytes < 0 && errno == EINTR) continue;
    if (bytes <= 0) break;
    said.append(text, static_cast<size_t>(bytes));
  }
  if (std::count(said.begin(), said.end(), '\n') < kLines)
    return tl::make_unexpected(std::string("--web: takt-web did not start; without --web the run needs none"));
  std::fputs(said.c_str(), stderr);
  return {};
}

tl::expected<std::string, std::string> web_program() {
  std::string program = other_program("web").string();
  if (!program.empty()) return program;
  return tl::make_unexpected(
      std::string("--web: takt-web is not there; `./takt web --help` of a checkout builds it (libwebsockets-dev)"));
}

tl::expected<void, std::string> begin_web(const RunOptions& options) {
  return options.shown ? options.shown->begin() : tl::expected<void, std::string>();
}

std::vector<std::string> web_arguments(const std::string& program, const graph::WebSpec& web) {
  std::vector<std::string> all{program, "--with-run", std::to_string(getpid())};
  const auto add = [&](const char* option, const std::string& value) {
    if (value.empty()) return;
    all.emplace_back(option);
    all.push_back(value);
  };
  add("--port", web.port > 0 ? std::to_string(web.port) : "");
  add("--address", web.address);
  add("--certificate", web.certificate.string());
  add("--key", web.key.string());
  add("--token-file", web.token_file.string());
  for (const std::string& host : web.hosts) add("--host", host);
  for (const std::string& origin : web.origins) add("--origin", origin);
  return all;
}

}  // namespace takt::command
