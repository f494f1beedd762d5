// SPDX-License-Identifier: Apache-2.0
#include "graph/web/frozen_files.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <poll.h>
#include <pthread.h>
#include <spawn.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <csignal>
#include <cstdlib>
#include <thread>

#include "graph/web/gate.hpp"
#include "rt/time/clock.hpp"

namespace takt::web {
namespace {

constexpr int64_t kTicketLasts_ns = 60'000'000'000;
constexpr int kReplayLookMs = 100;
constexpr int64_t kEnds_ns = 1'000'000'000;  ///< so long a replay may take to end
constexpr size_t kMostSaid = 4096;           ///< at its end stands why it ended
constexpr size_t kMostTickets = 16, kMostListed = 500;

/// A process with stderr in a pipe, its other end in `from`; 0: it did not start.
pid_t spawn(const std::vector<std::string>& words, int& from) {
  std::array<int, 2> ends{};
  if (pipe2(ends.data(), O_CLOEXEC) != 0) return 0;
  posix_spawn_file_actions_t files;
  posix_spawn_file_actions_init(&files);
  posix_spawn_file_actions_addopen(&files, STDIN_FILENO, "/dev/null", O_RDONLY, 0);
  posix_spawn_file_actions_addopen(&files, STDOUT_FILENO, "/dev/null", O_WRONLY, 0);
  posix_spawn_file_actions_adddup2(&files, ends[1], STDERR_FILENO);
  posix_spawnattr_t how;
  posix_spawnattr_init(&how);
  sigset_t none;  // this process's threads have blocked some
  sigemptyset(&none);
  posix_spawnattr_setsigmask(&how, &none);
  sigset_t usual;
  sigemptyset(&usual);
  sigaddset(&usual, SIGPIPE);
  posix_spawnattr_setsigdefault(&how, &usual);
  posix_spawnattr_setflags(&how, POSIX_SPAWN_SETSIGMASK | POSIX_SPAWN_SETSIGDEF);
  std::vector<char*> arguments;
  for (const std::string& text : words) arguments.push_back(const_cast<char*>(text.c_str()));
  arguments.push_back(nullptr);
  pid_t process = 0;
  if (posix_spawn(&process, arguments[0], &files, &how, arguments.data(), environ) != 0) process = 0;
  posix_spawn_file_actions_destroy(&files);
  posix_spawnattr_destroy(&how);
  close(ends[1]);
  if (process == 0) close(ends[0]);
  else from = ends[0];
  return process;
}

}  // namespace

void ReplayBeside::begin(const std::filesystem::path& record) {
  end();
  Json told{{"state", "starting"}, {"file", record.filename().string()}};
  std::string place = (std::filesystem::temp_directory_path() / "takt-replay-XXXXXX").string();
  int from = -1;
  if (mkdtemp(place.data()) != nullptr) {
    output_ = place;
    process_ = spawn({takt_.string(), "replay", record.string(), "--web", "--output", place + "/out"}, from);
  }
  if (process_ == 0) {
    told["state"] = "ended";
    told["why"] = fmt::format("{} could not be started", takt_.string());
  }
  {
    const std::lock_guard lock(mutex_);
    told_ = told;
  }
  if (process_ != 0) thread_ = OwnThread([this, from] { listen(from); });
}

/// What it says: first which address to open, at last why it ended.
void ReplayBeside::listen(int from) {
  pthread_setname_np(pthread_self(), "takt-replayed");
  std::string said;
  // Its children may keep the pipe open longer than it lives.
  for (bool lives = true; lives;) {
    pollfd wait{from, POLLIN, 0};
    lives = poll(&wait, 1, kReplayLookMs) > 0 || waitpid(process_, nullptr, WNOHANG) == 0;
    if (wait.revents == 0) continue;
    std::array<char, 512> text{};
    const ssize_t bytes = read(from, text.data(), text.size());
    if (bytes <= 0) break;
    said.append(text.data(), static_cast<size_t>(bytes));
    if (said.size() > kMostSaid) said.erase(0, said.size() - kMostSaid);
    const size_t token = said.find("#token=");
    if (token == std::string::npos || said.find('\n', token) == std::string::npos) continue;
    const size_t begin = said.rfind('\n', token) + 1;  // npos + 1 is 0
    const std::lock_guard lock(mutex_);
    told_["state"] = "shown";
    told_["address"] = said.substr(begin, said.find('\n', token) - begin);
  }
  close(from);
  waitpid(process_, nullptr, 0);  // where that is still to be done
  const std::lock_guard lock(mutex_);
  while (!said.empty() && said.back() == '\n') said.pop_back();
  if (told_["state"] == "starting") told_["why"] = said.substr(said.rfind('\n') + 1);
  told_["state"] = "ended";
}

void ReplayBeside::end() {
  const auto ended = [this] { return told()["state"] == "ended"; };
  if (process_ != 0 && !ended()) kill(process_, SIGTERM);
  // Questions to the robot wait meanwhile.
  for (int64_t until_ns = MonotonicClock().now_ns() + kEnds_ns; process_ != 0 && !ended();) {
    std::this_thread::sleep_for(std::chrono::milliseconds(10));
    if (MonotonicClock().now_ns() > until_ns) kill(process_, SIGKILL);
  }
  if (thread_.joinable()) thread_.join();
  process_ = 0;
  std::error_code ignored;
  if (!output_.empty()) std::filesystem::remove_all(output_, ignored);
  output_.clear();
}

Json ReplayBeside::told() const {
  const std::lock_guard lock(mutex_);
  Json told = told_;
  told["ok"] = true;
  return told;
}

bool FrozenFiles::is_asked(const Json& question) {
  const std::string what = text_of(question, "do");
  return what == "frozen" || what == "download" || what == "replay" || what == "replayed";
}

Json FrozenFiles::answer(const Json& question) {
  const std::string what = text_of(question, "do");
  if (what == "frozen") return list();
  if (what == "replayed") return replay_.told();
  const std::string name = text_of(question, "file");
  const auto file = find(name);
  if (!file) return {{"error", fmt::format("there is no frozen record `{}`", name)}};
  if (what == "download") return issue(*file);
  replay_.begin(*file);
  return {{"ok", true}};
}

/// The newest first.
std::vector<std::filesystem::directory_entry> FrozenFiles::files() const {
  std::vector<std::filesystem::directory_entry> all;
  std::error_code error;
  const std::filesystem::path folder = folder_();
  if (folder.empty()) return all;
  for (const auto& entry : std::filesystem::directory_iterator(folder, error))
    if (entry.path().extension() == ".mcap" &&
        entry.symlink_status(error).type() == std::filesystem::file_type::regular)
      all.push_back(entry);
  std::sort(all.begin(), all.end(),
            [](const auto& a, const auto& b) { return a.path().filename() > b.path().filename(); });
  return all;
}

std::optional<std::filesystem::path> FrozenFiles::find(const std::string& name) const {
  for (const auto& entry : files())
    if (entry.path().filename() == name) return entry.path();
  return std::nullopt;
}

Json FrozenFiles::list() const {
  Json listed = Json::array();
  for (const auto& entry : files()) {
    struct stat facts {};
    if (listed.size() >= kMostListed || stat(entry.path().c_str(), &facts) != 0) continue;
    listed.push_back({{"file", entry.path().filename().string()},
                      {"mb", static_cast<double>(facts.st_size) / 1e6},
                      {"at", static_cast<double>(facts.st_mtime)}});
  }
  return {{"ok", true}, {"folder", folder_().string()}, {"files", listed}};
}

Json FrozenFiles::issue(const std::filesystem::path& file) {
  const int64_t now_ns = MonotonicClock().now_ns();
  Ticket ticket{new_token(), file, now_ns + kTicketLasts_ns};
  const std::string path = fmt::format("{}{}?ticket={}", kFrozenPath, file.filename().string(), ticket.secret);
  const std::lock_guard lock(mutex_);
  std::erase_if(tickets_, [&](const Ticket& other) { return other.until_ns < now_ns; });
  if (tickets_.size() >= kMostTickets) tickets_.erase(tickets_.begin());
  tickets_.push_back(std::move(ticket));
  return {{"ok", true}, {"path", path}};
}

std::optional<std::filesystem::path> FrozenFiles::redeem(const std::string& name, const std::string& secret) {
  const std::lock_guard lock(mutex_);
  const auto ticket = std::find_if(tickets_.begin(), tickets_.end(),
                                   [&](const Ticket& other) { return same_token(secret, other.secret); });
  if (ticket == tickets_.end()) return std::nullopt;
  const Ticket used = *ticket;
  tickets_.erase(ticket);
  const bool good = used.file.filename() == name && MonotonicClock().now_ns() <= used.until_ns;
  return good ? std::optional(used.file) : std::nullopt;
}

}  // namespace takt::web
