// SPDX-License-Identifier: Apache-2.0
// A port is an array of chunks with a reference count each, and a ring of slots, one per kept message; all of it,
// counts and slots included, lies in one shared-memory file, so that several processes can map it. A count of 0 is a
// free chunk, so there is no free list to corrupt and nothing to lock: the writer looks for a zero, a reader raises a
// count that is not zero and then checks that the slot still names that message.
#include "rt/shm/local_transport.hpp"

#include <sys/mman.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <cerrno>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <new>
#include <stdexcept>
#include <vector>

namespace takt {
namespace {

constexpr uint32_t kNoChunk = 0xffffffff;
constexpr uint64_t kPage = 4096;

struct Slot {
  std::atomic<uint64_t> sequence{0};  ///< 0 while empty or being changed
  std::atomic<uint32_t> chunk{kNoChunk};
  std::atomic<int64_t> stamp_ns{0};
  std::atomic<int64_t> visible_at_ns{0};
};

// What another process finds in the mapping must mean the same there: no pointers, and no lock behind an atomic.
static_assert(std::atomic<uint64_t>::is_always_lock_free && std::atomic<uint32_t>::is_always_lock_free);

/// One per port, in the file.
struct alignas(64) PortState {
  std::atomic<uint64_t> newest{0};
};

constexpr uint64_t round_up(uint64_t bytes, uint64_t to) { return (bytes + to - 1) / to * to; }

/// Places arrays one after the other; without memory it only counts.
class Carver {
 public:
  explicit Carver(std::byte* memory) : memory_(memory) {}
  template <class T>
  T* array(uint64_t count) {
    T* at = memory_ == nullptr ? nullptr : reinterpret_cast<T*>(memory_ + used_);
    used_ += round_up(sizeof(T) * count, 64);
    return at;
  }
  void to_next_page() { used_ = round_up(used_, kPage); }
  uint64_t used() const { return used_; }

 private:
  std::byte* memory_;
  uint64_t used_ = 0;
};

/// A port as this process sees it.
struct Channel {
  PortPlan plan;
  uint64_t chunk_bytes;
  uint32_t chunks, slots;
  PortState* state = nullptr;
  std::atomic<uint32_t>* references = nullptr;
  Slot* ring = nullptr;
  std::byte* base = nullptr;

  explicit Channel(const PortPlan& plan_)
      : plan(plan_), chunk_bytes(round_up(plan_.chunk_bytes(), 64)), chunks(plan_.chunks()), slots(plan_.history) {}

  void carve_control(Carver& carver) {
    state = carver.array<PortState>(1);
    references = carver.array<std::atomic<uint32_t>>(chunks);
    ring = carver.array<Slot>(slots);
  }
  void carve_chunks(Carver& carver) {
    carver.to_next_page();
    base = carver.array<std::byte>(bytes());
  }
  void construct() {
    ::new (state) PortState;
    for (uint32_t i = 0; i < chunks; ++i) ::new (references + i) std::atomic<uint32_t>(0);
    for (uint32_t i = 0; i < slots; ++i) ::new (ring + i) Slot;
  }

  uint64_t bytes() const { return chunk_bytes * chunks; }
  MessageHeader* header(uint32_t chunk) const { return reinterpret_cast<MessageHeader*>(base + chunk * chunk_bytes); }
  Slot& slot(uint64_t sequence) const { return ring[sequence % slots]; }
  void drop(uint32_t chunk) const { references[chunk].fetch_sub(1, std::memory_order_acq_rel); }
  uint32_t in_use() const {
    uint32_t count = 0;
    for (uint32_t i = 0; i < chunks; ++i) count += references[i].load(std::memory_order_relaxed) != 0;
    return count;
  }
};

class LocalWriter final : public Writer {
 public:
  explicit LocalWriter(Channel& channel) : channel_(channel) {}
  ~LocalWriter() override {
    discard();
    for (uint64_t s = 1; s <= channel_.slots; ++s) evict(channel_.slot(s));
  }

  MessageHeader* loan() override {
    if (loaned_ != kNoChunk) return channel_.header(loaned_);
    for (uint32_t i = 0; i < channel_.chunks; ++i) {
      const uint32_t chunk = (next_ + i) % channel_.chunks;
      uint32_t free = 0;
      if (!channel_.references[chunk].compare_exchange_strong(free, 1, std::memory_order_acq_rel)) continue;
      next_ = chunk + 1;
      loaned_ = chunk;
      statistics_.peak_in_use = std::max(statistics_.peak_in_use, channel_.in_use());
      MessageHeader* header = channel_.header(chunk);
      *header = MessageHeader{};
      header->loan_offset = static_cast<uint64_t>(reinterpret_cast<std::byte*>(header) - channel_.base);
      channel_.plan.type->place(header + 1, channel_.plan.capacity);
      return header;
    }
    ++statistics_.pool_empty;
    return nullptr;
  }

  void publish(int64_t stamp_ns, int64_t published_ns, int64_t visible_at_ns) override {
    if (loaned_ == kNoChunk) return;
    MessageHeader* header = channel_.header(loaned_);
    header->stamp_ns = stamp_ns;
    header->published_ns = published_ns;
    header->visible_at_ns = visible_at_ns;
    header->sequence = channel_.state->newest.load(std::memory_order_relaxed) + 1;
    announce(loaned_, stamp_ns, visible_at_ns);
    loaned_ = kNoChunk;
  }

  void discard() override {
    if (loaned_ != kNoChunk) channel_.drop(loaned_);
    loaned_ = kNoChunk;
  }

  bool repeat(int64_t, int64_t visible_at_ns) override {
    const uint64_t newest = channel_.state->newest.load(std::memory_order_relaxed);
    const Slot& last = channel_.slot(newest);
    // None yet; or an earlier writer of this port has gone, or was killed, and its chunk is free or about to be.
    if (newest == 0 || last.sequence.load() != newest) return false;
    const uint32_t chunk = last.chunk.load(std::memory_order_relaxed);
    channel_.references[chunk].fetch_add(1, std::memory_order_acq_rel);
    announce(chunk, last.stamp_ns.load(std::memory_order_relaxed), visible_at_ns);
    return true;
  }

  WriterStatistics statistics() const override {
    WriterStatistics s = statistics_;
    s.sent = channel_.state->newest.load(std::memory_order_acquire);
    s.chunks = channel_.chunks;
    s.in_use = channel_.in_use();
    s.bytes = channel_.bytes();
    return s;
  }

 private:
  /// Takes over one reference to the chunk.
  void announce(uint32_t chunk, int64_t stamp_ns, int64_t visible_at_ns) {
    const uint64_t sequence = channel_.state->newest.load(std::memory_order_relaxed) + 1;
    Slot& slot = channel_.slot(sequence);
    evict(slot);
    slot.chunk.store(chunk);
    slot.stamp_ns.store(stamp_ns);
    slot.visible_at_ns.store(visible_at_ns);
    slot.sequence.store(sequence);
    channel_.state->newest.store(sequence);
  }

  void evict(Slot& slot) {
    if (slot.sequence.exchange(0) == 0) return;
    channel_.drop(slot.chunk.load());
  }

  Channel& channel_;
  uint32_t loaned_ = kNoChunk, next_ = 0;
  WriterStatistics statistics_;
};

class LocalReader final : public Reader {
 public:
  explicit LocalReader(Channel& channel) : channel_(channel) {}

  size_t list(int64_t limit_ns, std::span<Candidate> out) override {
    size_t count = 0;
    const uint64_t newest = channel_.state->newest.load();
    const uint64_t oldest = newest > channel_.slots ? newest - channel_.slots + 1 : 1;
    for (uint64_t s = newest; s >= oldest && count < out.size(); --s) {
      Slot& slot = channel_.slot(s);
      if (slot.sequence.load() != s) continue;
      const Candidate candidate{s, slot.stamp_ns.load(), slot.visible_at_ns.load()};
      if (slot.sequence.load() != s) continue;  // overwritten while we read it
      if (candidate.visible_at_ns <= limit_ns) out[count++] = candidate;
    }
    return count;
  }

  Held take(uint64_t sequence) override {
    Slot& slot = channel_.slot(sequence);
    if (slot.sequence.load() != sequence) return {};
    const uint32_t chunk = slot.chunk.load();
    Held held{nullptr, sequence, slot.stamp_ns.load(), slot.visible_at_ns.load(), chunk};
    uint32_t references = channel_.references[chunk].load();
    do {
      if (references == 0) return {};
    } while (!channel_.references[chunk].compare_exchange_weak(references, references + 1));
    if (slot.sequence.load() != sequence) {  // the chunk may already be somebody else's
      channel_.drop(chunk);
      return {};
    }
    held.header = channel_.header(chunk);
    const auto offset = static_cast<uint64_t>(reinterpret_cast<const std::byte*>(held.header) - channel_.base);
    if (held.header->loan_offset != offset) {
      std::fprintf(stderr, "takt: bug: message of %s.%s was loaned at offset %lu and taken at %lu\n",
                   channel_.plan.node.c_str(), channel_.plan.port.c_str(), held.header->loan_offset, offset);
      std::abort();
    }
    return held;
  }

  void release(Held& held) override {
    if (held) channel_.drop(held.chunk);
    held = {};
  }

 private:
  Channel& channel_;
};

class LocalTransport final : public Transport {
 public:
  /// `fresh`: sizes the file and puts empty ports into it; otherwise another process has.
  LocalTransport(std::span<const PortPlan> ports, const PoolFile& file, bool fresh) {
    for (const PortPlan& port : ports) channels_.emplace_back(port);
    bytes_ = carve(nullptr);
    if (bytes_ == 0) return;
    if (fresh) file.resize(bytes_);
    // Of another size, the same offsets would mean something else, and what lies behind its end would end this process.
    else if (file.bytes() != bytes_) throw std::logic_error("the message pools were made for other ports");
    map(file);
    carve(memory_);
    if (!fresh) return;
    for (Channel& channel : channels_) channel.construct();
  }

  ~LocalTransport() override {
    if (memory_ != nullptr) munmap(memory_, bytes_);
  }

  std::unique_ptr<Writer> make_writer(size_t port) override { return std::make_unique<LocalWriter>(channels_[port]); }
  std::unique_ptr<Reader> make_reader(size_t port) override { return std::make_unique<LocalReader>(channels_[port]); }
  uint64_t shared_memory_bytes() const override { return bytes_; }
  const char* name() const override { return "local"; }

 private:
  /// Every process places the ports of the same plan at the same offsets.
  uint64_t carve(std::byte* memory) {
    Carver carver(memory);
    for (Channel& channel : channels_) channel.carve_control(carver);
    for (Channel& channel : channels_) channel.carve_chunks(carver);
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

  std::vector<Channel> channels_;
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
  return std::make_unique<LocalTransport>(ports, PoolFile(), true);
}

std::unique_ptr<Transport> make_local_transport(std::span<const PortPlan> ports, const PoolFile& file) {
  return std::make_unique<LocalTransport>(ports, file, true);
}

std::unique_ptr<Transport> join_local_transport(std::span<const PortPlan> ports, const PoolFile& file) {
  return std::make_unique<LocalTransport>(ports, file, false);
}

}  // namespace takt
