// SPDX-License-Identifier: Apache-2.0
// The newest part of what a run said, in files of a folder that never take more than they may.
//
//   auto ring = Ring::open("out/flight/ring", "ace-0001", {.bytes = 500'000'000});
//   Recorder recorder(plan, board, transport, *ring, head, {});
#pragma once
#include <atomic>
#include <cstdint>
#include <deque>
#include <filesystem>
#include <memory>
#include <mutex>
#include <string>
#include <tl/expected.hpp>
#include <vector>

#include "rt/record/splits.hpp"

namespace takt::record {

/// A record of a folder.
struct RingFile {
  std::filesystem::path path;
  int64_t began_ns = 0, ended_ns = 0;  ///< of the run's time; both 0 in one that an earlier run left
  uint64_t bytes = 0;
};

/// Files NAME.mcap of a folder, the one that was written first in front; none if it cannot be read.
std::vector<RingFile> records_in(const std::filesystem::path& folder);

/// Of RUN-000001.mcap; a file that is named otherwise is of no run.
struct RingName {
  std::string run;
  uint64_t number = 0;
};
RingName name_of(const std::filesystem::path& file);

struct RingLimits {
  uint64_t bytes = 2'000'000'000;      ///< of all files of the folder, at every instant; at least kLeastBytes
  int64_t age_ns = 3'600'000'000'000;  ///< what is older goes; of the run's own time
  uint64_t split_bytes = 64 << 20;     ///< a file ends once it is as large; at most an eighth of `bytes`
  int64_t split_ns = 60'000'000'000;   ///< ... or as long
  bool durable = true;                 ///< settle() waits for the disk; pointless in memory
  static constexpr uint64_t kLeastBytes = 16'000'000;
};

/// Files NAME-000001.mcap, NAME-000002.mcap ... The oldest go first, and files that an earlier run left in the folder
/// before all others. A file whose making or writing the disk refuses ends, and the next one begins once there is
/// room. next(), ends(), settle() on one thread; files() and bytes() on any.
class Ring final : public Splits {
 public:
  using File = RingFile;

  /// Makes the folder, and room in it. Error: why it cannot be made.
  static tl::expected<std::unique_ptr<Ring>, std::string> open(const std::filesystem::path& folder, std::string name,
                                                               RingLimits limits);
  ~Ring() override;

  mcap::Sink* next(int64_t at_ns) override;
  bool ends(uint64_t bytes, int64_t began_ns, int64_t at_ns) const override;
  mcap::Writer::Done settle(int64_t at_ns) override;

  /// The file in hand is to end at the next opportunity: afterwards all that was published so far lies in files that
  /// nobody writes to. Any thread.
  void part() { part_.store(true); }

  /// Oldest first, the one that is being written last.
  std::vector<File> files() const;
  uint64_t bytes() const;
  /// Most that they ever took.
  uint64_t most_bytes() const;
  /// Files that had to go for newer ones.
  uint64_t dropped() const;

 private:
  class Sink;
  Ring(std::filesystem::path folder, std::string name, RingLimits limits);
  /// Drops the oldest until so many bytes fit; false: they do not even without all others.
  bool make_room(uint64_t bytes);
  bool drop_oldest();
  void grow(uint64_t bytes);

  const std::filesystem::path folder_;
  const std::string name_;
  const RingLimits limits_;
  mutable std::mutex mutex_;
  std::deque<File> files_;
  uint64_t bytes_ = 0, most_bytes_ = 0, dropped_ = 0, number_ = 0;
  std::atomic<bool> part_{false};
  std::unique_ptr<Sink> sink_;
};

}  // namespace takt::record
