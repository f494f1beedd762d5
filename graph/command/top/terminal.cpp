// SPDX-License-Identifier: Apache-2.0
#include "graph/command/top/terminal.hpp"

#include <fcntl.h>
#include <sys/ioctl.h>
#include <termios.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <cerrno>
#include <csignal>
#include <cstdlib>
#include <span>
#include <string>
#include <utility>

namespace takt::top {
namespace {

/// Alternate screen, no cursor.
constexpr std::string_view kTake = "\x1b[?1049h\x1b[?25l\x1b[H\x1b[2J";
/// The last line is for a terminal without an alternate screen: what comes next stands below the page.
constexpr std::string_view kGiveBack = "\x1b[0m\x1b[999;1H\r\n\x1b[?25h\x1b[?1049l";

constexpr std::array kEnding{SIGINT, SIGTERM, SIGHUP};
constexpr std::array kFatal{SIGQUIT, SIGABRT, SIGSEGV, SIGBUS, SIGFPE, SIGILL};
constexpr std::array kNoted{SIGWINCH, SIGTSTP};

// Handlers of signals know them; one Terminal at a time.
volatile std::sig_atomic_t g_ended = 0, g_suspend = 0, g_taken = 0;
termios g_before;
bool g_keys = false;
int g_pipe[2] = {-1, -1};
std::array<struct sigaction, NSIG> g_actions;

/// Calls only what a handler may call.
void give_back() {
  if (g_taken == 0) return;
  g_taken = 0;
  if (g_keys) tcsetattr(STDIN_FILENO, TCSANOW, &g_before);
  [[maybe_unused]] const ssize_t written = ::write(STDOUT_FILENO, kGiveBack.data(), kGiveBack.size());
}

void note(int signal) {
  const int error = errno;
  if (signal == SIGTSTP) g_suspend = 1;
  [[maybe_unused]] const ssize_t written = ::write(g_pipe[1], "", 1);
  errno = error;
}

void die(int signal) {
  sigaction(signal, &g_actions[static_cast<size_t>(signal)], nullptr);
  give_back();
  raise(signal);
}

void end(int signal) {
  if (g_ended != 0) {
    struct sigaction action {};
    action.sa_handler = SIG_DFL;
    for (const int ending : kEnding) sigaction(ending, &action, nullptr);  // a third one ends a write that hangs
    give_back();
    raise(signal);
    return;
  }
  g_ended = signal;
  note(signal);
}

void handle(int signal, void (*handler)(int)) {
  struct sigaction action {};
  action.sa_handler = handler;
  struct sigaction& before = g_actions[static_cast<size_t>(signal)];
  sigaction(signal, &action, &before);
  if (before.sa_handler == SIG_IGN) sigaction(signal, &before, nullptr);  // nohup
}

bool names_utf8(std::string_view locale) {
  std::string letters;
  for (const char c : locale)
    if (std::isalnum(static_cast<unsigned char>(c)) != 0)
      letters += static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  return letters.find("utf8") != std::string::npos;
}

std::string_view environment(const char* name) {
  const char* value = std::getenv(name);
  return value == nullptr ? "" : value;
}

size_t number_or(std::string_view text, size_t otherwise) {
  const long number = std::strtol(std::string(text).c_str(), nullptr, 10);
  return number > 0 && number < 10000 ? static_cast<size_t>(number) : otherwise;
}

}  // namespace

Terminal::Terminal() {
  g_ended = 0;
  g_suspend = 0;
  if (pipe2(g_pipe, O_CLOEXEC | O_NONBLOCK) != 0) g_pipe[0] = g_pipe[1] = -1;
  keys_ = g_keys = isatty(STDIN_FILENO) != 0 && tcgetattr(STDIN_FILENO, &g_before) == 0;
  handle_signals();
  take();
}

Terminal::~Terminal() {
  give_back();
  for (const auto& signals :
       {std::span<const int>(kEnding), std::span<const int>(kFatal), std::span<const int>(kNoted)})
    for (const int signal : signals) sigaction(signal, &g_actions[static_cast<size_t>(signal)], nullptr);
  for (int& end_of_pipe : g_pipe)
    if (end_of_pipe >= 0) close(std::exchange(end_of_pipe, -1));
}

void Terminal::handle_signals() {
  for (const int signal : kEnding) handle(signal, end);
  for (const int signal : kFatal) handle(signal, die);
  for (const int signal : kNoted) handle(signal, note);
}

void Terminal::take() {
  g_taken = 1;
  if (keys_) {
    termios raw = g_before;
    raw.c_lflag &= ~static_cast<tcflag_t>(ICANON | ECHO | IEXTEN);
    raw.c_iflag &= ~static_cast<tcflag_t>(IXON | ICRNL);
    raw.c_cc[VMIN] = 0;
    raw.c_cc[VTIME] = 0;
    raw.c_cc[VSUSP] = raw.c_cc[VQUIT] = _POSIX_VDISABLE;  // Ctrl-Z comes as a key
    tcsetattr(STDIN_FILENO, TCSANOW, &raw);
  }
  write(kTake);
}

Size Terminal::size() const {
  winsize size{};
  if (ioctl(STDOUT_FILENO, TIOCGWINSZ, &size) != 0) size = {};
  return {size.ws_col > 0 ? size.ws_col : number_or(environment("COLUMNS"), 80),
          size.ws_row > 0 ? size.ws_row : number_or(environment("LINES"), 24)};
}

int Terminal::signals() const { return g_pipe[0]; }

void Terminal::heard() {
  char bytes[64];
  while (read(g_pipe[0], bytes, sizeof bytes) > 0) {
  }
}

int Terminal::ended() { return g_ended; }

bool Terminal::suspension_asked() {
  const bool asked = g_suspend != 0;
  g_suspend = 0;
  return asked;
}

void Terminal::suspend() {
  give_back();
  struct sigaction action {
  }, before{};
  action.sa_handler = SIG_DFL;
  sigaction(SIGTSTP, &action, &before);
  kill(0, SIGTSTP);  // all of the job, as the key does in any other program
  sigaction(SIGTSTP, &before, nullptr);
  g_suspend = 0;
  if (g_ended == 0) take();
}

bool Terminal::write(std::string_view bytes) {
  while (!bytes.empty()) {
    const ssize_t written = ::write(STDOUT_FILENO, bytes.data(), bytes.size());
    if (written > 0) bytes.remove_prefix(static_cast<size_t>(written));
    else if (written < 0 && errno == EINTR && g_ended == 0) continue;
    else if (written < 0 && errno == EAGAIN && g_ended == 0) usleep(10'000);  // somebody made it non-blocking
    else return false;
  }
  return true;
}

Look look_of_environment() {
  const std::string_view term = environment("TERM");
  Look look{environment("NO_COLOR").empty() && !term.empty() && term != "dumb", false};
  for (const char* name : {"LC_ALL", "LC_CTYPE", "LANG"})
    if (const std::string_view locale = environment(name); !locale.empty()) {
      look.utf8 = names_utf8(locale);
      break;
    }
  return look;
}

}  // namespace takt::top
