// SPDX-License-Identifier: Apache-2.0
#include "graph/cli/boundary.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/mman.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <cerrno>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <new>
#include <string_view>
#include <system_error>

#include "graph/cli/outcome.hpp"
#include "rt/machine/limits.hpp"

namespace takt::command {
namespace {

std::string g_command_line;  // set before any thread is made
void (*g_ended)() = nullptr;
std::atomic<uint64_t>* g_unsaid_lines = nullptr;  // shared with the processes forked later

void hold_standard_streams() {
  for (const int stream : {STDIN_FILENO, STDOUT_FILENO, STDERR_FILENO})
    if (fcntl(stream, F_GETFD) < 0) open("/dev/null", O_RDWR);  // gets the lowest number that is free: this one
}

/// Handled rather than ignored: exec() sets handled signals back to their default, and leaves ignored ones ignored.
void outlive_failed_writes() {
  struct sigaction nothing {};
  nothing.sa_handler = [](int) {};
  nothing.sa_flags = SA_RESTART;
  for (const int signal : {SIGPIPE, SIGXFSZ}) {
    struct sigaction found {};
    sigaction(signal, nullptr, &found);
    if (found.sa_handler == SIG_DFL) sigaction(signal, &nothing, nullptr);
  }
}

ssize_t write_counted(void*, const char* text, size_t size) {
  for (size_t done = 0; done < size;) {
    const ssize_t written = write(STDERR_FILENO, text + done, size - done);
    if (written < 0 && errno == EINTR) continue;
    if (written <= 0) {
      const auto lines = std::count(text + done, text + size, '\n');
      g_unsaid_lines->fetch_add(static_cast<uint64_t>(std::max<ptrdiff_t>(lines, 1)), std::memory_order_relaxed);
      break;
    }
    done += static_cast<size_t>(written);
  }
  return static_cast<ssize_t>(size);  // a stream that failed once would give up
}

void count_unsaid_lines() {
  void* memory = mmap(nullptr, sizeof *g_unsaid_lines, PROT_READ | PROT_WRITE, MAP_SHARED | MAP_ANONYMOUS, -1, 0);
  if (memory == MAP_FAILED) return;
  std::FILE* counted = fopencookie(nullptr, "w", {nullptr, write_counted, nullptr, nullptr});
  if (counted == nullptr) return;
  g_unsaid_lines = ::new (memory) std::atomic<uint64_t>(0);
  setvbuf(counted, nullptr, _IONBF, 0);
  stderr = counted;
}

/// As it could be typed again.
std::string command_line(int argc, char** argv) {
  std::string line = argc > 0 ? std::filesystem::path(argv[0]).filename().string() : "takt";
  for (int i = 1; i < argc; ++i) {
    const std::string_view word = argv[i];
    const bool plain = !word.empty() && word.find_first_of(" \t\n'\"$*?\\()&;<>|`") == std::string_view::npos;
    line += plain ? fmt::format(" {}", word) : fmt::format(" '{}'", word);
  }
  return line;
}

/// Of an error of a library: without what it says of its own sources.
std::string reason_of(const std::exception& error) {
  std::string text = error.what();
  // OpenCV(4.6.0) ./modules/core/src/x.cpp:459: error: (-215:Assertion failed) WHAT in function 'f'\n
  if (text.starts_with("OpenCV(")) {
    const size_t begin = text.find(") ", text.find("error: ("));
    text = begin == std::string::npos ? text : "OpenCV: " + text.substr(begin + 2);
    if (const size_t where = text.find(" in function"); where != std::string::npos) text.resize(where);
  }
  while (!text.empty() && text.back() == '\n') text.pop_back();
  return text;
}

int refuse_command(const std::string& what, Exit code) {
  return refuse(fmt::format("`{}` failed: {}\n  fix: see whether each file of this command is what the command takes "
                            "(--help), and whether the machine has room for it",
                            g_command_line, what),
                code);
}

/// Whether it names what was wrong, as errors of Takt do.
bool speaks_for_itself(const std::exception& error) {
  const std::string_view what = error.what();
  return dynamic_cast<const std::system_error*>(&error) == nullptr && !what.starts_with("OpenCV(") &&
         !what.starts_with("yaml-cpp:") && !what.starts_with("std::") && what.find("::") == std::string_view::npos &&
         dynamic_cast<const std::bad_alloc*>(&error) == nullptr;
}

}  // namespace

void at_end(void (*ended)()) { g_ended = ended; }

int with_output(int code) {
  if (g_ended != nullptr) g_ended();
  errno = 0;
  if (std::fflush(stdout) == 0 && std::ferror(stdout) == 0) return code;
  if (errno == EPIPE) return code;
  const std::string reason = errno != 0 ? std::strerror(errno) : "an earlier write failed";
  refuse("stdout could not take all that was printed: " + reason, kDeviceOrSystem);
  return code == kOk ? kDeviceOrSystem : code;
}

int refuse(const std::exception& error) {
  if (const auto* output = dynamic_cast<const OutputError*>(&error))
    return refuse(OutputFailure{output->what(), output->system}, "");
  if (machine::scarce(error)) return refuse_command(machine::explain(error), kDeviceOrSystem);
  return speaks_for_itself(error) ? refuse(error.what(), kBadInput) : refuse_command(reason_of(error), kBadInput);
}

int at_boundary(int argc, char** argv, const std::function<int()>& body) {
  hold_standard_streams();
  outlive_failed_writes();
  count_unsaid_lines();
  machine::explain_what_nobody_catches();
  g_command_line = command_line(argc, argv);
  int code = kDeviceOrSystem;
  try {
    code = body();
  } catch (const std::exception& error) {
    code = speaks_for_itself(error) ? refuse_command(error.what(), kBadInput) : refuse(error);
  } catch (...) {
    code = refuse_command("an error without a name", kDeviceOrSystem);
  }
  return with_output(code);
}

uint64_t unsaid_lines() { return g_unsaid_lines == nullptr ? 0 : g_unsaid_lines->load(); }

bool output_gone() { return std::ferror(stdout) != 0; }

}  // namespace takt::command
