// SPDX-License-Identifier: Apache-2.0
#include "graph/up/up.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <atomic>
#include <charconv>
#include <chrono>
#include <fstream>
#include <mutex>
#include <optional>
#include <thread>

#include "graph/flight/remote_shell.hpp"

namespace takt::up {
namespace {

using flight::RemoteShell;
using flight::shell_word;
using Json = nlohmann::ordered_json;

constexpr auto kLook = std::chrono::milliseconds(100);
constexpr std::string_view kBegun = "takt up: begun";
constexpr std::string_view kEnd = "takt up: exit ";
constexpr int kWorstThatRan = 1;  ///< exit code of a run that took place

std::optional<uint64_t> number_of(const std::optional<std::string>& text) {
  uint64_t number = 0;
  if (!text) return std::nullopt;
  const auto [end, error] = std::from_chars(text->data(), text->data() + text->size(), number);
  return error == std::errc{} && end == text->data() + text->size() ? std::optional(number) : std::nullopt;
}

/// One machine: a shell there that starts the run, and ends it once it is told a line or nobody is here any more.
class Remote {
 public:
  Remote(const graph::MachineSpec& machine, const Options& options) : options_(options) {
    part_.machine = machine.name;
    const auto host = options.hosts.find(machine.name);
    part_.host = host == options.hosts.end() ? machine.address : host->second;
    thread_ = std::thread([this] { work(); });
  }
  ~Remote() { thread_.join(); }
  Remote(const Remote&) = delete;
  Remote& operator=(const Remote&) = delete;

  bool ended() const { return ended_.load(); }
  /// It ended otherwise than a run that took place. One that was there and is out of reach is none: the others have a
  /// mode for that.
  bool failed() const { return ended() && part_.code > kWorstThatRan && !(part_.code == kLost && begun_); }
  void end_run() {
    const std::lock_guard lock(mutex_);
    if (!shell_) return;
    part_.told_to_end = part_.code == kLost;
    shell_->say(":");  // a word for who waits for one, nothing for a shell
  }
  Part take() { return std::move(part_); }

 private:
  void work() {
    auto shell = RemoteShell::over(options_.ssh, part_.host);
    if (!shell) {
      part_.trouble = shell.error();
      return ended_.store(true);
    }
    {
      const std::lock_guard lock(mutex_);
      shell_.emplace(std::move(*shell));
      shell_->say(script());
    }
    follow();
    if (part_.code <= kWorstThatRan) fetch();
    const std::lock_guard lock(mutex_);
    shell_.reset();
    ended_.store(true);
  }

  std::string folder_there() const { return (options_.out / part_.machine).string(); }

  /// One command, which the shell reads as a whole before it begins: what it waits for is not taken for its script. The
  /// background has no other signal than SIGTERM.
  std::string script() const {
    const std::string out = folder_there();
    std::string run = fmt::format("{} run {} --machine {} --for {}s --output {} --report {}", options_.program,
                                  shell_word(options_.graph), part_.machine, options_.length_s, shell_word(out),
                                  shell_word(out + "/report.json"));
    if (options_.record) run += " --record " + shell_word(out + "/run.mcap");
    return fmt::format(
        "{{ echo '{begun}'; exec 3<&0; {cd}mkdir -p {out} && rm -f {out}/report.json {out}/run.mcap || {{ echo '{end}3'; exit; }}; "
        "{run} {more} </dev/null 3<&- & run=$!; "
        "{{ read -r word; kill -TERM $run; }} <&3 2>/dev/null & reader=$!; "
        "wait $run; code=$?; {{ kill $reader; wait $reader; }} 2>/dev/null; echo \"{end}$code\"; }} 2>&1",
        fmt::arg("cd", options_.folder.empty() ? "" : fmt::format("cd {} && ", shell_word(options_.folder))),
        fmt::arg("out", shell_word(out)), fmt::arg("run", run), fmt::arg("more", options_.more), fmt::arg("begun", kBegun),
        fmt::arg("end", kEnd));
  }

  void follow() {
    while (const auto line = shell_->line()) {
      if (*line == kBegun) {
        begun_ = true;
        continue;
      }
      if (!line->starts_with(kEnd)) {
        if (options_.told) options_.told(part_.machine, *line);
        continue;
      }
      const std::lock_guard lock(mutex_);
      part_.code = static_cast<int>(number_of(line->substr(kEnd.size())).value_or(kLost));
      return;
    }
    part_.trouble = fmt::format("the connection to {} has ended", part_.host);
  }

  void fetch() {
    const std::filesystem::path report = options_.out / (part_.machine + ".json");
    if (!fetch("report.json", report)) return;
    std::ifstream file(report);
    part_.report = Json::parse(file, nullptr, false);
    if (part_.report.is_discarded()) {
      part_.report = nullptr;
      part_.trouble = fmt::format("{} is no report", report.string());
    }
    if (options_.record) fetch("run.mcap", options_.out / (part_.machine + ".mcap"));
  }

  bool fetch(std::string_view name, const std::filesystem::path& to) {
    const std::string there = shell_word(fmt::format("{}/{}", folder_there(), name));
    const auto failed = [&](std::string_view why) {
      part_.trouble = fmt::format("{}:{}: {}", part_.host, there, why);
      return false;
    };
    {
      const std::lock_guard lock(mutex_);
      shell_->say(fmt::format("stat -c %s {0} 2>/dev/null && cat {0} || echo none", there));
    }
    const auto bytes = number_of(shell_->line());
    if (!bytes) return failed("is not there");
    std::ofstream file(to, std::ios::binary);
    std::vector<std::byte> buffer(64 << 10);
    for (uint64_t left = *bytes; left > 0;) {
      const size_t got = shell_->read(std::span(buffer).first(std::min<uint64_t>(left, buffer.size())));
      if (got == 0) return failed("the connection has ended");
      file.write(reinterpret_cast<const char*>(buffer.data()), static_cast<std::streamsize>(got));
      left -= got;
    }
    file.close();
    return file ? true : failed(fmt::format("cannot be written to {}", to.string()));
  }

  const Options& options_;
  Part part_;
  std::mutex mutex_;  ///< of who speaks to the shell
  std::optional<RemoteShell> shell_;
  bool begun_ = false;  ///< read once it has ended
  std::atomic<bool> ended_{false};
  std::thread thread_;
};

}  // namespace

std::vector<Part> run(const std::vector<graph::MachineSpec>& machines, const Options& options) {
  std::vector<std::unique_ptr<Remote>> all;
  for (const graph::MachineSpec& machine : machines) all.push_back(std::make_unique<Remote>(machine, options));
  const auto every = [&](bool (Remote::*is)() const) {
    return std::all_of(all.begin(), all.end(), [&](const auto& remote) { return (*remote.*is)(); });
  };
  for (bool told = false; !every(&Remote::ended);) {
    const bool failed = std::any_of(all.begin(), all.end(), [](const auto& remote) { return remote->failed(); });
    if (!told && (failed || (options.stopped && options.stopped()))) {
      told = true;
      for (const auto& remote : all) remote->end_run();
    }
    std::this_thread::sleep_for(kLook);
  }
  std::vector<Part> parts;
  for (const auto& remote : all) parts.push_back(remote->take());
  return parts;
}

}  // namespace takt::up
