// SPDX-License-Identifier: Apache-2.0
#include "graph/cli/outcome.hpp"

#include <fcntl.h>
#include <unistd.h>

#include <cerrno>
#include <cstdio>
#include <cstring>

#include "graph/language/share.hpp"

namespace takt::command {
namespace {

void (*g_ended)() = nullptr;

}  // namespace

void at_end(void (*ended)()) { g_ended = ended; }

int refuse(const std::string& text, Exit code) {
  std::fprintf(stderr, "takt: error: %s\n", text.c_str());
  return code;
}

void hold_standard_streams() {
  for (const int stream : {STDIN_FILENO, STDOUT_FILENO, STDERR_FILENO})
    if (fcntl(stream, F_GETFD) < 0) open("/dev/null", O_RDWR);  // gets the lowest number that is free: this one
}

int with_output(int code) {
  if (g_ended != nullptr) g_ended();
  errno = 0;
  if (std::fflush(stdout) == 0 && std::ferror(stdout) == 0) return code;
  if (errno == EPIPE) return code;
  const std::string reason = errno != 0 ? std::strerror(errno) : "an earlier write failed";
  refuse("stdout could not take all that was printed: " + reason, kDeviceOrSystem);
  return code == kOk ? kDeviceOrSystem : code;
}

std::filesystem::path shipped(const std::filesystem::path& relative) {
  const std::filesystem::path share = graph::share_folder();
  return share.empty() ? relative : share / relative;
}

}  // namespace takt::command
