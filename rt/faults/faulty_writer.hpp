// SPDX-License-Identifier: Apache-2.0
// Internal to rt/faults: the writer of an output that faults strike.
#pragma once
#include <vector>

#include "rt/faults/faulty_transport.hpp"
#include "rt/memory/aligned_bytes.hpp"

namespace takt::faults {

/// A message kept outside of the pools; its memory is there before the first job.
class KeptMessage {
 public:
  KeptMessage() = default;
  explicit KeptMessage(const PortPlan& port);
  void keep(const void* message, int64_t stamp_ns);
  /// Writes the kept content over a message of the same port.
  void write_to(void* message) const;
  void forget() { full_ = false; }
  bool full() const { return full_; }
  int64_t stamp_ns() const { return stamp_ns_; }

 private:
  const MessageType* type_ = nullptr;
  AlignedBytes memory_;
  int64_t stamp_ns_ = 0;
  bool full_ = false;
};

/// Holds what it can get of an output, as a consumer does that takes messages and never gives them back.
class Hoard {
 public:
  Hoard() = default;
  Hoard(std::unique_ptr<Reader> reader, uint32_t chunks);
  /// Takes every message that can be had.
  void grab();
  void let_go();

 private:
  std::unique_ptr<Reader> reader_;
  std::vector<Candidate> listed_;
  std::vector<Held> held_;
  size_t count_ = 0;
  uint64_t newest_ = 0;
};

class FaultyWriter final : public Writer {
 public:
  /// One fault with what it needs to remember.
  struct Strike {
    MessageFault fault;
    const MessageType* type = nullptr;
    MessageFaultCount* count = nullptr;
    KeptMessage kept;  ///< of freeze and reorder
    Hoard hoard;       ///< of exhaust
    /// What it does to the message under way, which may yet be taken back.
    struct Doing {
      uint64_t struck = 0, withheld = 0, added = 0;
      bool gave_kept = false;  ///< what it held back goes out with this one
    } doing;
  };

  FaultyWriter(std::unique_ptr<Writer> inner, std::vector<Strike> strikes, const Clock& clock,
               const std::atomic<int64_t>& epoch_ns, std::atomic<uint64_t>& offered);
  ~FaultyWriter() override;

  MessageHeader* loan() override;
  void publish(int64_t stamp_ns, int64_t published_ns, int64_t visible_at_ns) override;
  bool announces() const override { return inner_->announces(); }
  void announce(int64_t stamp_ns, uint32_t commit, int64_t delay_ns) override;
  bool announce_again(uint32_t commit, int64_t delay_ns) override;
  void settle(int64_t published_ns, int64_t visible_at_ns) override;
  bool intact() const override { return inner_->intact(); }
  void discard() override;
  bool repeat(int64_t published_ns, int64_t visible_at_ns) override;
  WriterStatistics statistics() const override { return inner_->statistics(); }
  uint64_t go_on_after(uint64_t noted) override { return inner_->go_on_after(noted); }

 private:
  /// A message on its way, and what the faults have made of it.
  struct Draft {
    int64_t stamp_ns = 0, published_ns = 0, visible_at_ns = 0;
    uint32_t commit = 0;               ///< 0: published at once; else visible_at_ns is the delay after it
    bool withheld = false;             ///< not published
    Strike* twice = nullptr;           ///< ... by this fault
    Strike* released_after = nullptr;  ///< the message it holds back follows this one
  };
  bool covers(const Strike& strike, int64_t now_ns) const;
  uint64_t number() const { return offered_.load(std::memory_order_relaxed) + 1; }
  void strike_and_send(Draft draft);
  bool strike_and_send_again(Draft draft);
  void apply(Strike& strike, Draft& draft);
  void swap(Strike& strike, Draft& draft, bool struck);
  void freeze(Strike& strike, Draft& draft);
  void send(const Draft& draft);
  void put(const Draft& draft, int64_t stamp_ns);
  bool put_again(const Draft& draft);
  void conclude(bool visible);
  void follow_up(Strike& strike, const Draft& draft, int32_t level);
  void hoard(int64_t now_ns);

  const std::unique_ptr<Writer> inner_;
  std::vector<Strike> strikes_;
  const Clock& clock_;
  const std::atomic<int64_t>& epoch_ns_;
  std::atomic<uint64_t>& offered_;
  MessageHeader* loaned_ = nullptr;
  bool offers_ = false;  ///< a message is under way
};

}  // namespace takt::faults
