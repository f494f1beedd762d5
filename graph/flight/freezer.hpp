// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <atomic>
#include <chrono>
#include <condition_variable>
#include <deque>
#include <filesystem>
#include <functional>
#include <mutex>
#include <string>
#include <vector>

#include "graph/flight/evidence.hpp"
#include "graph/flight/triggers.hpp"
#include "hal/settings/json.hpp"
#include "rt/own_thread.hpp"
#include "rt/record/ring.hpp"

namespace takt::flight {

/// Causes that came close to each other, and what became of them.
struct Frozen {
  Cause cause;                        ///< the first
  std::vector<Cause> also;            ///< others, each kind and subject once
  uint64_t more = 0;                  ///< those that are in neither: of a kind and subject that is, or too many
  int64_t first_ns = 0, last_ns = 0;  ///< instants between which all of them lie
  bool begun = false;                 ///< it is being written, and takes no further cause
  std::filesystem::path file;         ///< empty: nothing was written
  std::string refused;                ///< why not
  std::string sentence;               ///< as Said has it
  std::vector<std::string> damages;   ///< of the ring: what of it could not be read
  uint64_t bytes = 0;
};

/// Writes what the rings hold from `before_ns` before a cause to `after_ns` behind it, on a thread of the lowest
/// priority. Causes within `after_ns` of each other are one file: a storm of misses has one root, and each file is
/// hundreds of megabytes.
class Freezer {
 public:
  struct Options {
    std::filesystem::path folder;  ///< of the files; made with the first one
    std::string name;              ///< of the run: NAME-0001-miss.mcap
    int64_t before_ns = 0, after_ns = 0;
    int64_t lead_ns = 0;                          ///< what a file has before that time, so that a replay can begin
    std::vector<std::vector<std::string>> edges;  ///< as of record::JoinOptions
    uint64_t most_bytes = 2'000'000'000;  ///< of all files of the folder, those of earlier runs, too; the oldest go
    size_t at_least = 20;                 ///< ... but the newest so many stay, whatever they take
    std::chrono::seconds patience{30};    ///< finish() goes on writing so long; what is left then is not written
    std::function<Said(const Cause&, int64_t from_ns, int64_t to_ns)> say = {};  ///< on the freezer's thread
    std::function<void(const Frozen&)> told = {};  ///< called once for each, on the freezer's thread
  };
  /// Both rings outlive this; `memory` may be null.
  Freezer(record::Ring& disk, record::Ring* memory, Options options);
  ~Freezer();
  Freezer(const Freezer&) = delete;
  Freezer& operator=(const Freezer&) = delete;

  /// Any thread; takes as long as a lock.
  void freeze(Cause cause);
  /// The rings hold all there will be: writes what is left, as long as Options::patience says, and ends. Once.
  std::vector<Frozen> finish();

 private:
  bool joins(const Cause& cause, Frozen& other) const;
  void work();
  /// The rings have what a cause needs, in files that nobody writes to any more. Sees to that.
  bool ready(const Frozen& frozen);
  void write(Frozen& frozen);
  std::vector<std::filesystem::path> files_for(int64_t from_ns, int64_t to_ns) const;
  /// Empty, or why there is none for a file.
  std::string make_room();

  record::Ring& disk_;
  record::Ring* memory_;
  const Options options_;
  std::mutex mutex_;
  std::condition_variable changed_;
  std::deque<Frozen> waiting_;
  std::vector<Frozen> done_;
  size_t number_ = 0;
  bool ending_ = false;
  std::chrono::steady_clock::time_point end_by_;  ///< once it is ending
  OwnThread thread_;
};

}  // namespace takt::flight
