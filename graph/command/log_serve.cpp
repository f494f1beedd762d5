// SPDX-License-Identifier: Apache-2.0
#include "graph/command/log_serve.hpp"

#include <fmt/format.h>
#include <poll.h>
#include <unistd.h>

#include <cerrno>
#include <chrono>
#include <cstdio>
#include <cstring>
#include <string>

#include "graph/cli/file_option.hpp"
#include "graph/cli/outcome.hpp"
#include "graph/cli/set_option.hpp"
#include "graph/command/stop_asked.hpp"
#include "graph/flight/serve.hpp"

namespace takt::command {
namespace {

constexpr int kLookAtRingMs = 200;  // a run writes a chunk a second

/// What is appended in part stays: readers cut it off.
class StandardOutput final : public mcap::Sink {
 public:
  tl::expected<void, std::string> append(std::span<const mcap::Bytes> parts) override {
    for (mcap::Bytes rest : parts)
      while (!rest.empty()) {
        const ssize_t written = ::write(STDOUT_FILENO, rest.data(), rest.size());
        if (written > 0) rest = rest.subspan(static_cast<size_t>(written));
        else if (errno == EAGAIN) look(POLLOUT, -1);
        else if (errno != EINTR) return tl::unexpected(refused(errno));
      }
    return {};
  }
  /// Returns sooner if the reader goes.
  void wait() { look(0, kLookAtRingMs); }
  bool gone() const { return gone_; }

 private:
  void look(short events, int most_ms) {
    pollfd wait{STDOUT_FILENO, events, 0};
    if (poll(&wait, 1, most_ms) > 0 && (wait.revents & (POLLERR | POLLHUP)) != 0) gone_ = true;
  }
  std::string refused(int reason) {
    gone_ = gone_ || reason == EPIPE;
    return std::strerror(reason);
  }
  bool gone_ = false;
};

void say_served(const std::string& line) { std::fprintf(stderr, "takt: %s\n", line.c_str()); }

}  // namespace

int log_serve(const LogServeOptions& options) {
  using std::chrono::steady_clock;
  if (isatty(STDOUT_FILENO) != 0)
    return refuse("stdout is a terminal, and a record is no text; write `> here.mcap` behind the command", kBadInput);
  const StopAsked stop;
  const auto began = steady_clock::now();
  StandardOutput output;
  const auto ring = flight::ring_of(options.folder);
  flight::Watch watch;
  watch.lives = [&] { return flight::run_lives(ring); };
  watch.enough = [&] {
    return StopAsked::asked() || output.gone() ||
           (options.for_s > 0 && std::chrono::duration<double>(steady_clock::now() - began).count() >= options.for_s);
  };
  watch.wait = [&] { output.wait(); };
  watch.say = say_served;
  const auto served = flight::serve(ring, output, watch);
  if (!served) return refuse(served.error(), kBadInput);
  if (!output.gone() && !served->refused.empty())
    return refuse("stdout could not take the record: " + served->refused, kDeviceOrSystem);
  say_served(fmt::format("{}: {}: {} messages, {:.1f} MB, from {} files; gaps: {}", served->run,
                         output.gone() ? "the reader has gone" : served->end, served->messages,
                         static_cast<double>(served->bytes) / 1e6, served->files, served->gaps));
  return served->gaps > 0 && !output.gone() ? kNotOk : kOk;
}

void add_log_serve(CLI::App& log, LogServeOptions& o, int& exit_code) {
  CLI::App* serve = log.add_subcommand("serve", "what a run keeps, as one record on stdout, while it runs");
  reads_folder(serve->add_option("folder", o.folder, "OUTPUT of a run that keeps a ring, or OUTPUT/flight/ring"))
      ->required();
  serve->add_option("--for", o.for_s, "ends after that time, such as 60s (default: with the run)")
      ->transform(CLI::Validator(duration, "DURATION"));
  serve->footer(
      "Example: ssh robot takt log serve out > here.mcap\n"
      "It ends with the run, with --for, with Ctrl-C, or when its reader goes. The run waits for none of this.");
  serve->callback([&] { exit_code = log_serve(o); });
}

}  // namespace takt::command
