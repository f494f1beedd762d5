// SPDX-License-Identifier: Apache-2.0
#include "graph/flight/pull.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cstdlib>
#include <optional>
#include <stdexcept>
#include <system_error>
#include <thread>
#include <utility>

#include "graph/flight/part_file.hpp"
#include "graph/flight/remote_shell.hpp"
#include "rt/file/output_file.hpp"

namespace takt::flight {
namespace {

namespace fs = std::filesystem;

/// Ends the pull.
struct Failure : std::runtime_error {
  Failure(Pulled::Fault what, const std::string& text) : std::runtime_error(text), fault(what) {}
  Pulled::Fault fault;
};

constexpr size_t kBlock = 64 << 10;
constexpr std::string_view kReady = "takt is ready", kEnd = "takt has all";

/// Host and folder; those that ssh would take for an option are refused.
std::pair<std::string, std::string> address(const std::string& from) {
  const size_t bracket = from.find("]:");  // user@[::1]:out
  const size_t colon = bracket == std::string::npos ? from.find(':') : bracket + 1;
  std::string host = from.substr(0, std::min(colon, from.size()));
  std::erase_if(host, [](char c) { return c == '[' || c == ']'; });
  const bool plain = std::none_of(host.begin(), host.end(), [](char c) { return c <= ' ' || c == 127; });
  if (colon == std::string::npos || host.empty() || host[0] == '-' || !plain)
    throw Failure(Pulled::input, from + ": is no HOST:FOLDER; write for instance user@robot:out");
  std::string folder = from.substr(colon + 1);
  if (folder == "~" || folder.starts_with("~/")) folder.erase(0, std::min<size_t>(2, folder.size()));
  if (!folder.starts_with('/')) folder = "./" + folder;  // of the user's home, as for scp
  return {host, folder};
}

/// What may be a file's name here: the other machine need not be a friend.
bool harmless(const std::string& name) {
  return name.ends_with(".mcap") && name[0] != '.' &&
         std::none_of(name.begin(), name.end(), [](unsigned char c) { return c < ' ' || c == 127 || c == '/'; });
}

std::string megabytes(uint64_t bytes) { return fmt::format("{:.1f} MB", static_cast<double>(bytes) / 1e6); }

class Pull {
 public:
  Pull(const PullOptions& options, Pulled& pulled) : options_(options), pulled_(pulled) {}

  void run() {
    std::tie(pulled_.host, pulled_.folder) = address(options_.from);
    auto robot = RemoteShell::over(options_.ssh, pulled_.host);
    if (!robot) throw Failure(Pulled::system, robot.error());
    robot_.emplace(std::move(*robot));
    robot_->stop_when(options_.stopped);
    robot_->say("renice -n 19 -p $$ >/dev/null 2>&1");  // the robot has better things to do
    greet();
    enter_folder();
    list();
    std::optional<WriterLock> lock;
    if (!options_.list) lock.emplace(claim());
    for (PulledFile& file : pulled_.files) look_here(file);
    if (!options_.list) see_to_room();
    for (PulledFile& file : pulled_.files) {
      if (file.state == PulledFile::there && !options_.list) fetch(file);
      if (options_.told) options_.told(file);
    }
    const auto other = [](const PulledFile& file) { return file.state == PulledFile::other; };
    if (const auto found = std::find_if(pulled_.files.begin(), pulled_.files.end(), other);
        found != pulled_.files.end())
      throw Failure(Pulled::broken, fmt::format("{}: is another file than that of {}; move it away, and pull again",
                                                place(*found).string(), pulled_.host));
  }

 private:
  fs::path place(const PulledFile& file) const { return options_.to / file.name; }
  static std::string remote(const PulledFile& file) {
    return shell_word((file.of_ring ? "ring/" : "frozen/") + file.name);
  }
  bool stopped() const { return options_.stopped && options_.stopped(); }

  /// The next line of the robot; what ended the connection is thrown.
  std::string line() {
    auto line = robot_->line();
    if (!line) lost();
    return *line;
  }

  [[noreturn]] static void interrupted() {
    throw Failure(Pulled::broken, "interrupted; the same command goes on from here");
  }

  [[noreturn]] void lost() {
    if (stopped()) interrupted();
    const int code = robot_->end();
    if (code == 127)
      throw Failure(Pulled::system,
                    fmt::format("`{}` cannot be started; install it (Debian: apt-get install openssh-client), or name "
                                "another program with --ssh",
                                options_.ssh));
    if (greeted_)
      throw Failure(Pulled::system,
                    fmt::format("the connection to {} has ended (exit {} of ssh); the same command goes on from here",
                                pulled_.host, code));
    throw Failure(Pulled::system,
                  fmt::format("{} cannot be reached (exit {} of ssh, which says why above); try: {} {} true",
                              pulled_.host, code, options_.ssh, pulled_.host));
  }

  /// Passes over what the login of the user prints.
  void greet() {
    robot_->say(
        "for tool in stat head tail tr sha256sum; do command -v $tool >/dev/null || echo \"takt lacks $tool\"; done");
    robot_->say("echo; echo '" + std::string(kReady) + "'");
    std::string lacks;
    for (std::string said; (said = line()) != kReady;)
      if (said.starts_with("takt lacks ")) lacks += said.substr(10);
    greeted_ = true;
    if (!lacks.empty())
      throw Failure(Pulled::system, fmt::format("{} lacks{}; install coreutils there", pulled_.host, lacks));
  }

  /// From then on it is where `frozen` and `ring` are.
  void enter_folder() {
    robot_->say("if cd -P " + shell_word(pulled_.folder) +
                " 2>/dev/null; then [ ! -d flight ] || cd ./flight; [ -d frozen ] || [ -d ring ] || case $(pwd) in "
                "*/frozen|*/ring) cd ..;; esac; [ -d frozen ] || [ -d ring ] && echo flight || echo none; else echo "
                "absent; fi");
    const std::string said = line();
    if (said == "absent")
      throw Failure(Pulled::input, fmt::format("{} has no folder {}, or it may not be read; name the --output of a run",
                                               pulled_.host, pulled_.folder));
    if (said != "flight")
      throw Failure(Pulled::input,
                    fmt::format("{}:{} has neither `flight` nor `frozen` or `ring` in it; a run makes them "
                                "with --ring on, or `record:` in its graph",
                                pulled_.host, pulled_.folder));
  }

  /// A file of the ring that is closed ends as every MCAP file does.
  void list() {
    robot_->say("for f in frozen/*.mcap; do s=$(stat -L -c %s \"$f\" 2>/dev/null) && echo \"whole $s $f\"; done");
    if (options_.ring)
      robot_->say(
          "for f in ring/*.mcap; do case $(tail -c 7 \"$f\" 2>/dev/null | head -c 5 | tr -d '\\000') in MCAP0) "
          "e=whole;; "
          "*) e=open;; esac; s=$(stat -L -c %s \"$f\" 2>/dev/null) && echo \"$e $s $f\"; done");
    robot_->say("echo '" + std::string(kEnd) + "'");
    for (std::string said; (said = line()) != kEnd;) {
      PulledFile file;
      file.state = said.starts_with("whole ") ? PulledFile::there : PulledFile::open;
      const size_t size_at = said.find(' '), path_at = said.find(' ', size_at + 1), name_at = said.find('/', path_at);
      if (name_at == std::string::npos) continue;
      file.of_ring = said.substr(path_at + 1, name_at - path_at - 1) == "ring";
      file.name = said.substr(name_at + 1);
      file.bytes = std::strtoull(said.c_str() + size_at + 1, nullptr, 10);
      if (harmless(file.name)) pulled_.files.push_back(std::move(file));
    }
  }

  WriterLock claim() const {
    std::error_code error;
    fs::create_directories(options_.to, error);
    if (error) throw Failure(Pulled::input, fmt::format("{}: {}", options_.to.string(), error.message()));
    auto lock = WriterLock::of_folder(options_.to);
    if (!lock) throw Failure(lock.error().system ? Pulled::system : Pulled::input, lock.error().what);
    return std::move(*lock);
  }

  void look_here(PulledFile& file) const {
    std::error_code none;
    if (options_.to.empty() || file.state != PulledFile::there || !fs::exists(place(file), none)) return;
    file.state = fs::file_size(place(file), none) == file.bytes ? PulledFile::here : PulledFile::other;
  }

  void see_to_room() const {
    uint64_t needed = 0;
    std::error_code none;
    for (const PulledFile& file : pulled_.files) {
      if (file.state != PulledFile::there) continue;
      const auto part = fs::file_size(place(file).string() + ".part", none);
      needed += file.bytes - (none ? 0 : std::min<uint64_t>(part, file.bytes));
    }
    const auto space = fs::space(options_.to, none);
    if (!none && space.available < needed)
      throw Failure(Pulled::system,
                    fmt::format("{} has {} left, and {} are to be fetched; make room, or choose another place",
                                options_.to.string(), megabytes(space.available), megabytes(needed)));
  }

  void fetch(PulledFile& file) {
    auto part = PartFile::open(place(file));
    done(part);
    if (part->size() > file.bytes) done(part->shorten(0));
    file.resumed_at = part->size();
    while (!whole(file, *part)) {
      if (file.state == PulledFile::gone) {
        std::error_code none;
        if (part->size() == 0) fs::remove(part->part(), none);
        return;
      }
      // The bytes of an earlier pull, or of one that the power left: once more, from their beginning.
      done(part->shorten(0));
      if (std::exchange(file.again, true))
        throw Failure(Pulled::broken,
                      fmt::format("{}: what came has another SHA-256 than {} has, twice", file.name, pulled_.host));
      file.resumed_at = 0;
    }
    done(part->finish());
    file.state = PulledFile::fetched;
  }

  /// The rest of the file, and whether all of it has the robot's hash. The robot keeps the file open meanwhile, so that
  /// it may be removed there; zeros stand for what cannot be read of it.
  bool whole(PulledFile& file, PartFile& part) {
    robot_->say(fmt::format(
        "(exec 3<{} || exit; echo here; {{ tail -c +{} </proc/self/fd/3; cat /dev/zero; }} | head -c {}; sha256sum "
        "</proc/self/fd/3) 2>/dev/null || echo gone",
        remote(file), part.size() + 1, file.bytes - part.size()));
    if (line() != "here") {
      file.state = PulledFile::gone;
      return false;
    }
    take(file.bytes, part);
    file.sha256 = line().substr(0, 64);
    return file.sha256.size() == 64 && file.sha256 == hash_here(part.part());
  }

  void take(uint64_t bytes, PartFile& part) {
    using std::chrono::steady_clock, std::chrono::nanoseconds;
    std::vector<std::byte> block(kBlock);
    if (options_.most_bytes_s > 0)
      block.resize(std::clamp<size_t>(static_cast<size_t>(options_.most_bytes_s / 20), 1, kBlock));
    const auto began = steady_clock::now();
    for (uint64_t taken = 0; part.size() < bytes;) {
      const size_t got = robot_->read(std::span(block).first(std::min<uint64_t>(block.size(), bytes - part.size())));
      if (got == 0) lost();
      done(part.append(std::span(block).first(got)));
      taken += got;
      pulled_.fetched_bytes += got;
      const nanoseconds elapsed = steady_clock::now() - began;
      std::this_thread::sleep_for(nanoseconds(pause_ns(taken, elapsed.count(), options_.most_bytes_s)));
    }
  }

  std::string hash_here(const fs::path& file) const {
    auto shell = RemoteShell::here();
    if (!shell) throw Failure(Pulled::system, shell.error());
    shell->say("sha256sum <" + shell_word(file.string()) + "; exit");
    const auto said = shell->line();
    if (!said && stopped()) interrupted();
    if (!said) throw Failure(Pulled::system, "sha256sum is missing here; install coreutils");
    return said->substr(0, 64);
  }

  template <class Value>
  static void done(const tl::expected<Value, std::string>& value) {
    if (!value) throw Failure(Pulled::system, value.error() + "; make room, or choose another place");
  }

  const PullOptions& options_;
  Pulled& pulled_;
  std::optional<RemoteShell> robot_;
  bool greeted_ = false;
};

}  // namespace

const char* word(PulledFile::State state) {
  constexpr const char* kWords[] = {"there", "here", "fetched", "open", "gone", "other"};
  return kWords[state];
}

Pulled pull(const PullOptions& options) {
  Pulled pulled;
  try {
    Pull(options, pulled).run();
  } catch (const Failure& failure) {
    pulled.fault = failure.fault;
    pulled.error = failure.what();
  }
  return pulled;
}

}  // namespace takt::flight
