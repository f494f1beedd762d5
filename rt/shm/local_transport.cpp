// SPDX-License-Identifier: Apache-2.0
// Writers and readers over the pools of local_pool.hpp, whose head says why none holds what another one fills.
#include "rt/shm/local_transport.hpp"

#include <limits>
#include <optional>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "rt/hot.hpp"
#include "rt/shm/commit_ring.hpp"
#include "rt/shm/kill_order.hpp"
#include "rt/shm/local_pool.hpp"

namespace takt {
namespace {

constexpr uint32_t kNoChunk = 0xffffffff;
constexpr uint32_t kSettled = 0;  // no commit

class LocalWriter final : public Writer {
 public:
  LocalWriter(const LocalPool& pool, uint32_t process) : pool_(pool), process_(process), used_(pool.words()) {
    pool.reclaim_writer();
    pool.state().writer.store(process);
  }
  ~LocalWriter() override {
    discard();
    for (uint64_t s = 1; s <= pool_.slots(); ++s) pool_.evict(pool_.slot(s));
  }

  MessageHeader* loan() override {
    PoolState& state = pool_.state();
    if (loaned_ == kNoChunk) {
      const uint32_t in_use = pool_.mark_used(used_) + 1;
      reached(MessageStep::inside_loan, pool_.index());
      loaned_ = next_free();
      if (loaned_ == kNoChunk) {
        pool_.mark_plausible(used_, process_);
        loaned_ = next_free();
      }
      if (loaned_ != kNoChunk) {
        next_ = loaned_ + 1;
        state.loaned.store(loaned_ + 1, std::memory_order_release);
        if (in_use <= pool_.chunks() && in_use > state.peak_in_use.load(std::memory_order_relaxed))
          state.peak_in_use.store(in_use);
        return begin(pool_.header(loaned_));
      }
    }
    state.pool_empty.fetch_add(1, std::memory_order_relaxed);
    return nullptr;
  }

  void publish(int64_t stamp_ns, int64_t published_ns, int64_t visible_at_ns) override {
    if (loaned_ == kNoChunk) return;
    MessageHeader* header = pool_.header(loaned_);
    header->published_ns = published_ns;
    header->visible_at_ns = visible_at_ns;
    put(stamp_ns, visible_at_ns, kSettled, 0);
  }

  bool announces() const override { return true; }

  void announce(int64_t stamp_ns, uint32_t commit, int64_t delay_ns) override {
    if (loaned_ != kNoChunk) put(stamp_ns, 0, commit, delay_ns);
  }

  void settle(int64_t published_ns, int64_t visible_at_ns) override {
    const uint64_t newest = pool_.state().newest.load(std::memory_order_relaxed);
    uint64_t sequence = pool_.first_announced();
    if (visible_at_ns == CommitRing::kNever) return pool_.withdraw(sequence);
    for (; sequence <= newest; ++sequence) {
      PoolSlot& slot = pool_.slot(sequence);
      const int64_t at_ns = visible_at_ns + slot.delay_ns.load(std::memory_order_relaxed);
      MessageHeader* header = pool_.header(slot.chunk.load(std::memory_order_relaxed));
      if (header->sequence == sequence) {  // else an old message again, as it was
        header->published_ns = published_ns;
        header->visible_at_ns = at_ns;
      }
      slot.visible_at_ns.store(at_ns, std::memory_order_relaxed);
      slot.commit.store(kSettled, std::memory_order_release);
    }
  }

  bool intact() const override { return loaned_ == kNoChunk || pool_.intact(loaned_); }

  void discard() override {
    if (loaned_ != kNoChunk) pool_.state().loaned.store(0);
    loaned_ = kNoChunk;
  }

  bool repeat(int64_t, int64_t visible_at_ns) override { return put_again(visible_at_ns, kSettled, 0); }
  bool announce_again(uint32_t commit, int64_t delay_ns) override { return put_again(0, commit, delay_ns); }

  uint64_t go_on_after(uint64_t) override { return pool_.state().newest.load(); }

  void rehearse() const override {
    pool_.mark_used(used_);
    if (const uint32_t chunk = next_free(); chunk != kNoChunk) pool_.prefetch_ends(chunk);
    prefetch(&pool_.slot(pool_.state().newest.load(std::memory_order_relaxed) + 1), sizeof(PoolSlot));
  }

  WriterStatistics statistics() const override {
    WriterStatistics s;
    s.sent = pool_.state().newest.load(std::memory_order_acquire);
    s.pool_empty = pool_.state().pool_empty.load();
    s.chunks = pool_.chunks();
    s.peak_in_use = pool_.state().peak_in_use.load();
    s.in_use = pool_.mark_used(used_);
    s.bytes = pool_.bytes();
    return s;
  }

 private:
  void put(int64_t stamp_ns, int64_t visible_at_ns, uint32_t commit, int64_t delay_ns) {
    MessageHeader* header = pool_.header(loaned_);
    header->stamp_ns = stamp_ns;
    header->sequence = pool_.state().newest.load(std::memory_order_relaxed) + 1;
    pool_.announce(loaned_, stamp_ns, visible_at_ns, commit, delay_ns);
    loaned_ = kNoChunk;
  }

  bool put_again(int64_t visible_at_ns, uint32_t commit, int64_t delay_ns) {
    const uint64_t newest = pool_.state().newest.load(std::memory_order_relaxed);
    const PoolSlot& last = pool_.slot(newest);
    // None yet; or an earlier writer of this port has gone and took its messages along.
    if (newest == 0 || last.sequence.load() != newest) return false;
    pool_.announce(last.chunk.load(std::memory_order_relaxed), last.stamp_ns.load(std::memory_order_relaxed),
                   visible_at_ns, commit, delay_ns);
    return true;
  }

  /// The next chunk that is not marked as used, in turn.
  uint32_t next_free() const {
    for (uint32_t i = 0; i < pool_.chunks(); ++i) {
      const uint32_t chunk = (next_ + i) % pool_.chunks();
      if ((used_[chunk / 64] >> chunk % 64 & 1) == 0) return chunk;
    }
    return kNoChunk;
  }

  MessageHeader* begin(MessageHeader* header) {
    reached(MessageStep::after_loan, pool_.index());
    *header = MessageHeader{};
    header->loan_offset = pool_.offset(header);
    pool_.mark_end(loaned_);
    pool_.plan().type->place(header + 1, pool_.plan().capacity);
    reached(MessageStep::half_written, pool_.index(), header, pool_.chunk_bytes());
    return header;
  }

  const LocalPool& pool_;
  const uint32_t process_;
  uint32_t loaned_ = kNoChunk, next_ = 0;
  mutable std::vector<uint64_t> used_;  ///< chunks that were not free when it last looked
};

class LocalReader final : public Reader {
 public:
  LocalReader(const LocalPool& pool, uint32_t process)
      : pool_(pool), process_(process), row_(pool.claim_row(process)), flags_(pool.words()), holds_(pool.chunks()) {}
  ~LocalReader() override { pool_.return_row(process_, row_); }

  void set_commits(CommitRing& commits, const Clock& clock) override {
    commits_ = &commits;
    clock_ = &clock;
  }

  size_t list(int64_t limit_ns, std::span<Candidate> out) override {
    limit_ns_ = limit_ns;
    size_t count = 0;
    const uint64_t newest = pool_.state().newest.load();
    const uint64_t oldest = newest > pool_.slots() ? newest - pool_.slots() + 1 : 1;
    for (uint64_t s = newest; s >= oldest && count < out.size(); --s) count += look(s, out[count]);
    return count;
  }

  Held take(uint64_t sequence) override {
    Candidate listed;
    if (!look(sequence, listed)) return {};
    const PoolSlot& slot = pool_.slot(sequence);
    const uint32_t chunk = slot.chunk.load();
    Held held{nullptr, sequence, listed.stamp_ns, listed.visible_at_ns, chunk};
    if (chunk >= pool_.chunks()) return {};
    flag(chunk);
    reached(MessageStep::inside_take, pool_.index());
    if (slot.sequence.load() != sequence) {  // the chunk may already be somebody else's
      let_go(chunk);
      return {};
    }
    if (!pool_.intact(chunk)) {  // its own process wrote there; this one goes on
      damaged_ += sequence != std::exchange(last_damaged_, sequence);
      let_go(chunk);
      return {};
    }
    held.header = pool_.header(chunk);
    reached(MessageStep::while_held, pool_.index());
    return held;
  }

  void release(Held& held) override {
    if (held) let_go(held.chunk);
    held = {};
  }

  uint64_t damaged() const override { return damaged_; }

 private:
  /// False if the message of that number is gone, or not for a job released at the limit of the last list().
  bool look(uint64_t sequence, Candidate& out) const {
    const PoolSlot& slot = pool_.slot(sequence);
    while (slot.sequence.load() == sequence) {
      const uint32_t commit = slot.commit.load();
      out = {sequence, slot.stamp_ns.load(), slot.visible_at_ns.load()};
      const int64_t delay_ns = slot.delay_ns.load();
      const int64_t commit_ns = commit == kSettled ? 0 : committed_ns(commit);
      // Settled, taken back or overwritten while we read it; then the word may have been another commit's.
      if (slot.sequence.load() != sequence || slot.commit.load() != commit) continue;
      if (commit_ns == CommitRing::kSpoiled) commits_->note_spoiled();
      if (commit_ns == CommitRing::kSpoiled || commit_ns == CommitRing::kNever) return false;
      // Unsigned: what a stray store left there may be any number.
      if (commit != kSettled)
        out.visible_at_ns = static_cast<int64_t>(static_cast<uint64_t>(commit_ns) + static_cast<uint64_t>(delay_ns));
      return out.visible_at_ns <= limit_ns_;
    }
    return false;
  }

  int64_t committed_ns(uint32_t commit) const {
    return commits_ == nullptr ? CommitRing::kNever : commits_->look(commit, limit_ns_, *clock_);
  }

  /// A reader may hold one chunk for several messages, which repeat each other.
  void flag(uint32_t chunk) {
    if (holds_[chunk]++ > 0) return;
    flags_[chunk / 64] |= uint64_t{1} << chunk % 64;
    row_[chunk / 64].store(flags_[chunk / 64]);  // step F of local_pool.hpp
  }
  void let_go(uint32_t chunk) {
    if (--holds_[chunk] > 0) return;
    reached(MessageStep::inside_release, pool_.index());
    flags_[chunk / 64] &= ~(uint64_t{1} << chunk % 64);
    row_[chunk / 64].store(flags_[chunk / 64], std::memory_order_release);
  }

  const LocalPool& pool_;
  const uint32_t process_;
  LocalPool::Word* const row_;
  std::vector<uint64_t> flags_;  ///< what row_ says, or has to
  std::vector<uint32_t> holds_;  ///< by chunk
  uint64_t damaged_ = 0, last_damaged_ = 0;
  int64_t limit_ns_ = std::numeric_limits<int64_t>::max();
  CommitRing* commits_ = nullptr;
  const Clock* clock_ = nullptr;
};

/// The parts of the file: first the flags of each process, then of each port what its writer manages it by, its chunks.
class LocalTransport final : public Transport {
 public:
  enum class How { alone, make, join };
  LocalTransport(std::span<const PortPlan> ports, const PoolFile& file, uint32_t process, How how)
      : process_(process), processes_(file.processes()), alone_(how == How::alone) {
    if (process == 0 || process > processes_)
      throw std::logic_error("process " + std::to_string(process) + " of " + std::to_string(processes_));
    for (const PortPlan& port : ports) pools_.emplace_back(port, pools_.size(), processes_);
    std::vector<uint64_t> parts(processes_);
    for (const LocalPool& pool : pools_) {
      for (uint32_t p = 0; p < processes_; ++p) parts[p] += pool.flag_bytes();
      parts.insert(parts.end(), {pool.control_bytes(), pool.bytes()});
    }
    bytes_ = PoolMemory::bytes(parts);
    if (how != How::join) file.resize(bytes_);
    // Of another size, the same offsets would mean something else, and what lies behind its end would end this process.
    else if (file.bytes() != bytes_) throw std::logic_error("the message pools were made for other ports");
    memory_.emplace(file, parts, alone_ ? PoolMemory::Access::all : PoolMemory::Access::parts);
    if (!pools_.empty()) memory_->allow_writing(process_ - 1);
    lay_out();
  }

  std::unique_ptr<Writer> make_writer(size_t port) override {
    memory_->allow_writing(control_of(port));
    memory_->allow_writing(chunks_of(port));
    return std::make_unique<LocalWriter>(pools_[port], process_);
  }
  std::unique_ptr<Reader> make_reader(size_t port) override {
    return std::make_unique<LocalReader>(pools_[port], process_);
  }
  uint32_t reclaim(uint32_t process) override {
    if (alone_ || process == 0 || process > processes_ || pools_.empty()) return 0;
    const uint32_t before = chunks_in_use();
    const PoolMemory::Window flags = memory_->write(process - 1);
    uint64_t at = 0;
    for (size_t p = 0; p < pools_.size(); ++p) {
      LocalPool dead = pools_[p];
      dead.lay_out_flags(process, flags.at() + at);
      at += dead.flag_bytes();
      dead.reclaim_readers(process);
      if (dead.state().writer.load() != process) continue;
      const PoolMemory::Window control = memory_->write(control_of(p));
      dead.lay_out_control(control.at());
      dead.reclaim_writer();
    }
    const uint32_t after = chunks_in_use();
    return before > after ? before - after : 0;  // others loan and release meanwhile
  }
  uint32_t chunks_in_use() const override {
    uint32_t in_use = 0;
    for (const LocalPool& pool : pools_) in_use += pool.in_use();
    return in_use;
  }
  uint64_t shared_memory_bytes() const override { return bytes_; }
  const char* name() const override { return "local"; }

 private:
  size_t control_of(size_t port) const { return processes_ + 2 * port; }
  size_t chunks_of(size_t port) const { return processes_ + 2 * port + 1; }

  void lay_out() {
    for (uint32_t process = 1; process <= processes_; ++process) {
      std::byte* at = memory_->at(process - 1);
      for (LocalPool& pool : pools_) {
        pool.lay_out_flags(process, at);
        at += pool.flag_bytes();
      }
    }
    for (size_t p = 0; p < pools_.size(); ++p) {
      pools_[p].lay_out_control(memory_->at(control_of(p)));
      pools_[p].lay_out_chunks(memory_->at(chunks_of(p)));
    }
  }

  const uint32_t process_, processes_;
  const bool alone_;
  std::vector<LocalPool> pools_;
  std::optional<PoolMemory> memory_;
  uint64_t bytes_ = 0;
};

}  // namespace

std::unique_ptr<Transport> make_local_transport(std::span<const PortPlan> ports) {
  return std::make_unique<LocalTransport>(ports, PoolFile(1), 1, LocalTransport::How::alone);
}

std::unique_ptr<Transport> make_local_transport(std::span<const PortPlan> ports, const PoolFile& file,
                                                uint32_t process) {
  return std::make_unique<LocalTransport>(ports, file, process, LocalTransport::How::make);
}

std::unique_ptr<Transport> join_local_transport(std::span<const PortPlan> ports, const PoolFile& file,
                                                uint32_t process) {
  return std::make_unique<LocalTransport>(ports, file, process, LocalTransport::How::join);
}

}  // namespace takt
