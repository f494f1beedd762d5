// SPDX-License-Identifier: Apache-2.0
// A message travels as a chunk that starts with our MessageHeader. iceoryx cannot publish a chunk twice, so a repeated
// message travels as a *note* (a header and the sequence it stands for) over a second, tiny publisher of the same
// output; notes can therefore never push messages out of a reader's queue. The reader merges both by sequence.
#include "rt/shm/iceoryx/ports.hpp"

#include <algorithm>
#include <array>
#include <cstdio>
#include <cstdlib>
#include <new>
#include <thread>
#include <vector>

#include "iceoryx_hoofs/internal/relocatable_pointer/base_relative_pointer.hpp"
#include "iceoryx_posh/popo/untyped_publisher.hpp"
#include "iceoryx_posh/popo/untyped_subscriber.hpp"
#include "rt/shm/kill_order.hpp"

#if defined(__SANITIZE_THREAD__)
extern "C" void __tsan_acquire(void*);
extern "C" void __tsan_release(void*);
#endif

namespace takt {
namespace {

static_assert(iceoryx_limit::history == iox::MAX_PUBLISHER_HISTORY);
static_assert(iceoryx_limit::queue == iox::MAX_SUBSCRIBER_QUEUE_CAPACITY);
static_assert(iceoryx_limit::pools == iox::MAX_NUMBER_OF_MEMPOOLS);
static_assert(iceoryx_limit::outputs * 2 == iox::MAX_PUBLISHERS - iox::NUMBER_OF_INTERNAL_PUBLISHERS);
static_assert(iceoryx_limit::inputs * 2 == iox::MAX_SUBSCRIBERS);
static_assert(iceoryx_limit::chunk_header == sizeof(iox::mepoo::ChunkHeader));

/// "Output repeats the message of that sequence", itself with a sequence and an instant of its own.
struct Note {
  MessageHeader header;
  uint64_t repeated = 0;
};

// ThreadSanitizer does not see the hand-over inside the uninstrumented iceoryx library.
void hand_over([[maybe_unused]] const void* chunk) {
#if defined(__SANITIZE_THREAD__)
  __tsan_release(const_cast<void*>(chunk));
#endif
}
void take_over([[maybe_unused]] const void* chunk) {
#if defined(__SANITIZE_THREAD__)
  __tsan_acquire(const_cast<void*>(chunk));
#endif
}

/// Distance of a chunk from the start of its segment: the same in every process.
uint64_t segment_offset(const void* chunk) {
  auto* address = const_cast<void*>(chunk);
  return iox::rp::BaseRelativePointer::getOffset(iox::rp::BaseRelativePointer::searchId(address), address);
}

iox::capro::ServiceDescription service(const IceoryxPort& port, const char* kind) {
  using Name = iox::capro::IdString_t;
  const std::string name = std::to_string(port.index) + kind + port.plan.node + "." + port.plan.port;
  return {Name("takt"), Name(iox::cxx::TruncateToCapacity, port.domain.c_str()),
          Name(iox::cxx::TruncateToCapacity, name.c_str())};
}

constexpr const char* kMessages = ":";
constexpr const char* kNotes = "~";

struct OpenPort : iox::popo::BasePort {
  using BasePort::getMembers;
};
using PortData = iox::popo::BasePortData* (iox::popo::BasePort::*)() noexcept;

/// A publisher that can tell how full its pool is. Asking first matters: with an empty pool iceoryx writes to stderr,
/// blocking, from whatever real-time thread asked.
class Publisher : public iox::popo::UntypedPublisher {
 public:
  Publisher(const iox::capro::ServiceDescription& name, uint64_t history) : UntypedPublisher(name, options(history)) {}

  iox::mepoo::MemPoolInfo pool(uint32_t index) {
    constexpr PortData members = &OpenPort::getMembers;
    auto* data = static_cast<iox::popo::PublisherPortData*>((port().*members)());
    return data->m_chunkSenderData.m_memoryMgr->getMemPoolInfo(index);
  }

  /// Dies, if it is ordered to, with the lock in hand that publishing takes: no mutex of iceoryx is robust.
  void die_inside_publish(size_t port) {
    constexpr PortData members = &OpenPort::getMembers;
    if (about_to_die(MessageStep::inside_publish, port))
      static_cast<iox::popo::PublisherPortData*>((UntypedPublisher::port().*members)())->m_chunkSenderData.lock();
    reached(MessageStep::inside_publish, port);
  }

  /// Null if the pool is empty.
  void* try_loan(const IceoryxPool& pool_plan, uint32_t index) {
    const iox::mepoo::MemPoolInfo info = pool(index);
    if (info.m_usedChunks >= info.m_numChunks) return nullptr;
    void* chunk = nullptr;
    loan(pool_plan.loan_bytes, iceoryx_limit::alignment).and_then([&](void*& loaned) { chunk = loaned; });
    if (chunk != nullptr) take_over(chunk);
    return chunk;
  }

 private:
  static iox::popo::PublisherOptions options(uint64_t history) {
    iox::popo::PublisherOptions options;
    options.historyCapacity = std::min<uint64_t>(history, iceoryx_limit::history);
    return options;
  }
};

class IceoryxWriter final : public Writer {
 public:
  explicit IceoryxWriter(const IceoryxPort& port)
      : port_(port),
        messages_(service(port, kMessages), port.plan.history),
        notes_(service(port, kNotes), port.plan.history) {}
  ~IceoryxWriter() override { discard(); }

  MessageHeader* loan() override {
    void* chunk = loaned_ == nullptr ? messages_.try_loan(port_.pool, port_.pool_index) : nullptr;
    if (chunk == nullptr) {
      ++pool_empty_;
      return nullptr;
    }
    loaned_ = ::new (chunk) MessageHeader;
    loaned_->loan_offset = segment_offset(loaned_);
    reached(MessageStep::after_loan, port_.index);
    port_.plan.type->place(loaned_ + 1, port_.plan.capacity);
    reached(MessageStep::half_written, port_.index, loaned_, port_.plan.chunk_bytes());
    return loaned_;
  }

  void publish(int64_t stamp_ns, int64_t published_ns, int64_t visible_at_ns) override {
    if (loaned_ == nullptr) return;
    loaned_->stamp_ns = stamp_ns;
    loaned_->published_ns = published_ns;
    loaned_->visible_at_ns = visible_at_ns;
    loaned_->sequence = ++sequence_;
    last_message_ = sequence_;
    last_stamp_ns_ = stamp_ns;
    hand_over(loaned_);
    messages_.die_inside_publish(port_.index);
    messages_.publish(loaned_);
    loaned_ = nullptr;
    reached(MessageStep::after_publish, port_.index);
  }

  void discard() override {
    if (loaned_ != nullptr) messages_.release(loaned_);
    loaned_ = nullptr;
  }

  bool repeat(int64_t published_ns, int64_t visible_at_ns) override {
    if (last_message_ == 0) return false;
    void* chunk = notes_.try_loan(port_.note_pool, 0);
    if (chunk == nullptr) {
      ++pool_empty_;
      return false;
    }
    Note* note = ::new (chunk) Note;
    note->header.stamp_ns = last_stamp_ns_;
    note->header.published_ns = published_ns;
    note->header.visible_at_ns = visible_at_ns;
    note->header.sequence = ++sequence_;
    note->header.loan_offset = segment_offset(note);
    note->repeated = last_message_;
    hand_over(note);
    notes_.publish(note);
    return true;
  }

  uint64_t go_on_after(uint64_t noted) override { return sequence_ = noted; }

  WriterStatistics statistics() const override {
    const iox::mepoo::MemPoolInfo info = const_cast<Publisher&>(messages_).pool(port_.pool_index);
    WriterStatistics s;
    s.sent = sequence_;
    s.pool_empty = pool_empty_;
    s.chunks = info.m_numChunks;
    s.in_use = info.m_usedChunks;
    s.peak_in_use = info.m_numChunks - info.m_minFreeChunks;
    s.bytes = uint64_t{info.m_numChunks} * info.m_chunkSize;
    return s;
  }

 private:
  const IceoryxPort& port_;
  Publisher messages_, notes_;
  MessageHeader* loaned_ = nullptr;
  uint64_t sequence_ = 0, last_message_ = 0, pool_empty_ = 0;
  int64_t last_stamp_ns_ = 0;
};

/// Takes one edge's messages out of its queues whenever it is asked, so that the newest `history` of them are at hand;
/// older ones go back to the pool at once.
class IceoryxReader final : public Reader {
 public:
  explicit IceoryxReader(const IceoryxPort& port)
      : port_(port),
        history_(port.plan.history),
        slots_(port.plan.history + port.plan.held),
        messages_(service(port, kMessages), options(history_)),
        notes_(service(port, kNotes), options(history_)) {
    kept_.reserve(history_);
    repeats_.reserve(history_);
  }

  ~IceoryxReader() override {
    for (Slot& slot : slots_)
      if (slot.header != nullptr) give_back(slot);
  }

  bool connected() const {
    const auto waiting = [](iox::SubscribeState s) { return s == iox::SubscribeState::SUBSCRIBE_REQUESTED; };
    return !waiting(messages_.getSubscriptionState()) && !waiting(notes_.getSubscriptionState());
  }

  size_t list(int64_t limit_ns, std::span<Candidate> out) override {
    // Notes first: whatever they repeat was published earlier and is then found among the messages.
    drain_notes();
    drain_messages();
    size_t count = 0, seen = 0;
    auto message = kept_.rbegin();
    auto repeat = repeats_.rbegin();
    while (seen < history_ && count < out.size() && (message != kept_.rend() || repeat != repeats_.rend())) {
      Candidate candidate;
      if (repeat == repeats_.rend() || (message != kept_.rend() && sequence_of(*message) > repeat->sequence)) {
        const MessageHeader& header = *slots_[*message++].header;
        candidate = {header.sequence, header.stamp_ns, header.visible_at_ns};
      } else {
        candidate = {repeat->sequence, repeat->stamp_ns, repeat->visible_at_ns};
        if (find(repeat++->repeated) == kNone) continue;
      }
      ++seen;
      if (candidate.visible_at_ns <= limit_ns) out[count++] = candidate;
    }
    return count;
  }

  Held take(uint64_t sequence) override {
    uint32_t index = find(sequence);
    Held held;
    if (index != kNone) {
      const MessageHeader& header = *slots_[index].header;
      held = {&header, sequence, header.stamp_ns, header.visible_at_ns, index};
    } else {
      const auto repeat =
          std::find_if(repeats_.begin(), repeats_.end(), [&](const Repeat& r) { return r.sequence == sequence; });
      if (repeat == repeats_.end() || (index = find(repeat->repeated)) == kNone) return {};
      held = {slots_[index].header, sequence, repeat->stamp_ns, repeat->visible_at_ns, index};
    }
    check_never_copied(*held.header);
    ++slots_[index].holds;
    reached(MessageStep::while_held, port_.index);
    return held;
  }

  void release(Held& held) override {
    if (held) {
      Slot& slot = slots_[held.chunk];
      if (--slot.holds == 0 && !slot.kept) give_back(slot);
    }
    held = {};
  }

 private:
  static constexpr uint32_t kNone = 0xffffffff;

  struct Slot {
    const MessageHeader* header = nullptr;
    uint32_t holds = 0;  ///< by jobs
    bool kept = false;   ///< by us, as one of the newest
  };
  struct Repeat {
    uint64_t sequence = 0, repeated = 0;
    int64_t stamp_ns = 0, visible_at_ns = 0;
  };

  static iox::popo::SubscriberOptions options(uint64_t history) {
    iox::popo::SubscriberOptions options;
    options.queueCapacity = history;
    options.historyRequest = std::min<uint64_t>(history, iceoryx_limit::history);
    return options;
  }

  uint64_t sequence_of(uint32_t slot) const { return slots_[slot].header->sequence; }

  uint32_t find(uint64_t sequence) const {
    for (uint32_t slot : kept_)
      if (sequence_of(slot) == sequence) return slot;
    return kNone;
  }

  void drain_notes() {
    while (notes_.hasData()) {
      const void* chunk = nullptr;
      notes_.take().and_then([&](const void*& taken) { chunk = taken; });
      if (chunk == nullptr) return;
      take_over(chunk);
      const Note& note = *static_cast<const Note*>(chunk);
      if (repeats_.size() == history_) repeats_.erase(repeats_.begin());
      repeats_.push_back({note.header.sequence, note.repeated, note.header.stamp_ns, note.header.visible_at_ns});
      hand_over(chunk);
      notes_.release(chunk);
    }
  }

  void drain_messages() {
    while (messages_.hasData()) {
      // Room is made before the next one is taken, so that this edge never has more chunks than planned.
      if (kept_.size() == history_) {
        Slot& oldest = slots_[kept_.front()];
        kept_.erase(kept_.begin());
        oldest.kept = false;
        if (oldest.holds == 0) give_back(oldest);
      }
      const auto free =
          std::find_if(slots_.begin(), slots_.end(), [](const Slot& slot) { return slot.header == nullptr; });
      if (free == slots_.end()) return;  // jobs hold more than the graph said; the queue drops its oldest meanwhile
      messages_.take().and_then([&](const void*& taken) { free->header = static_cast<const MessageHeader*>(taken); });
      if (free->header == nullptr) return;
      take_over(free->header);
      free->kept = true;
      kept_.push_back(static_cast<uint32_t>(free - slots_.begin()));
    }
  }

  void give_back(Slot& slot) {
    reached(MessageStep::inside_release, port_.index);
    hand_over(slot.header);
    messages_.release(slot.header);
    slot = {};
  }

  void check_never_copied(const MessageHeader& header) const {
    const uint64_t offset = segment_offset(&header);
    if (header.loan_offset == offset) return;
    std::fprintf(stderr, "takt: bug: message of %s.%s was loaned at offset %lu and taken at %lu\n",
                 port_.plan.node.c_str(), port_.plan.port.c_str(), header.loan_offset, offset);
    std::abort();
  }

  const IceoryxPort& port_;
  const size_t history_;
  std::vector<Slot> slots_;
  std::vector<uint32_t> kept_;   ///< slots of the newest messages, oldest first
  std::vector<Repeat> repeats_;  ///< the newest notes, oldest first
  iox::popo::UntypedSubscriber messages_, notes_;
};

}  // namespace

std::unique_ptr<Writer> make_iceoryx_writer(const IceoryxPort& port) { return std::make_unique<IceoryxWriter>(port); }

std::unique_ptr<Reader> make_iceoryx_reader(const IceoryxPort& port) {
  auto reader = std::make_unique<IceoryxReader>(port);
  for (int tries = 0; tries < 1000 && !reader->connected(); ++tries)
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
  return reader;
}

}  // namespace takt
