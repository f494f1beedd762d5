// SPDX-License-Identifier: Apache-2.0
// The records that the run which is shown has frozen: listed, fetched, replayed into a page of their own.
#pragma once
#include <sys/types.h>

#include <filesystem>
#include <functional>
#include <mutex>
#include <optional>
#include <string>

#include "graph/web/hub.hpp"
#include "rt/own_thread.hpp"

namespace takt::web {

/// `takt replay FILE --web` in a process of its own: a server on another port, so that nobody takes the replay for the
/// robot. Any thread.
class ReplayBeside {
 public:
  /// `takt`: the program.
  explicit ReplayBeside(std::filesystem::path takt) : takt_(std::move(takt)) {}
  /// Ends it.
  ~ReplayBeside() { end(); }
  ReplayBeside(const ReplayBeside&) = delete;
  ReplayBeside& operator=(const ReplayBeside&) = delete;

  /// Ends the one before. Does not wait until it can be looked at.
  void begin(const std::filesystem::path& record);
  /// {"state": "none" | "starting" | "shown" | "ended", "file", "address", "why"}
  Json told() const;

 private:
  void end();
  void listen(int from);

  const std::filesystem::path takt_;
  std::filesystem::path output_;
  pid_t process_ = 0;
  OwnThread thread_;
  mutable std::mutex mutex_;
  Json told_{{"state", "none"}};
};

/// Questions of the page about files, which the run need not be asked:
///
///   {"do": "frozen"}                         {"ok": true, "files": [{"file": "3-mark.mcap", "mb": 241.0, "at": 1.6e9},
///   ...]}
///   {"do": "download", "file": "3-mark.mcap"}   {"ok": true, "path": "/frozen/3-mark.mcap?ticket=..."}: once, for a
///   minute
///   {"do": "replay", "file": "3-mark.mcap"}     {"ok": true}
///   {"do": "replayed"}                          as of ReplayBeside::told()
///
/// One thread at a time; redeem() on any.
class FrozenFiles {
 public:
  /// `folder`: where they lie now; empty: nowhere.
  FrozenFiles(std::function<std::filesystem::path()> folder, std::filesystem::path takt)
      : folder_(std::move(folder)), replay_(std::move(takt)) {}

  static bool is_asked(const Json& question);
  Json answer(const Json& question);
  /// Nothing: there is no such ticket, or not any more.
  std::optional<std::filesystem::path> redeem(const std::string& file, const std::string& ticket);

 private:
  struct Ticket {
    std::string secret;
    std::filesystem::path file;
    int64_t until_ns = 0;
  };
  std::vector<std::filesystem::directory_entry> files() const;
  std::optional<std::filesystem::path> find(const std::string& file) const;
  Json list() const;
  Json issue(const std::filesystem::path& file);

  const std::function<std::filesystem::path()> folder_;
  ReplayBeside replay_;
  std::mutex mutex_;
  std::vector<Ticket> tickets_;
};

}  // namespace takt::web
