// SPDX-License-Identifier: Apache-2.0
// Takt's transports between processes, iceoryx and local; the wake-up by a doorbell in shared memory.
#include <sys/mman.h>

#include <array>
#include <limits>
#include <new>
#include <optional>

#include "bench/futex.hpp"
#include "bench/peers/medium.hpp"
#include "bench/suite.hpp"
#include "rt/msg/image.hpp"
#include "rt/shm/iceoryx_transport.hpp"
#include "rt/shm/local_transport.hpp"

namespace takt::bench {
namespace {

struct alignas(64) Doorbell {
  std::atomic<uint32_t> word{0};
};
constexpr size_t kMaxNodes = 16;
using Doorbells = std::array<Doorbell, kMaxNodes>;

class TaktEnds final : public Ends {
 public:
  /// `first`: the port of node 0.
  TaktEnds(const GraphShape& shape, size_t node, std::unique_ptr<Transport> transport, size_t first, Doorbells& bells)
      : bell_(bells[node].word), transport_(std::move(transport)) {
    if (node != shape.sink()) writer_ = transport_->make_writer(first + node);
    if (const auto producer = shape.trigger(node)) inputs_.push_back({transport_->make_reader(first + *producer)});
    for (size_t producer : shape.sides(node)) inputs_.push_back({transport_->make_reader(first + producer)});
    for (const GraphEdge& edge : shape.leaving(node))
      if (edge.trigger) wakes_.push_back(&bells[edge.to].word);
  }
  bool wait() override { return bell_.wait(kPatienceNs) && take(inputs_[0]); }
  size_t take_sides() override {
    size_t fresh = 0;
    for (size_t i = 1; i < inputs_.size(); ++i) fresh += take(inputs_[i]);
    return fresh;
  }
  void prepare() override { loaned_ = writer_->loan() != nullptr; }
  void publish() override {
    if (!loaned_) return;
    writer_->publish(0, 0, 0);
    for (std::atomic<uint32_t>* word : wakes_) wake(*word);
  }
  void finish() override {
    for (Input& input : inputs_) input.reader->release(input.held);
  }

 private:
  struct Input {
    std::unique_ptr<Reader> reader;
    Held held{};
    uint64_t last = 0;
  };
  /// The newest message; true if it was not taken before.
  static bool take(Input& input) {
    std::array<Candidate, 1> newest;
    if (input.reader->list(std::numeric_limits<int64_t>::max(), newest) == 0) return false;
    if (newest[0].sequence == input.last) return false;
    input.held = input.reader->take(newest[0].sequence);
    input.last = newest[0].sequence;
    return static_cast<bool>(input.held);
  }

  Bell bell_;
  std::unique_ptr<Transport> transport_;
  std::unique_ptr<Writer> writer_;
  std::vector<Input> inputs_;  ///< the trigger first
  std::vector<std::atomic<uint32_t>*> wakes_;
  bool loaned_ = false;
};

class Takt : public Medium {
 public:
  explicit Takt(const MediumPlan& plan) : plan_(plan) {
    if (plan.shape.nodes > kMaxNodes) throw CannotRun("a graph of more than " + std::to_string(kMaxNodes) + " nodes");
    void* memory = mmap(nullptr, sizeof(Doorbells), PROT_READ | PROT_WRITE, MAP_SHARED | MAP_ANONYMOUS, -1, 0);
    if (memory == MAP_FAILED) throw CannotRun("no shared memory");
    bells_ = ::new (memory) Doorbells;
  }
  ~Takt() override { munmap(bells_, sizeof(Doorbells)); }
  Takt(const Takt&) = delete;
  Takt& operator=(const Takt&) = delete;

 protected:
  std::vector<PortPlan> ports() const {
    std::vector<PortPlan> pools;
    for (size_t node = 0; node < plan_.shape.sink(); ++node)
      pools.push_back(pool_plan(plan_.id + std::to_string(node), plan_.bytes + kPoolGap,
                                static_cast<uint32_t>(plan_.shape.leaving(node).size())));
    return pools;
  }
  std::unique_ptr<Ends> open(size_t node, std::unique_ptr<Transport> transport, size_t first) {
    return std::make_unique<TaktEnds>(plan_.shape, node, std::move(transport), first, *bells_);
  }

 private:
  const MediumPlan plan_;
  Doorbells* bells_ = nullptr;
};

class TaktOverIceoryx final : public Takt {
 public:
  using Takt::Takt;
  std::vector<PortPlan> pools() const override { return ports(); }
  void served(std::span<const PortPlan> all, size_t first, const std::string& domain) override {
    all_.assign(all.begin(), all.end());
    first_ = first;
    domain_ = domain;
  }
  std::unique_ptr<Ends> open(size_t node) override {
    return Takt::open(node, join_iceoryx_transport(all_, domain_), first_);
  }

 private:
  std::vector<PortPlan> all_;
  size_t first_ = 0;
  std::string domain_;
};

class TaktLocal final : public Takt {
 public:
  explicit TaktLocal(const MediumPlan& plan) : Takt(plan), made_(make_local_transport(ports(), file_)) {}
  std::unique_ptr<Ends> open(size_t node) override { return Takt::open(node, join_local_transport(ports(), file_), 0); }

 private:
  const PoolFile file_;
  const std::unique_ptr<Transport> made_;
};

}  // namespace

PortPlan pool_plan(const std::string& name, uint32_t bytes, uint32_t readers) {
  const auto header = static_cast<uint32_t>((sizeof(Image) + 63) / 64 * 64);
  const uint32_t pixels = bytes - header;
  return {"bench", name, &MessageType::of<Image>(), {.width = pixels, .height = 1, .channels = 1}, 2, readers, readers};
}

std::unique_ptr<Medium> make_takt(const MediumPlan& plan) { return std::make_unique<TaktOverIceoryx>(plan); }

std::unique_ptr<Medium> make_takt_local(const MediumPlan& plan) { return std::make_unique<TaktLocal>(plan); }

}  // namespace takt::bench
