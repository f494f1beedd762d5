// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <memory>
#include <string>

#include "hal/semantic_link/link_runner.hpp"

namespace takt::semantic_link {

/// One robot's end of the link, at the server or at the client. See Device for the life cycle and the thread rules;
/// several devices may share a runner. Reads and writes are those of the job; they allocate and wait for nothing.
class LinkDevice final : public Device {
 public:
  /// `exchange` lives as long as the runner.
  LinkDevice(std::shared_ptr<LinkRunner> runner, Exchange& exchange)
      : runner_(std::move(runner)), exchange_(exchange) {}
  ~LinkDevice() override { stop(); }

  DeviceResult open() override { return runner_->open(); }
  void close() override { stop(); }
  DeviceResult start(int64_t epoch_ns) override;
  void stop() override;
  /// True once the port is there again.
  bool restart(int64_t) override { return exchange_.connected.load(std::memory_order_acquire); }
  StampLaw stamp_law(const JobTimes&) const override {
    return StampLaw::none("what it passes on is as old as its sender says");
  }
  DeclaredCalls declared_calls() const override;

  /// Hands a message to the thread; flush() says that it is all.
  void give(Kind kind, const void* message, int64_t stamp_ns);
  void flush() { runner_->wake(); }
  /// What came of that kind since the last time, its newest message; null if nothing did. Valid until the next call.
  const Parcel* take(Kind kind) { return exchange_.parcels[index_of(kind)].take(); }
  /// Fills a message of the kind's capacity; false if it cannot be.
  static bool unpack(Kind kind, const Parcel& parcel, void* message);
  /// Once a job. ok: the other end has been heard since the last time; partial: only bytes that mean nothing were;
  /// disconnected: the port is gone, as a bus that has ended.
  ReadStatus read();
  void count_too_old() { exchange_.too_old.fetch_add(1, std::memory_order_relaxed); }
  /// As of the last read().
  bool attached() const { return report_.attached; }
  /// One line for a person into `text`: who is attached, what the clocks say, what was counted. Its length.
  size_t describe(std::span<char> text) const;

 private:
  std::shared_ptr<LinkRunner> runner_;
  Exchange& exchange_;
  bool started_ = false;
  uint64_t heard_ = 0, bad_ = 0;
  LinkReport report_;
};

}  // namespace takt::semantic_link
