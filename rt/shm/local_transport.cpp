// SPDX-License-Identifier: Apache-2.0
// The transport inside one process. A port is an array of chunks with a reference count each, and a ring of slots, one
// per kept message. A count of 0 is a free chunk, so there is no free list to corrupt and nothing to lock: the writer
// looks for a zero, a reader raises a count that is not zero and then checks that the slot still names that message.
#include <sys/mman.h>
#include <unistd.h>

#include <atomic>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <stdexcept>
#include <vector>

#include "rt/shm/transport.hpp"

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

struct Channel {
  PortPlan plan;
  std::byte* base = nullptr;
  uint64_t chunk_bytes = 0;
  std::vector<std::atomic<uint32_t>> references;
  std::vector<Slot> ring;
  std::atomic<uint64_t> newest{0};

  explicit Channel(const PortPlan& plan_)
      : plan(plan_),
        chunk_bytes((plan_.chunk_bytes() + 63) / 64 * 64),
        references(plan_.chunks()),
        ring(plan_.history) {}

  uint64_t bytes() const { return chunk_bytes * references.size(); }
  MessageHeader* header(uint32_t chunk) const { return reinterpret_cast<MessageHeader*>(base + chunk * chunk_bytes); }
  Slot& slot(uint64_t sequence) { return ring[sequence % ring.size()]; }
  void drop(uint32_t chunk) { references[chunk].fetch_sub(1, std::memory_order_acq_rel); }
  uint32_t in_use() const {
    uint32_t count = 0;
    for (const auto& r : references) count += r.load(std::memory_order_relaxed) != 0;
    return count;
  }
};

class LocalWriter final : public Writer {
 public:
  explicit LocalWriter(Channel& channel) : channel_(channel) {}
  ~LocalWriter() override {
    discard();
    for (uint64_t s = 1; s <= channel_.ring.size(); ++s) evict(channel_.slot(s));
  }

  MessageHeader* loan() override {
    if (loaned_ != kNoChunk) return channel_.header(loaned_);
    const auto count = static_cast<uint32_t>(channel_.references.size());
    for (uint32_t i = 0; i < count; ++i) {
      const uint32_t chunk = (next_ + i) % count;
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
    header->sequence = channel_.newest.load(std::memory_order_relaxed) + 1;
    announce(loaned_, stamp_ns, visible_at_ns);
    loaned_ = kNoChunk;
  }

  void discard() override {
    if (loaned_ != kNoChunk) channel_.drop(loaned_);
    loaned_ = kNoChunk;
  }

  bool repeat(int64_t, int64_t visible_at_ns) override {
    const uint64_t newest = channel_.newest.load(std::memory_order_relaxed);
    if (newest == 0) return false;
    const Slot& last = channel_.slot(newest);
    const uint32_t chunk = last.chunk.load(std::memory_order_relaxed);
    channel_.references[chunk].fetch_add(1, std::memory_order_acq_rel);
    announce(chunk, last.stamp_ns.load(std::memory_order_relaxed), visible_at_ns);
    return true;
  }

  WriterStatistics statistics() const override {
    WriterStatistics s = statistics_;
    s.sent = channel_.newest.load(std::memory_order_acquire);
    s.chunks = static_cast<uint32_t>(channel_.references.size());
    s.in_use = channel_.in_use();
    s.bytes = channel_.bytes();
    return s;
  }

 private:
  /// Takes over one reference to the chunk.
  void announce(uint32_t chunk, int64_t stamp_ns, int64_t visible_at_ns) {
    const uint64_t sequence = channel_.newest.load(std::memory_order_relaxed) + 1;
    Slot& slot = channel_.slot(sequence);
    evict(slot);
    slot.chunk.store(chunk);
    slot.stamp_ns.store(stamp_ns);
    slot.visible_at_ns.store(visible_at_ns);
    slot.sequence.store(sequence);
    channel_.newest.store(sequence);
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
    const uint64_t newest = channel_.newest.load();
    const uint64_t oldest = newest > channel_.ring.size() ? newest - channel_.ring.size() + 1 : 1;
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
  explicit LocalTransport(std::span<const PortPlan> ports) {
    for (const PortPlan& port : ports) {
      channels_.push_back(std::make_unique<Channel>(port));
      bytes_ += (channels_.back()->bytes() + kPage - 1) / kPage * kPage;
    }
    if (bytes_ == 0) return;
    map();
    std::byte* at = memory_;
    for (auto& channel : channels_) {
      channel->base = at;
      at += (channel->bytes() + kPage - 1) / kPage * kPage;
    }
  }

  ~LocalTransport() override {
    if (memory_ != nullptr) munmap(memory_, bytes_);
  }

  std::unique_ptr<Writer> make_writer(size_t port) override { return std::make_unique<LocalWriter>(*channels_[port]); }
  std::unique_ptr<Reader> make_reader(size_t port) override { return std::make_unique<LocalReader>(*channels_[port]); }
  uint64_t shared_memory_bytes() const override { return bytes_; }
  const char* name() const override { return "local"; }

 private:
  void map() {
    const int file = memfd_create("takt", MFD_CLOEXEC);
    if (file < 0 || ftruncate(file, static_cast<off_t>(bytes_)) != 0) {
      if (file >= 0) close(file);
      throw std::runtime_error("shared memory of " + std::to_string(bytes_) + " bytes: " + std::strerror(errno));
    }
    // Populated now, so that no job takes the page fault.
    void* memory = mmap(nullptr, bytes_, PROT_READ | PROT_WRITE, MAP_SHARED | MAP_POPULATE, file, 0);
    close(file);
    if (memory == MAP_FAILED)
      throw std::runtime_error("cannot map " + std::to_string(bytes_ / 1'000'000) + " MB of message pools: " +
                               std::strerror(errno) + "; lower image sizes or edge depths, or free memory");
    memory_ = static_cast<std::byte*>(memory);
  }

  std::vector<std::unique_ptr<Channel>> channels_;
  std::byte* memory_ = nullptr;
  uint64_t bytes_ = 0;
};

}  // namespace

std::unique_ptr<Transport> make_local_transport(std::span<const PortPlan> ports) {
  return std::make_unique<LocalTransport>(ports);
}

}  // namespace takt
