// SPDX-License-Identifier: Apache-2.0
// The commit word alone, then a task that commits over the local transport while readers look at every step.
#include "rt/shm/commit_ring.hpp"

#include <doctest/doctest.h>

#include "commit_scene.hpp"

namespace {

using namespace takt;
using namespace takt::test;

constexpr int64_t kFar = CommitRing::kNever;

/// Calls `before` whenever it is read.
struct InterruptedClock final : Clock {
  int64_t ns = 100;
  std::function<void()> before = [] {};
  int64_t now_ns() const override { return before(), ns; }
  bool is_virtual() const override { return true; }
};

/// Where the word of a commit lies, for stray stores.
std::atomic<uint64_t>& word_of_commit(CommitRing& ring, uint32_t commit) {
  auto* words = reinterpret_cast<std::byte*>(&ring) + 64;
  return *reinterpret_cast<std::atomic<uint64_t>*>(words + commit % CommitRing::kWords * 24);
}

uint32_t opened(CommitRing& ring, const CommitRing::Terms& terms) {
  const uint32_t commit = ring.open(terms);
  ring.announced(commit);
  return commit;
}

}  // namespace

TEST_CASE("a commit that nobody is faster with is visible at its publication, or at its earliest instant, or never") {
  CommitRing ring;
  const VirtualClock clock(100);
  struct Expected {
    CommitRing::Terms terms;
    int64_t visible_ns, published_ns;
  };
  for (const auto& [terms, visible, published] :
       {Expected{{}, 100, 100}, Expected{{150, kFar}, 150, 100}, Expected{{50, kFar}, 100, 100},
        Expected{{0, 100}, 100, 100}, Expected{{0, 99}, kFar, 100}, Expected{{99, 99}, kFar, 100}}) {
    CAPTURE(terms.earliest_ns);
    CAPTURE(terms.latest_ns);
    const CommitRing::Filled out = ring.fill(opened(ring, terms), 100, clock);
    CHECK(out.visible_at_ns == visible);
    CHECK(out.published_ns == published);
  }
}

TEST_CASE("a reader that finds the word open fills it with an instant after its release, which holds for all") {
  struct Expected {
    CommitRing::Terms terms;
    int64_t visible_ns, published_ns;
  };
  for (const auto& [terms, visible, published] :
       {Expected{{}, 130, 130}, Expected{{120, kFar}, 130, 130}, Expected{{0, 125}, kFar, 126},
        Expected{{110, 110}, kFar, 111}, Expected{{0, 130}, 130, 130}}) {
    CAPTURE(terms.earliest_ns);
    CAPTURE(terms.latest_ns);
    CommitRing ring;
    VirtualClock clock(100);
    const uint32_t commit = opened(ring, terms);
    const int64_t mine_ns = clock.now_ns();  // and then the producer is preempted
    clock.advance_to(130);
    CHECK(ring.look(commit, 120, clock) == visible);
    clock.advance_to(140);
    CHECK(ring.look(commit, 140, clock) == visible);
    const CommitRing::Filled out = ring.fill(commit, mine_ns, clock);
    CHECK(out.visible_at_ns == visible);
    CHECK(out.published_ns == published);
    CHECK(ring.spoiled() == 0);
  }
}

TEST_CASE("a reader whose clock stands at its release fills with the instant after it") {
  CommitRing ring;
  const VirtualClock clock(100);
  const uint32_t commit = opened(ring, {});
  CHECK(ring.look(commit, 100, clock) == 101);
  CHECK(ring.fill(commit, 100, clock).visible_at_ns == 101);
}

TEST_CASE("who comes while outputs are announced, before the earliest instant, or ahead of the clock fills nothing") {
  CommitRing ring;
  const VirtualClock clock(100);
  const uint32_t announcing = ring.open({});
  CHECK(ring.look(announcing, 90, clock) == kFar);
  ring.announced(announcing);
  CHECK(ring.look(announcing, 101, clock) == kFar);
  CHECK(ring.look(announcing, kFar, clock) == kFar);
  CHECK(ring.fill(announcing, 95, clock).visible_at_ns == 95);
  const uint32_t let = opened(ring, {150, kFar});
  CHECK(ring.look(let, 100, clock) == kFar);
  CHECK(ring.fill(let, 100, clock).visible_at_ns == 150);
}

TEST_CASE("words are used again, and numbers too: 0 is none of them") {
  CommitRing ring(UINT32_MAX - 20);
  const VirtualClock clock(1'000);
  for (int64_t k = 1; k <= 40; ++k) {
    const uint32_t commit = ring.open({});
    CHECK(commit != 0);
    CHECK(ring.look(commit, 900, clock) == kFar);
    ring.announced(commit);
    CHECK(ring.fill(commit, k, clock).visible_at_ns == k);
    CHECK(ring.look(commit, 900, clock) == k);
  }
  CHECK(ring.spoiled() == 0);
}

TEST_CASE("a reader that is slower than the whole ring changes nothing") {
  CommitRing ring;
  InterruptedClock clock;
  const uint32_t commit = opened(ring, {});
  uint32_t later = 0;
  clock.before = [&] {  // between the reader's look at the word and its attempt to fill it
    if (later != 0) return;
    later = 1;
    ring.fill(commit, 100, clock);
    for (uint32_t i = 0; i < CommitRing::kWords - 1; ++i) ring.fill(opened(ring, {}), 100, clock);
    later = opened(ring, {});
  };
  ring.look(commit, 100, clock);  // means nothing, since the slot names no commit any more
  REQUIRE(later % CommitRing::kWords == commit % CommitRing::kWords);
  CHECK(ring.fill(later, 100, clock).visible_at_ns == 100);
  CHECK(ring.spoiled() == 0);
}

TEST_CASE("a word that nobody can have written is no instant: told, and put right by its producer") {
  for (const uint64_t stray : {uint64_t{0}, uint64_t{5}, uint64_t{1} << 40, uint64_t{0xDEADBEEFDEADBEEF}, ~uint64_t{0},
                               static_cast<uint64_t>(kFar)}) {
    CAPTURE(stray);
    CommitRing ring;
    const VirtualClock clock(1'000);
    const uint32_t commit = opened(ring, {10, kFar});
    word_of_commit(ring, commit).store(stray);
    CHECK(ring.look(commit, 900, clock) == CommitRing::kSpoiled);
    CHECK(ring.fill(commit, 1'000, clock).visible_at_ns == 1'000);
    CHECK(ring.spoiled() == 1);
    CHECK(ring.look(commit, 1'000, clock) == 1'000);
  }
}

TEST_CASE("a successor fills what was announced to the end, withholds what was not, and keeps what was filled") {
  const VirtualClock clock(500);
  CommitRing fresh;
  CHECK(fresh.recover(clock).visible_at_ns == kFar);
  CommitRing ring;
  ring.open({});
  CHECK(ring.recover(clock).visible_at_ns == kFar);
  CHECK(ring.recover(clock).visible_at_ns == kFar);  // one that died on its way back
  CHECK(ring.look(1, 500, clock) == kFar);
  opened(ring, {});
  CHECK(ring.recover(clock).visible_at_ns == 500);
  opened(ring, {0, 400});
  CHECK(ring.recover(clock).visible_at_ns == kFar);
  ring.fill(opened(ring, {}), 450, clock);
  CHECK(ring.recover(clock).visible_at_ns == 450);
  CHECK(ring.open({}) == 5);
  CHECK(ring.spoiled() == 0);
}

namespace {

/// One job of the pair's task, in virtual time.
struct CommitScene {
  VirtualClock clock{kEpoch};
  PairNode node;
  Plan plan;
  std::unique_ptr<Transport> transport;
  RunBoard board;
  std::unique_ptr<Task> task;
  uint64_t jobs = 0;

  explicit CommitScene(OnMiss on_miss = OnMiss::proceed, PublishAt publish = PublishAt::asap)
      : plan(pair_plan(node, on_miss, publish)), transport(make_local_transport(plan.ports)), board(plan) {
    task = std::make_unique<Task>(plan, 0, *transport, clock, board);
  }
  static int64_t release(uint64_t job) { return kEpoch + static_cast<int64_t>(job) * 10 * kMs; }
  JobEnd run() {
    clock.advance_to(release(jobs));
    const JobEnd end = task->run(jobs, release(jobs));
    task->count(0);
    ++jobs;
    return end;
  }
  TaskStatistics& counts() { return task->statistics(); }
};

/// Lets the clock come to `ns` when the pair passes a step of its second output for the first time.
AtEveryStep::Hook delay_at(MessageStep when, VirtualClock& clock, int64_t ns) {
  return [=, &clock](MessageStep step, size_t port) {
    if (step == when && port == 1) clock.advance_to(ns);
  };
}

}  // namespace

TEST_CASE("both outputs of a job are visible from the instant that was read after the last was in place") {
  CommitScene scene;
  const PairReaders job(*scene.transport, scene.board, scene.clock), observer(*scene.transport);
  const AtEveryStep hook(delay_at(MessageStep::after_publish, scene.clock, kEpoch + kMs));
  const JobEnd end = scene.run();
  CHECK(end.visible_at_ns == kEpoch + kMs);
  CHECK(look_at(*job.a, kEpoch + kMs - 1).empty());
  CHECK(look_at(*job.b, kEpoch + kMs - 1).empty());
  for (const PairReaders* readers : {&job, &observer}) {
    CHECK(look_at(*readers->a, kEpoch + kMs) == std::vector<SeenMessage>{{1, 0, kEpoch + kMs}});
    CHECK(look_at(*readers->b, kEpoch + kMs) == std::vector<SeenMessage>{{1, 0, kEpoch + kMs}});
  }
  CHECK(scene.counts().response.max_ns() == kMs);
}

TEST_CASE("what an observer sees is settled: it waits for that, and changes nothing") {
  CommitScene scene;
  const PairReaders observer(*scene.transport);
  size_t seen = 0;
  const AtEveryStep hook([&](MessageStep step, size_t) {
    if (is_of_reader(step)) return;
    scene.clock.advance_to(scene.clock.now_ns() + 10);
    seen += look_at(*observer.a, kFar).size();
    scene.clock.advance_to(scene.clock.now_ns() + 10);
  });
  scene.run();
  CHECK(seen == 1);  // at the last step, when the second output is about to be settled
  CHECK(look_at(*observer.b, kFar).size() == 1);
}

TEST_CASE("a publication that comes late only at its commit is a miss, and what on_miss says of one") {
  for (const OnMiss on_miss : {OnMiss::proceed, OnMiss::skip, OnMiss::reuse_last})
    for (const PublishAt publish : {PublishAt::asap, PublishAt::let})
      for (const MessageStep late : {MessageStep::after_publish, MessageStep::inside_commit}) {
        CAPTURE(static_cast<int>(on_miss));
        CAPTURE(static_cast<int>(publish));
        CAPTURE(static_cast<int>(late));
        CommitScene scene(on_miss, publish);
        const PairReaders job(*scene.transport, scene.board, scene.clock);
        scene.run();
        const int64_t deadline = CommitScene::release(1) + 8 * kMs, published = deadline + 1;
        {
          const AtEveryStep hook(delay_at(late, scene.clock, published));
          CHECK(scene.run().late);
        }
        CHECK(scene.counts().deadline_misses.load() == 1);
        CHECK(scene.counts().completed.load() == (on_miss == OnMiss::proceed ? 2 : 1));
        CHECK(scene.counts().skipped.load() == (on_miss == OnMiss::skip ? 1 : 0));
        CHECK(scene.counts().reused.load() == (on_miss == OnMiss::reuse_last ? 1 : 0));
        CHECK(scene.counts().response.max_ns() == published - CommitScene::release(1));
        for (Reader* reader : {job.a.get(), job.b.get()}) {
          const std::vector<SeenMessage> seen = look_at(*reader, published);
          if (on_miss == OnMiss::skip) {
            CHECK(seen.size() == 1);
            continue;
          }
          REQUIRE(seen.size() == 2);
          CHECK(seen[0] == SeenMessage{2, on_miss == OnMiss::proceed ? 1 : 0, published});
        }
        // The next message follows without a gap, and nothing of the withheld one is left taken.
        CHECK_FALSE(scene.run().late);
        CHECK(look_at(*job.a, kFar - 1)[0].sequence == (on_miss == OnMiss::skip ? 2 : 3));
        CHECK(scene.task->writer(0).statistics().sent == (on_miss == OnMiss::skip ? 2 : 3));
        CHECK(scene.transport->chunks_in_use() == (on_miss == OnMiss::proceed ? 6 : 4));
      }
}

TEST_CASE("a reader that came between the producer's clock and its word puts the messages after its release") {
  CommitScene scene;
  const PairReaders job(*scene.transport, scene.board, scene.clock), other(*scene.transport, scene.board, scene.clock);
  int passes = 0;
  int64_t looked_ns = 0;
  {
    const AtEveryStep hook([&](MessageStep step, size_t port) {
      if (step != MessageStep::inside_commit || port != 1 || ++passes != 2) return;
      looked_ns = kEpoch + 3 * kMs;
      scene.clock.advance_to(looked_ns);
      CHECK(look_at(*job.a, kEpoch + 2 * kMs).empty());
    });
    CHECK(scene.run().visible_at_ns == looked_ns);
  }
  CHECK(look_at(*job.b, kEpoch + 2 * kMs).empty());
  CHECK(look_at(*other.b, looked_ns).size() == 1);
  CHECK(scene.counts().response.max_ns() == 3 * kMs);
}

TEST_CASE("a stray store into the commit word is a fault of the run, named") {
  CommitScene scene;
  const PairReaders job(*scene.transport, scene.board, scene.clock);
  {
    int passes = 0;
    const AtEveryStep hook([&](MessageStep step, size_t port) {
      if (step != MessageStep::inside_commit || port != 1 || ++passes != 2) return;
      word_of_commit(scene.board.commits(0), 1).store(0x4141414141414141);
      CHECK(look_at(*job.a, kEpoch).empty());
    });
    scene.run();
  }
  CHECK(look_at(*job.a, kEpoch).size() == 1);
  REQUIRE(scene.board.faults().size() == 1);
  CHECK(scene.board.faults().at(0)->kind == Fault::spoiled);
  CHECK(std::string(scene.board.faults().at(0)->what.text()).find("pair:") == 0);
  scene.run();
  CHECK(scene.board.faults().size() == 1);
}
