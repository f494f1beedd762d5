// SPDX-License-Identifier: Apache-2.0
// A process that is killed at every step of a message's life: what it held comes back, what it had published stays
// whole, and the one that takes its place goes on where it was.
#include <doctest/doctest.h>
#include <sys/mman.h>
#include <sys/wait.h>
#include <unistd.h>

#include <csignal>
#include <functional>
#include <set>

#include "commit_scene.hpp"
#include "rt/msg/image.hpp"
#include "rt/shm/kill_order.hpp"
#include "rt/shm/local_transport.hpp"
#include "transport_conformance.hpp"

using namespace takt;
using namespace takt::test;

namespace {

constexpr uint32_t kSelf = 1, kVictim = 2;
constexpr int kRepeats = 50;
constexpr size_t kPort = stress;  // keeps 3, two readers

/// What both processes see: the order, and how far the victim came.
struct KillScene {
  KillOrder order;
  std::atomic<uint64_t> published{0};
};

class Stage {
 public:
  Stage() : scene_(new (map()) KillScene), transport_(make_local_transport(conformance_ports(), file_, kSelf)) {}
  ~Stage() { munmap(scene_, sizeof(KillScene)); }
  Stage(const Stage&) = delete;
  Stage& operator=(const Stage&) = delete;

  KillScene& scene() { return *scene_; }
  Transport& transport() { return *transport_; }

  /// Runs `body` in a process that obeys the order; true if the order ended it.
  bool perform(MessageStep step, uint32_t passes, const std::function<void(Transport&, KillScene&)>& body) {
    scene_->order.port.store(kPort);
    scene_->order.passes.store(passes);
    scene_->order.step.store(step);
    const pid_t child = fork();
    REQUIRE(child >= 0);
    if (child == 0) {
      obey_orders(&scene_->order);
      try {
        body(*join_local_transport(conformance_ports(), file_, kVictim), *scene_);
      } catch (...) {  // else the child would go on with the tests
      }
      _exit(0);
    }
    int status = 0;
    REQUIRE(waitpid(child, &status, 0) == child);
    return WIFSIGNALED(status) && WTERMSIG(status) == SIGKILL;
  }

 private:
  static void* map() {
    void* memory = mmap(nullptr, sizeof(KillScene), PROT_READ | PROT_WRITE, MAP_SHARED | MAP_ANONYMOUS, -1, 0);
    REQUIRE(memory != MAP_FAILED);
    return memory;
  }
  PoolFile file_;
  KillScene* scene_;
  std::unique_ptr<Transport> transport_;
};

/// As publish(), for a process whose checks nobody counts.
void publish_plainly(Writer& writer, uint64_t value) {
  MessageHeader* header = writer.loan();
  if (header == nullptr) _exit(9);
  auto* image = reinterpret_cast<Image*>(header + 1);
  image->width = static_cast<int32_t>(value);
  image->pixels.resize(image->pixels.capacity);
  std::memset(image->pixels.data(), static_cast<int>(value & 0xff), image->pixels.size);
  writer.publish(static_cast<int64_t>(value), static_cast<int64_t>(value), 0);
}

void publish_six(Transport& transport, KillScene& scene) {
  const auto writer = transport.make_writer(kPort);
  for (int i = 0; i < 6; ++i) {
    publish_plainly(*writer, scene.published.load() + 1);
    scene.published.fetch_add(1);
  }
}

/// Every message that can be taken, as value by sequence; all of them whole, each value once.
std::vector<Candidate> check_all_whole(Reader& reader) {
  const std::vector<Candidate> candidates = listed(reader, kEver);
  std::set<int32_t> values;
  for (const Candidate& candidate : candidates) {
    Held held = reader.take(candidate.sequence);
    REQUIRE(held);
    const auto value = static_cast<const Image*>(held.message())->width;
    CHECK_MESSAGE(intact(held, static_cast<uint64_t>(value)), "torn");
    CHECK_MESSAGE(held.stamp_ns == value, "an old message as a new one");
    CHECK(values.insert(value).second);
    reader.release(held);
  }
  return candidates;
}

void kill_writer(MessageStep step, uint32_t passes) {
  Stage stage;
  const auto reader = stage.transport().make_reader(kPort);
  for (int generation = 0; generation < 3; ++generation) {
    CAPTURE(generation);
    REQUIRE(stage.perform(step, passes, publish_six));
    check_all_whole(*reader);  // while nobody has cleared up yet
    stage.transport().reclaim(kVictim);
    const auto candidates = check_all_whole(*reader);
    // Every message that was certainly out can be found, up to what the output keeps.
    const uint64_t certain = stage.scene().published.load();
    CHECK(candidates.size() >= std::min<uint64_t>(certain, conformance_ports()[kPort].history - 1));
    CHECK_MESSAGE(stage.transport().chunks_in_use() == candidates.size(), "a chunk nobody has");
    if (!candidates.empty()) stage.scene().published.store(static_cast<uint64_t>(candidates[0].stamp_ns));
  }
}

void read_all(Transport& transport, KillScene& scene) {
  const auto reader = transport.make_reader(kPort);
  scene.published.fetch_add(1);
  for (int round = 0; round < 3; ++round)
    for (const Candidate& candidate : listed(*reader, kEver)) {
      Held held = reader->take(candidate.sequence);
      reader->release(held);
    }
}

void kill_reader(MessageStep step, uint32_t passes) {
  Stage stage;
  const auto writer = stage.transport().make_writer(kPort);
  const auto reader = stage.transport().make_reader(kPort);
  for (uint64_t value = 1; value <= 3; ++value) publish(*writer, value, static_cast<int64_t>(value), 0);
  Held mine = reader->take(3);
  REQUIRE(mine);
  REQUIRE(stage.perform(step, passes, read_all));
  for (uint64_t value = 4; value <= 6; ++value)  // nobody waits for the dead
    publish(*writer, value, static_cast<int64_t>(value), 0);
  CHECK_MESSAGE(intact(mine, 3), "taken from one who lives");
  stage.transport().reclaim(kVictim);
  CHECK(intact(mine, 3));
  CHECK(stage.transport().chunks_in_use() == 4);  // three kept, one held here
  reader->release(mine);
  CHECK(stage.transport().chunks_in_use() == 3);
  check_all_whole(*reader);
  CHECK(writer->statistics().pool_empty == 0);
}

}  // namespace

TEST_CASE("a writer killed at any step leaves whole messages and no chunk taken; the next one goes on") {
  for (const MessageStep step : {MessageStep::inside_loan, MessageStep::after_loan, MessageStep::half_written,
                                 MessageStep::inside_publish, MessageStep::after_publish}) {
    const auto name = std::string(to_string(step));
    CAPTURE(name);
    for (int i = 0; i < kRepeats; ++i) kill_writer(step, static_cast<uint32_t>(i % 6));
  }
}

TEST_CASE("a reader killed at any step takes nothing along, neither from the writer nor from another reader") {
  for (const MessageStep step : {MessageStep::inside_take, MessageStep::while_held, MessageStep::inside_release}) {
    const auto name = std::string(to_string(step));
    CAPTURE(name);
    for (int i = 0; i < kRepeats; ++i) kill_reader(step, static_cast<uint32_t>(i % 6));
  }
}

TEST_CASE("a killed process that nobody clears up after keeps what it held, and nothing more") {
  Stage stage;
  REQUIRE(stage.perform(MessageStep::after_loan, 0, publish_six));
  CHECK(stage.transport().chunks_in_use() == 1);
  CHECK(stage.transport().reclaim(kVictim + 1) == 0);
  CHECK(stage.transport().reclaim(kVictim) == 1);
  CHECK(stage.transport().chunks_in_use() == 0);
}

namespace {

/// The pair's task in a process of its own (commit_scene.hpp), job by job, over pools and a board that outlive it.
class PairStage {
 public:
  PairStage() : plan_(pair_plan(node_)), board_(plan_), transport_(make_local_transport(plan_.ports, file_, kSelf)) {}

  Transport& transport() { return *transport_; }
  RunBoard& board() { return board_; }
  const Clock& clock() const { return clock_; }
  const Plan& plan() const { return plan_; }

  /// Runs jobs in a process that dies when it comes to that step of that output; true if it did.
  bool die_at(MessageStep step, size_t port, uint32_t passes) {
    KillOrder& order = board_.process(0).kill;
    order.port.store(static_cast<uint32_t>(port));
    order.passes.store(passes);
    order.step.store(step);
    const pid_t child = fork();
    REQUIRE(child >= 0);
    if (child == 0) {
      obey_orders(&order);
      try {
        const auto joined = join_local_transport(plan_.ports, file_, kVictim);
        run(*joined, 8);
      } catch (...) {  // else the child would go on with the tests
      }
      _exit(0);
    }
    int status = 0;
    REQUIRE(waitpid(child, &status, 0) == child);
    transport_->reclaim(kVictim);
    return WIFSIGNALED(status) && WTERMSIG(status) == SIGKILL;
  }

  void run(Transport& transport, uint64_t jobs) {
    Task task(plan_, 0, transport, clock_, board_);
    for (uint64_t n = 0; n < jobs; ++n) {
      task.run(board_.task(0).completed.load(), clock_.now_ns());
      task.count(0);
    }
  }

 private:
  MonotonicClock clock_;
  PairNode node_;
  Plan plan_;
  RunBoard board_;
  PoolFile file_;
  std::unique_ptr<Transport> transport_;
};

}  // namespace

TEST_CASE("whatever step a process dies at, both outputs of a job are out or none is, before and after its successor") {
  for (const MessageStep step : {MessageStep::after_loan, MessageStep::half_written, MessageStep::inside_publish,
                                 MessageStep::after_publish, MessageStep::inside_commit, MessageStep::after_commit})
    for (const size_t port : {size_t{0}, size_t{1}})
      for (uint32_t passes = 0; passes < 8; ++passes) {
        const auto name = std::string(to_string(step));
        CAPTURE(name);
        CAPTURE(port);
        CAPTURE(passes);
        PairStage stage;
        const PairReaders job(stage.transport(), stage.board(), stage.clock()), observer(stage.transport());
        for (int generation = 0; generation < 2; ++generation) {
          CAPTURE(generation);
          REQUIRE(stage.die_at(step, port, passes));
          // Nobody has settled yet what it left.
          int64_t now = stage.clock().now_ns();
          CHECK(look_at(*job.a, now) == look_at(*job.b, now));
          now = stage.clock().now_ns();
          CHECK(look_at(*job.a, now) == look_at(*job.b, now));
        }
        PairNode node;
        Plan plan = pair_plan(node);
        const Task successor(plan, 0, stage.transport(), stage.clock(), stage.board());
        const int64_t now = stage.clock().now_ns();
        const std::vector<SeenMessage> left = look_at(*job.a, now);
        CHECK(left == look_at(*job.b, now));
        CHECK_MESSAGE(left == look_at(*observer.a, CommitRing::kNever), "visible to jobs and not settled");
        CHECK(left == look_at(*observer.b, CommitRing::kNever));
        for (size_t i = 0; i < left.size(); ++i) CHECK(left[i].sequence == left[0].sequence - i);
        CHECK_MESSAGE(stage.transport().chunks_in_use() == 2 * left.size(), "a chunk nobody has");
        CHECK(stage.board().commits(0).spoiled() == 0);
      }
}

TEST_CASE("steps have names") {
  for (size_t i = 1; i < kMessageSteps; ++i)
    CHECK(message_step(to_string(static_cast<MessageStep>(i))) == static_cast<MessageStep>(i));
  CHECK_FALSE(message_step("none"));
  CHECK_FALSE(message_step("after_lunch"));
}
