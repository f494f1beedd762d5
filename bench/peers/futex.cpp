// SPDX-License-Identifier: Apache-2.0
// The floor: each node sleeps on a word of its own, its producer counts it up and wakes it. Nothing is carried.
#include "bench/futex.hpp"

#include <deque>

#include "bench/peers/medium.hpp"

namespace takt::bench {
namespace {

struct alignas(64) Word {
  std::atomic<uint32_t> count{0};
};

class FutexEnds final : public Ends {
 public:
  FutexEnds(const GraphShape& shape, size_t node, std::deque<Word>& words) : bell_(words[node].count) {
    // words[node]: what wakes a node; words[nodes + edge]: what a side edge has brought
    for (size_t i = 0; i < shape.edges.size(); ++i) {
      const GraphEdge& edge = shape.edges[i];
      std::atomic<uint32_t>& word = words[edge.trigger ? edge.to : shape.nodes + i].count;
      if (edge.from == node) (edge.trigger ? wakes_ : counts_).push_back(&word);
      if (edge.to == node && !edge.trigger) sides_.push_back({&word, 0});
    }
  }
  bool wait() override { return bell_.wait(kPatienceNs); }
  size_t take_sides() override {
    size_t fresh = 0;
    for (Side& side : sides_) {
      const uint32_t now = side.word->load(std::memory_order_acquire);
      fresh += now != side.seen;
      side.seen = now;
    }
    return fresh;
  }
  void publish() override {
    for (std::atomic<uint32_t>* word : counts_) word->fetch_add(1, std::memory_order_release);
    for (std::atomic<uint32_t>* word : wakes_) wake(*word);
  }

 private:
  struct Side {
    std::atomic<uint32_t>* word;
    uint32_t seen;
  };
  Bell bell_;
  std::vector<std::atomic<uint32_t>*> wakes_, counts_;
  std::vector<Side> sides_;
};

class Futex final : public Medium {
 public:
  explicit Futex(const MediumPlan& plan) : shape_(plan.shape), words_(shape_.nodes + shape_.edges.size()) {}
  std::unique_ptr<Ends> open(size_t node) override { return std::make_unique<FutexEnds>(shape_, node, words_); }

 private:
  const GraphShape shape_;
  std::deque<Word> words_;
};

}  // namespace

std::unique_ptr<Medium> make_futex(const MediumPlan& plan) { return std::make_unique<Futex>(plan); }

}  // namespace takt::bench
