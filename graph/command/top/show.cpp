// SPDX-License-Identifier: Apache-2.0
#include "graph/command/top/show.hpp"

#include <poll.h>
#include <unistd.h>

#include <array>
#include <csignal>
#include <cstdio>
#include <optional>
#include <utility>
#include <vector>

#include "graph/cli/outcome.hpp"
#include "graph/command/top/frame.hpp"
#include "graph/command/top/screen.hpp"
#include "graph/command/top/terminal.hpp"
#include "rt/time/clock.hpp"

namespace takt::top {
namespace {

using command::kDeviceOrSystem;
using command::kOk;

constexpr int kStateEveryMs = 500;
constexpr int kIdleMs = 1000;
constexpr int kEscapeMs = 50;  ///< later bytes are no part of a key's sequence, also over ssh

double seconds_now() { return static_cast<double>(MonotonicClock().now_ns()) / 1e9; }

/// What the run says of itself, once it goes on to say how it stands; an object with "error" if it refuses; nothing if
/// it has ended.
std::optional<Json> begin_to_follow(attach::Connection& connection) {
  if (!connection.write({{"do", "describe"}})) return std::nullopt;
  auto description = connection.read_line();
  if (!description || description->contains("error")) return description;
  if (!connection.write({{"do", "follow"}}) || !connection.write({{"state_every_ms", kStateEveryMs}}))
    return std::nullopt;
  return description;
}

/// What is looked at, and how far it has come.
class Show {
 public:
  Show(attach::Connection connection, Watched run) : run_(std::move(run)) {
    connection_.emplace(std::move(connection));
  }
  /// False: the run has ended.
  bool go_on_until_end();

 private:
  void draw();
  void wait();
  void take_keys();
  bool take_lines();
  bool connect_again();
  void suspend();

  std::optional<attach::Connection> connection_;
  Watched run_;
  Terminal terminal_;
  const Look look_ = look_of_environment();
  attach::MachineUse use_;
  Frame frame_;
  KeyReader reader_;
  View view_;
  Extent extent_;
  bool quiet_ = false;  ///< the last wait brought nothing
  double heard_s_ = seconds_now();
};

bool Show::go_on_until_end() {
  while (!view_.ended && Terminal::ended() == 0) {
    draw();
    wait();
    if (Terminal::suspension_asked()) suspend();
    take_keys();
    if (!take_lines() && !connect_again()) return false;
  }
  return true;
}

void Show::draw() {
  const Window window{terminal_.size(), look_, seconds_now() - heard_s_};
  const Screen screen = screen_of(run_, view_, window);
  extent_ = screen.extent;
  if (!terminal_.write(frame_.difference(screen.lines, window.size, look_))) view_.ended = true;
}

void Show::wait() {
  quiet_ = false;
  if (connection_->readable(0)) return;
  std::array<pollfd, 3> sources{{{terminal_.signals(), POLLIN, 0},
                                 {connection_->descriptor(), POLLIN, 0},
                                 {terminal_.keys() ? STDIN_FILENO : -1, POLLIN, 0}}};
  quiet_ = poll(sources.data(), sources.size(), reader_.waiting() ? kEscapeMs : kIdleMs) == 0;
  terminal_.heard();
  if ((sources[2].revents & (POLLHUP | POLLERR | POLLNVAL)) != 0) view_.ended = true;  // nobody looks any more
}

void Show::take_keys() {
  if (!terminal_.keys()) return;
  char bytes[256];
  const ssize_t count = read(STDIN_FILENO, bytes, sizeof bytes);
  const auto keys = count > 0 ? reader_.read({bytes, static_cast<size_t>(count)})
                    : quiet_  ? reader_.rest()
                              : std::vector<Key>{};
  for (const Key& key : keys) {
    view_ = after(view_, key, extent_);
    if (key.kind == Key::Kind::redraw) frame_.forget();
    if (key.kind == Key::Kind::suspend) suspend();
    extent_ = screen_of(run_, view_, {terminal_.size(), look_, 0}).extent;  // the next key may mean another page
  }
}

bool Show::take_lines() {
  while (connection_->readable(0)) {
    const auto line = connection_->read_line();
    if (!line) return false;
    take(*line, run_);
    heard_s_ = seconds_now();
    std::vector<int> pids;
    for (const ProcessSeen& process : run_.processes) pids.push_back(process.pid);
    take_use(use_.look(pids, MonotonicClock().now_ns()), run_);
  }
  return true;
}

/// A run sends nobody what he does not read in time: after a suspension, or where the terminal hangs, the connection is
/// lost and the run is not.
bool Show::connect_again() {
  auto connection = attach::connect_to(run_.pid);
  if (!connection) return false;
  const auto description = begin_to_follow(*connection);
  if (!description || description->contains("error")) return false;
  run_ = watched(*description);
  connection_.emplace(std::move(*connection));
  return true;
}

void Show::suspend() {
  terminal_.suspend();
  frame_.forget();
}

}  // namespace

int show(attach::Connection connection) {
  const auto description = begin_to_follow(connection);
  if (!description) return command::refuse("the run has ended, or does not answer", kDeviceOrSystem);
  if (description->contains("error"))
    return command::refuse(description->at("error").get<std::string>(), kDeviceOrSystem);
  Watched run = watched(*description);
  bool runs = true;
  {
    Show shown(std::move(connection), std::move(run));
    runs = shown.go_on_until_end();
  }
  if (!runs) std::fputs("takt: the run has ended\n", stderr);
  if (const int signal = Terminal::ended(); signal != 0 && signal != SIGINT) raise(signal);
  return kOk;
}

}  // namespace takt::top
