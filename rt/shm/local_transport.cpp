// SPDX-License-Identifier: Apache-2.0
// Writers and readers over the pools of local_pool.hpp: the writer looks for a free chunk, a reader adds its bit to the
// holders of one that is not free and then checks that the slot still names that message.
#include "rt/shm/local_transport.hpp"

#include <sys/mman.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <limits>
#include <stdexcept>
#include <vector>

#include "rt/shm/commit_ring.hpp"
#include "rt/shm/kill_order.hpp"
#include "rt/shm/local_pool.hpp"

namespace takt {
namespace {

constexpr uint32_t kNoChunk = 0xffffffff;
constexpr uint32_t kSettled = 0;  // no commit

/// Places parts one after the other, each on a cache line of its own; without memory it only counts.
class Carver {
 public:
  explicit Carver(std::byte* memory) : memory_(memory) {}
  std::byte* operator()(uint64_t bytes) {
    std::byte* at = memory_ == nullptr ? nullptr : memory_ + used_;
    used_ = round_up(used_ + bytes, 64);
    return at;
  }
  void to_next_page() { used_ = round_up(used_, 4096); }
  uint64_t used() const { return used_; }

 private:
  static constexpr uint64_t round_up(uint64_t bytes, uint64_t to) { return (bytes + to - 1) / to * to; }
  std::byte* memory_;
  uint64_t used_ = 0;
};

class LocalWriter final : public Writer {
 public:
  LocalWriter(const LocalPool& pool, uint32_t process) : pool_(pool) { pool.state().writer.store(process); }
  ~LocalWriter() override {
    discard();
    for (uint64_t s = 1; s <= pool_.slots(); ++s) pool_.evict(pool_.slot(s));
  }

  MessageHeader* loan() override {
    for (uint32_t i = 0; i < pool_.chunks() && loaned_ == kNoChunk; ++i) {
      const uint32_t chunk = (next_ + i) % pool_.chunks();
      if (!pool_.loan(chunk)) continue;
      next_ = chunk + 1;
      loaned_ = chunk;
      const uint32_t in_use = pool_.in_use();
      if (in_use > pool_.state().peak_in_use.load(std::memory_order_relaxed)) pool_.state().peak_in_use.store(in_use);
      return begin(pool_.header(chunk));
    }
    pool_.state().pool_empty.fetch_add(1, std::memory_order_relaxed);
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

  void discard() override {
    if (loaned_ != kNoChunk) pool_.drop(loaned_, PoolState::kWriter);
    loaned_ = kNoChunk;
  }

  bool repeat(int64_t, int64_t visible_at_ns) override { return put_again(visible_at_ns, kSettled, 0); }
  bool announce_again(uint32_t commit, int64_t delay_ns) override { return put_again(0, commit, delay_ns); }

  uint64_t go_on_after(uint64_t) override { return pool_.state().newest.load(); }

  WriterStatistics statistics() const override {
    WriterStatistics s;
    s.sent = pool_.state().newest.load(std::memory_order_acquire);
    s.pool_empty = pool_.state().pool_empty.load();
    s.chunks = pool_.chunks();
    s.peak_in_use = pool_.state().peak_in_use.load();
    s.in_use = pool_.in_use();
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
    const uint32_t chunk = last.chunk.load(std::memory_order_relaxed);
    pool_.hold(chunk, PoolState::kWriter);
    pool_.announce(chunk, last.stamp_ns.load(std::memory_order_relaxed), visible_at_ns, commit, delay_ns);
    return true;
  }

  MessageHeader* begin(MessageHeader* header) {
    reached(MessageStep::after_loan, pool_.index());
    *header = MessageHeader{};
    header->loan_offset = pool_.offset(header);
    pool_.plan().type->place(header + 1, pool_.plan().capacity);
    reached(MessageStep::half_written, pool_.index(), header, pool_.chunk_bytes());
    return header;
  }

  const LocalPool& pool_;
  uint32_t loaned_ = kNoChunk, next_ = 0;
};

class LocalReader final : public Reader {
 public:
  LocalReader(const LocalPool& pool, uint32_t process)
      : pool_(pool), holder_(pool.claim_reader(process)), holds_(pool.chunks()) {}
  ~LocalReader() override {
    for (uint32_t chunk = 0; chunk < holds_.size(); ++chunk)
      if (holds_[chunk] > 0) pool_.drop(chunk, holder_);
    pool_.return_reader(holder_);
  }

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
    if (!pool_.hold(chunk, holder_)) return {};
    ++holds_[chunk];
    if (slot.sequence.load() != sequence) {  // the chunk may already be somebody else's
      let_go(chunk);
      return {};
    }
    held.header = pool_.header(chunk);
    const uint64_t offset = pool_.offset(held.header);
    if (held.header->loan_offset != offset) {
      std::fprintf(stderr, "takt: bug: message of %s.%s was loaned at offset %lu and taken at %lu\n",
                   pool_.plan().node.c_str(), pool_.plan().port.c_str(), held.header->loan_offset, offset);
      std::abort();
    }
    reached(MessageStep::while_held, pool_.index());
    return held;
  }

  void release(Held& held) override {
    if (held) let_go(held.chunk);
    held = {};
  }

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
      if (commit != kSettled) out.visible_at_ns = commit_ns + delay_ns;
      return out.visible_at_ns <= limit_ns_;
    }
    return false;
  }

  int64_t committed_ns(uint32_t commit) const {
    return commits_ == nullptr ? CommitRing::kNever : commits_->look(commit, limit_ns_, *clock_);
  }

  /// A reader may hold one chunk for several messages, which repeat each other.
  void let_go(uint32_t chunk) {
    if (--holds_[chunk] > 0) return;
    reached(MessageStep::inside_release, pool_.index());
    pool_.drop(chunk, holder_);
  }

  const LocalPool& pool_;
  const uint32_t holder_;
  std::vector<uint32_t> holds_;  ///< by chunk
  int64_t limit_ns_ = std::numeric_limits<int64_t>::max();
  CommitRing* commits_ = nullptr;
  const Clock* clock_ = nullptr;
};

class LocalTransport final : public Transport {
 public:
  /// `fresh`: sizes the file and puts empty ports into it; otherwise another process has.
  LocalTransport(std::span<const PortPlan> ports, const PoolFile& file, uint32_t process, bool fresh)
      : process_(process) {
    for (const PortPlan& port : ports) pools_.emplace_back(port, pools_.size());
    bytes_ = carve(nullptr);
    if (bytes_ == 0) return;
    if (fresh) file.resize(bytes_);
    // Of another size, the same offsets would mean something else, and what lies behind its end would end this process.
    else if (file.bytes() != bytes_) throw std::logic_error("the message pools were made for other ports");
    map(file);
    carve(memory_);
    if (!fresh) return;
    for (LocalPool& pool : pools_) pool.construct();
  }

  ~LocalTransport() override {
    if (memory_ != nullptr) munmap(memory_, bytes_);
  }

  std::unique_ptr<Writer> make_writer(size_t port) override {
    return std::make_unique<LocalWriter>(pools_[port], process_);
  }
  std::unique_ptr<Reader> make_reader(size_t port) override {
    return std::make_unique<LocalReader>(pools_[port], process_);
  }
  uint32_t reclaim(uint32_t process) override {
    uint32_t freed = 0;
    for (const LocalPool& pool : pools_) freed += pool.reclaim(process);
    return freed;
  }
  uint32_t chunks_in_use() const override {
    uint32_t in_use = 0;
    for (const LocalPool& pool : pools_) in_use += pool.in_use();
    return in_use;
  }
  uint64_t shared_memory_bytes() const override { return bytes_; }
  const char* name() const override { return "local"; }

 private:
  /// Every process places the ports of the same plan at the same offsets.
  uint64_t carve(std::byte* memory) {
    Carver carver(memory);
    for (LocalPool& pool : pools_) pool.lay_out_control(carver);
    for (LocalPool& pool : pools_) {
      carver.to_next_page();
      pool.lay_out_chunks(carver);
    }
    carver.to_next_page();
    return carver.used();
  }

  void map(const PoolFile& file) {
    // Populated now, so that no job takes the page fault.
    void* memory = mmap(nullptr, bytes_, PROT_READ | PROT_WRITE, MAP_SHARED | MAP_POPULATE, file.descriptor(), 0);
    if (memory == MAP_FAILED)
      throw std::runtime_error("cannot map " + std::to_string(bytes_ / 1'000'000) + " MB of message pools: " +
                               std::strerror(errno) + "; lower image sizes or edge depths, or free memory");
    memory_ = static_cast<std::byte*>(memory);
  }

  const uint32_t process_;
  std::vector<LocalPool> pools_;
  std::byte* memory_ = nullptr;
  uint64_t bytes_ = 0;
};

}  // namespace

PoolFile::PoolFile() : descriptor_(memfd_create("takt", MFD_CLOEXEC)) {
  if (descriptor_ < 0) throw std::runtime_error(std::string("shared memory: ") + std::strerror(errno));
}

PoolFile::~PoolFile() { close(descriptor_); }

void PoolFile::resize(uint64_t bytes) const {
  if (ftruncate(descriptor_, static_cast<off_t>(bytes)) != 0)
    throw std::runtime_error("shared memory of " + std::to_string(bytes) + " bytes: " + std::strerror(errno));
}

uint64_t PoolFile::bytes() const {
  struct stat status {};
  if (fstat(descriptor_, &status) != 0) throw std::runtime_error(std::string("shared memory: ") + std::strerror(errno));
  return static_cast<uint64_t>(status.st_size);
}

std::unique_ptr<Transport> make_local_transport(std::span<const PortPlan> ports) {
  return std::make_unique<LocalTransport>(ports, PoolFile(), 1, true);
}

std::unique_ptr<Transport> make_local_transport(std::span<const PortPlan> ports, const PoolFile& file,
                                                uint32_t process) {
  return std::make_unique<LocalTransport>(ports, file, process, true);
}

std::unique_ptr<Transport> join_local_transport(std::span<const PortPlan> ports, const PoolFile& file,
                                                uint32_t process) {
  return std::make_unique<LocalTransport>(ports, file, process, false);
}

}  // namespace takt
