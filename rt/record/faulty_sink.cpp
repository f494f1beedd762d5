// SPDX-License-Identifier: Apache-2.0
#include "rt/record/faulty_sink.hpp"

#include <cerrno>
#include <cstring>
#include <utility>

namespace takt::record {

FaultySink::FaultySink(mcap::Sink& inner, std::vector<DiskFault> faults, const Clock& clock,
                       const std::atomic<int64_t>& epoch_ns, std::vector<std::atomic<uint64_t>*> struck, Wait wait)
    : inner_(inner),
      faults_(std::move(faults)),
      clock_(clock),
      epoch_ns_(epoch_ns),
      struck_(std::move(struck)),
      wait_(std::move(wait)) {}

tl::expected<void, std::string> FaultySink::append(std::span<const mcap::Bytes> parts) {
  uint64_t bytes = 0;
  for (const mcap::Bytes part : parts) bytes += part.size();
  const int64_t epoch = epoch_ns_.load(), since_epoch = clock_.now_ns() - epoch;
  for (size_t f = 0; f < faults_.size(); ++f) {
    const DiskFault& fault = faults_[f];
    if (epoch == 0 || since_epoch < fault.from_ns || since_epoch >= fault.to_ns) continue;
    const bool full = written_ + bytes > fault.room_bytes;
    if (full || fault.bytes_per_s > 0) struck_[f]->fetch_add(1);
    if (full) return tl::unexpected(std::string(std::strerror(ENOSPC)));
    if (fault.bytes_per_s == 0) continue;
    const double needed_ns = static_cast<double>(bytes) * 1e9 / static_cast<double>(fault.bytes_per_s);
    const int64_t left_ns = fault.to_ns - since_epoch;  // afterwards it takes the rest at once
    wait_(needed_ns < static_cast<double>(left_ns) ? static_cast<int64_t>(needed_ns) : left_ns);
  }
  auto done = inner_.append(parts);
  if (done) written_ += bytes;
  return done;
}

}  // namespace takt::record
