// SPDX-License-Identifier: Apache-2.0
// One commit per job, in all interleavings of a producer's steps and its readers' looks: whatever happens in between,
// every job of a reader latches the newest messages with visible_at <= its release, of both outputs of a producer, and
// a publication counts as late if its messages say so. In virtual time on one thread; with threads, processes and
// sleeps: tests/endurance/commits.cpp.
#include <doctest/doctest.h>

#include <algorithm>
#include <random>

#include "tests/property_scale.hpp"
#include "tests/unit/rt/commit_scene.hpp"

namespace {

using namespace takt;
using test::AtEveryStep, test::kMs, test::look_at, test::pair_plan, test::PairNode, test::PairReaders,
    test::SeenMessage;

constexpr int kPairJobs = 12;
constexpr size_t kLatched = 3;

/// A job that latches its two inputs at two instants.
struct LatchingJob {
  int64_t release_ns = 0;
  std::vector<SeenMessage> a, b;
};

class Interleaving {
 public:
  explicit Interleaving(std::mt19937& random)
      : random_(random),
        on_miss_(static_cast<OnMiss>(random() % 3)),
        plan_(pair_plan(node_, on_miss_, random() % 2 == 0 ? PublishAt::asap : PublishAt::let)),
        transport_(make_local_transport(plan_.ports)),
        board_(plan_),
        observer_(*transport_),
        task_(plan_, 0, *transport_, clock_, board_),
        busy_(static_cast<uint32_t>(1 + random() % 6)) {
    for (size_t i = 0; i < 3; ++i) readers_.push_back({PairReaders(*transport_, board_, clock_), {}, false});
    node_.work = [this] { clock_.advance_to(clock_.now_ns() + static_cast<int64_t>(random_() % 10) * kMs); };
    run();
    check();
  }
  uint64_t late() const { return late_; }
  uint64_t filled_by_readers() const { return filled_by_readers_; }
  size_t jobs() const { return jobs_.size(); }

 private:
  struct PairReader {
    PairReaders readers;
    LatchingJob job;
    bool at_work = false;
  };

  void run() {
    const AtEveryStep hook([this](MessageStep step, size_t) { between(step); });
    for (int k = 0; k < kPairJobs; ++k) {
      const int64_t release = std::max(clock_.now_ns(), test::kEpoch + k * 10 * kMs);
      clock_.advance_to(release);
      const JobEnd end = task_.run(static_cast<uint64_t>(k), release);
      task_.count(0);
      late_ += end.late;
      deadlines_.push_back(release + plan_.tasks[0].deadline_ns);
      for (PairReader& reader : readers_) go_on(reader);
      observe();
    }
    for (PairReader& reader : readers_)
      if (reader.at_work) go_on(reader);
  }

  /// The producer is preempted at a step; others look meanwhile.
  void between(MessageStep step) {
    if (is_of_reader(step)) return;
    clock_.advance_to(clock_.now_ns() + 1 + static_cast<int64_t>(random_() % busy_ == 0 ? random_() % (3 * kMs) : 0));
    const int64_t before = clock_.now_ns();
    for (PairReader& reader : readers_) {
      if (random_() % busy_ != 0) continue;
      go_on(reader);
      // Time passes between a look and the commit that follows it.
      clock_.advance_to(clock_.now_ns() + 1 + static_cast<int64_t>(random_() % 1'000));
    }
    filled_by_readers_ += step == MessageStep::inside_commit && clock_.now_ns() > before + 1;
    if (random_() % busy_ == 0) {
      look_at(*readers_[0].readers.a, clock_.now_ns() + kMs);  // a rehearsal for a release to come
      observe();
    }
  }

  void go_on(PairReader& reader) {
    if (!reader.at_work) {
      // It may start late, and has not looked before its release.
      const int64_t since = std::max(clock_.now_ns() - 15 * kMs, reader.job.release_ns);
      reader.job = {};
      reader.job.release_ns =
          since + static_cast<int64_t>(random_()) % std::max<int64_t>(1, clock_.now_ns() - since + 1);
      reader.job.a = look_at(*reader.readers.a, reader.job.release_ns, kLatched);
    } else {
      reader.job.b = look_at(*reader.readers.b, reader.job.release_ns, kLatched);
      jobs_.push_back(reader.job);
    }
    reader.at_work = !reader.at_work;
  }

  /// All that has come out so far, from settled slots.
  void observe() {
    for (auto [reader, all] : {std::pair(observer_.a.get(), &truth_a_), std::pair(observer_.b.get(), &truth_b_)}) {
      std::vector<SeenMessage> seen = look_at(*reader, CommitRing::kNever);
      for (size_t i = seen.size(); i-- > 0;)
        if (all->empty() || seen[i].sequence > all->back().sequence) all->push_back(seen[i]);
    }
  }

  static std::vector<SeenMessage> by_the_rule(const std::vector<SeenMessage>& all, int64_t release_ns) {
    std::vector<SeenMessage> newest;
    for (size_t i = all.size(); i-- > 0 && newest.size() < kLatched;)
      if (all[i].visible_at_ns <= release_ns) newest.push_back(all[i]);
    return newest;
  }

  void check() const {
    REQUIRE(truth_a_ == truth_b_);  // together or not at all
    for (size_t i = 0; i < truth_a_.size(); ++i) REQUIRE(truth_a_[i].sequence == i + 1);
    for (const LatchingJob& job : jobs_) {
      CAPTURE(job.release_ns);
      REQUIRE(job.a == by_the_rule(truth_a_, job.release_ns));
      REQUIRE(job.b == by_the_rule(truth_b_, job.release_ns));
    }
    const TaskStatistics& counts = task_.statistics();
    uint64_t late = 0, repeated = 0;
    int64_t newest = -1;
    for (const SeenMessage& message : truth_a_) {
      const bool again = message.job == newest;
      newest = message.job;
      repeated += again;
      const bool after_deadline = message.visible_at_ns > deadlines_[static_cast<size_t>(message.job)];
      late += after_deadline && !again;
    }
    REQUIRE(counts.deadline_misses.load() == late_);
    if (on_miss_ == OnMiss::proceed) {
      REQUIRE(late == late_);
      REQUIRE(truth_a_.size() == static_cast<size_t>(kPairJobs));
    } else {
      REQUIRE(late == 0);  // what is late is withheld
      REQUIRE(truth_a_.size() - repeated == static_cast<size_t>(kPairJobs) - late_);
    }
    REQUIRE(board_.excesses().size() == 0);
  }

  std::mt19937& random_;
  VirtualClock clock_{test::kEpoch};
  PairNode node_;
  const OnMiss on_miss_;
  const Plan plan_;
  const std::unique_ptr<Transport> transport_;
  RunBoard board_;
  const PairReaders observer_;
  Task task_;
  const uint32_t busy_;
  std::vector<PairReader> readers_;
  std::vector<LatchingJob> jobs_;
  std::vector<int64_t> deadlines_;
  std::vector<SeenMessage> truth_a_, truth_b_;
  uint64_t late_ = 0, filled_by_readers_ = 0;
};

}  // namespace

TEST_CASE("the outputs of a job are latched together and by the rule, whoever looks at which of its steps") {
  std::mt19937 random(static_cast<uint32_t>(test::seed(41)));
  uint64_t late = 0, filled = 0, jobs = 0;
  for (int round = 0; round < test::rounds(3'000); ++round) {
    CAPTURE(round);
    const Interleaving interleaving(random);
    late += interleaving.late();
    filled += interleaving.filled_by_readers();
    jobs += interleaving.jobs();
  }
  MESSAGE(jobs << " jobs, " << late << " late publications, looks within " << filled << " commits");
  CHECK(late >= test::at_scale(5'000));
  CHECK(filled >= test::at_scale(5'000));
}
