// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <atomic>
#include <cstdint>
#include <functional>
#include <limits>
#include <vector>

#include "rt/record/mcap/file_sink.hpp"
#include "rt/time/clock.hpp"

namespace takt::record {

/// What is wrong with the disk that a record is written to, and when.
struct DiskFault {
  int64_t from_ns = 0, to_ns = std::numeric_limits<int64_t>::max();  ///< [from, to), since the epoch
  uint64_t bytes_per_s = 0;                                          ///< > 0: it takes no more, within the window
  uint64_t room_bytes = std::numeric_limits<uint64_t>::max();        ///< it is full after so many, of the whole record
};

/// A file on such a disk, around a real one. One thread at a time.
class FaultySink final : public mcap::Sink {
 public:
  /// How a slow disk lets time pass, ns.
  using Wait = std::function<void(int64_t)>;
  /// `struck` has one entry per fault and counts appends. `inner`, clock, epoch (0: not known yet) and counts outlive
  /// this.
  FaultySink(mcap::Sink& inner, std::vector<DiskFault> faults, const Clock& clock, const std::atomic<int64_t>& epoch_ns,
             std::vector<std::atomic<uint64_t>*> struck, Wait wait);
  /// Refuses what no longer fits on a full disk, whole, as a real one does.
  tl::expected<void, std::string> append(std::span<const mcap::Bytes> parts) override;

 private:
  mcap::Sink& inner_;
  const std::vector<DiskFault> faults_;
  const Clock& clock_;
  const std::atomic<int64_t>& epoch_ns_;
  const std::vector<std::atomic<uint64_t>*> struck_;
  const Wait wait_;
  uint64_t written_ = 0;
};

}  // namespace takt::record
