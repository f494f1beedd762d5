// SPDX-License-Identifier: Apache-2.0
// What a record says is predicted again from it; another computer, other cores and other schedules change what they
// must.
#include "graph/what_if/what_if.hpp"

#include "graph/log/cut_log.hpp"
#include "graph/run/job_durations.hpp"
#include "recorded_scene.hpp"

using namespace takt;
using namespace takt::what_if;
using test::all_take;
using test::kMs;
using test::Scene;

namespace {

using Buckets = std::vector<std::pair<int64_t, uint64_t>>;

Buckets buckets(const Histogram& histogram) {
  Buckets all{{histogram.sum_ns(), histogram.count()}, {histogram.max_ns(), 0}};
  histogram.for_each([&](int64_t edge, uint64_t count) { all.emplace_back(edge, count); });
  return all;
}

void check_same_task(const TaskStatistics& was, const TaskStatistics& is) {
  CHECK(is.completed == was.completed);
  CHECK(is.skipped == was.skipped);
  CHECK(is.reused == was.reused);
  CHECK(is.paused == was.paused);
  CHECK(is.released == was.released);
  CHECK(is.deadline_misses == was.deadline_misses);
  CHECK(is.budget_overruns == was.budget_overruns);
  CHECK(is.stale_inputs == was.stale_inputs);
  CHECK(is.new_inputs == was.new_inputs);
  CHECK(is.preempted_ns == was.preempted_ns);
  for (size_t level = 0; level < kMaxLevels; ++level) CHECK(is.at_level[level] == was.at_level[level]);
  CHECK(buckets(is.lateness) == buckets(was.lateness));
  CHECK(buckets(is.exec) == buckets(was.exec));
  CHECK(buckets(is.response) == buckets(was.response));
}

/// The run, and what is predicted of it.
void check_same(const Plan& plan, const RunBoard& was, const RunBoard& is) {
  for (size_t t = 0; t < plan.tasks.size(); ++t) {
    CAPTURE(plan.tasks[t].name);
    check_same_task(was.task(t), is.task(t));
    for (size_t e = 0; e < plan.tasks[t].edges.size(); ++e) {
      CAPTURE(e);
      CHECK(is.edge(t, e).received == was.edge(t, e).received);
      CHECK(is.edge(t, e).dropped == was.edge(t, e).dropped);
      CHECK(is.edge(t, e).stale == was.edge(t, e).stale);
      CHECK(buckets(is.edge(t, e).age) == buckets(was.edge(t, e).age));
    }
  }
  for (size_t p = 0; p < plan.ports.size(); ++p) CHECK(buckets(is.port(p).age) == buckets(was.port(p).age));
  CHECK(is.modes().size() == was.modes().size());
}

/// The run, and what its record is read as.
void check_read(const Plan& plan, const RunBoard& was, const RecordedRun& read) {
  for (size_t t = 0; t < plan.tasks.size(); ++t) {
    CAPTURE(plan.tasks[t].name);
    const RecordedFigures& figures = read.figures[t];
    CHECK(figures.jobs == was.task(t).exec.count());
    CHECK(figures.deadline_misses == was.task(t).deadline_misses);
    CHECK(buckets(figures.response) == buckets(was.task(t).response));
    CHECK(buckets(figures.exec) == buckets(was.task(t).exec));
    CHECK(buckets(figures.output_age[0]) == buckets(was.port(t).age));
    for (size_t e = 0; e < plan.tasks[t].edges.size(); ++e)
      if (plan.tasks[t].node->inputs()[plan.tasks[t].edges[e].input] != plan.tasks[t].node->control())
        CHECK(buckets(figures.edge_age[e]) == buckets(was.edge(t, e).age));
  }
}

struct Predicted {
  RecordedRun recorded;
  RunBoard board;
  Prediction prediction;
  Predicted(const test::RecordedScene& record, const Plan& plan, double speed = 1)
      : recorded(record.read(plan)), board(plan), prediction(predict(plan, recorded, {.speed = speed}, board)) {}
  const TaskStatistics& task(size_t t) const { return board.task(t); }
};

/// A schedule that only chance has chosen, overload included.
void draw(Scene& scene, std::mt19937& random) {
  const auto any = [&](auto... choices) {
    const std::array all{choices...};
    return all[random() % all.size()];
  };
  Plan& plan = scene.plan;
  plan.policy = any(Policy::deadline, Policy::fixed, Policy::cooperative);
  plan.cores = any(1, 2, 3) == 1 ? std::vector{0} : std::vector{0, 1};
  scene.relay.oldest = any(true, false);
  scene.relay.only_new = any(true, false);
  for (TaskPlan& task : plan.tasks) {
    if (task.rate) task.rate = any(Rate{5, 1}, Rate{7, 1}, Rate{10, 1}, Rate{15, 1});
    task.offset_ns = static_cast<int64_t>(random() % 40) * kMs;
    task.deadline_ns = static_cast<int64_t>(20 + random() % 60) * kMs;
    task.budget_ns = static_cast<int64_t>(5 + random() % 15) * kMs;
    task.criticality = any(Criticality::low, Criticality::high);
    task.on_miss = any(OnMiss::proceed, OnMiss::skip, OnMiss::reuse_last);
    task.on_overrun = any(OnOverrun::proceed, OnOverrun::degrade);
    task.publish = any(PublishAt::asap, PublishAt::asap, PublishAt::let);
  }
  plan.tasks[Scene::kFollower].every = any(1, 1, 2);
}

}  // namespace

TEST_CASE("The same schedule, cores and speed: every figure of a virtual run is predicted from its record") {
  uint64_t misses = 0, overruns = 0, degraded = 0;
  for (uint32_t seed = 0; seed < 60; ++seed) {
    CAPTURE(seed);
    std::mt19937 random(seed);
    Scene scene;
    draw(scene, random);
    const double load = 0.3 + static_cast<double>(random() % 100) / 40;
    const auto durations = [&](size_t task, uint64_t job) {
      const auto noise = static_cast<double>((job * 2654435761U + task * 40503U + seed) % 1000) / 1000;
      return static_cast<int64_t>(load * (0.5 + noise) * static_cast<double>(scene.plan.tasks[task].budget_ns));
    };
    bool blinded = false;
    const test::RecordedScene record(scene.plan, durations, 4, [&](RunBoard& board, int64_t now_ns) {
      if (now_ns > 3'000 * kMs && !std::exchange(blinded, true)) board.modes().request(1, now_ns + kMs, "a person");
    });
    const Predicted what_if(record, scene.plan);
    check_read(scene.plan, record.board, what_if.recorded);
    check_same(scene.plan, record.board, what_if.board);
    for (size_t t = 0; t < scene.plan.tasks.size(); ++t) {
      misses += record.board.task(t).deadline_misses;
      overruns += record.board.task(t).budget_overruns;
      degraded += record.board.task(t).at_level[1];
    }
  }
  CHECK(misses > 500);  // or nothing was shown
  CHECK(overruns > 1000);
  CHECK(degraded > 100);
}

TEST_CASE("A computer half as fast takes twice as long, one twice as fast half as long") {
  Scene scene;
  scene.plan.tasks[Scene::kRelay].offset_ns = 20 * kMs;  // after the sensor's, however fast that is
  const test::RecordedScene record(scene.plan, all_take(4 * kMs));
  const Predicted slow(record, scene.plan, 0.5), fast(record, scene.plan, 2);
  for (const size_t t : {Scene::kSensor, Scene::kRelay, Scene::kFollower, Scene::kBoss}) {
    CHECK(slow.task(t).exec.max_ns() == 8 * kMs);
    CHECK(fast.task(t).exec.max_ns() == 2 * kMs);
    CHECK(slow.task(t).exec.count() == record.board.task(t).exec.count());
    CHECK(slow.prediction.borrowed[t] == 0);
  }
  CHECK(slow.task(Scene::kRelay).response.max_ns() == 8 * kMs);
  CHECK(fast.board.port(Scene::kRelay).age.max_ns() < slow.board.port(Scene::kRelay).age.max_ns());
}

TEST_CASE("Jobs that two cores run at once wait for one another on one") {
  Scene scene;
  for (TaskPlan& task : scene.plan.tasks) task.offset_ns = 0;
  const test::RecordedScene record(scene.plan, all_take(9 * kMs));
  CHECK(record.board.task(Scene::kRelay).response.max_ns() < 28 * kMs);
  scene.plan.cores = {0};
  const Predicted one(record, scene.plan);
  CHECK(one.task(Scene::kPair).response.max_ns() > record.board.task(Scene::kPair).response.max_ns());
  CHECK(one.task(Scene::kRelay).deadline_misses == 0);
}

TEST_CASE("What a late job held back comes out where it is not late") {
  Scene scene;
  TaskPlan& relay = scene.plan.tasks[Scene::kRelay];
  relay.on_miss = OnMiss::skip;
  relay.deadline_ns = 20 * kMs;
  // Each third job is late.
  const test::RecordedScene record(
      scene.plan, [](size_t task, uint64_t job) { return task == Scene::kRelay && job % 3 == 2 ? 30 * kMs : kMs; });
  const TaskStatistics& was = record.board.task(Scene::kRelay);
  CHECK(was.skipped > 10);
  const Predicted fast(record, scene.plan, 2);
  CHECK(fast.task(Scene::kRelay).skipped == 0);
  CHECK(fast.task(Scene::kRelay).completed == was.completed + was.skipped);
  CHECK(fast.task(Scene::kFollower).exec.count() == was.completed + was.skipped);
  CHECK(fast.board.port(Scene::kRelay).age.count() == was.completed + was.skipped);
}

TEST_CASE("Another rate takes the times of the jobs nearest in time, a later offset those of the same job") {
  Scene scene;
  const auto job_takes = [](size_t, uint64_t job) { return (1 + static_cast<int64_t>(job)) * 100'000; };
  const test::RecordedScene record(scene.plan, job_takes);
  scene.plan.tasks[Scene::kRelay].offset_ns += 30 * kMs;
  scene.plan.tasks[Scene::kBoss].rate = Rate{5, 1};
  const Predicted other(record, scene.plan);
  CHECK(buckets(other.task(Scene::kRelay).exec) == buckets(record.board.task(Scene::kRelay).exec));
  CHECK(other.task(Scene::kBoss).exec.count() == 20);
  CHECK(other.task(Scene::kBoss).exec.max_ns() == job_takes(0, 38));
  CHECK(other.prediction.borrowed[Scene::kBoss] == 0);
}

TEST_CASE("A node that only passes on what is new does so in a what-if, one that repeats itself does not stop") {
  for (const bool only_new : {true, false}) {
    Scene scene;
    scene.relay.only_new = only_new;
    scene.plan.tasks[Scene::kRelay].rate = Rate{20, 1};  // the sensor has 15 Hz, and is silent now and then
    const test::RecordedScene record(scene.plan, all_take(kMs));
    scene.plan.tasks[Scene::kRelay].offset_ns += 20 * kMs;  // other jobs have nothing new
    const uint64_t sent = record.board.port(Scene::kSensor).writer.sent;
    const Predicted what_if(record, scene.plan);
    const uint64_t passed_on = what_if.board.port(Scene::kRelay).writer.sent;
    CHECK(passed_on == (only_new ? sent : what_if.task(Scene::kRelay).completed.load()));
  }
}

TEST_CASE("A change of mode happens again, but for a safe stop that only the recorded schedule caused") {
  Scene scene;
  scene.plan.tasks[Scene::kRelay].on_miss = OnMiss::safe_stop;
  scene.plan.tasks[Scene::kRelay].deadline_ns = 20 * kMs;
  const auto one_is_late = [](size_t task, uint64_t job) {
    return task == Scene::kRelay && job == 12 ? 30 * kMs : kMs;
  };
  const test::RecordedScene record(scene.plan, one_is_late);
  REQUIRE(record.board.modes().size() == 1);
  const Predicted same(record, scene.plan), fast(record, scene.plan, 4);
  CHECK(same.board.modes().size() == 1);
  CHECK(same.task(Scene::kRelay).completed == record.board.task(Scene::kRelay).completed);
  CHECK(fast.board.modes().size() == 0);
  CHECK(fast.task(Scene::kRelay).completed == 40);
  CHECK(fast.prediction.borrowed[Scene::kRelay] > 10);  // the record has none in its safe stop
}

TEST_CASE("A cut is predicted from its beginning on") {
  const Scene scene;
  const test::RecordedScene record(scene.plan, all_take(4 * kMs));
  const auto whole = record::LogFile::open(record.file);
  REQUIRE(whole);
  const std::filesystem::path file = record.folder.path / "cut.mcap";
  {
    auto sink = mcap::FileSink::open(file);
    REQUIRE(sink);
    REQUIRE(log::cut_log(*whole, 3'000 * kMs, 4'000 * kMs, *sink));
  }
  auto cut = record::LogFile::open(file);
  REQUIRE(cut);
  const RecordedRun recorded = read_recorded_run(*cut, scene.plan);
  CHECK(recorded.epoch_ns == 1'000 * kMs);
  CHECK(recorded.from_ns == 3'000 * kMs);
  CHECK(recorded.end_ns == 4'000 * kMs);
  RunBoard board(scene.plan);
  const Prediction prediction = predict(scene.plan, recorded, {}, board);
  CHECK(prediction.run.duration_s() == doctest::Approx(1));
  CHECK(prediction.run.released[Scene::kRelay] == 10);
  CHECK(board.task(Scene::kRelay).completed == 10);
  CHECK(board.task(Scene::kRelay).deadline_misses == 0);
  CHECK(board.port(Scene::kRelay).age.max_ns() == record.board.port(Scene::kRelay).age.max_ns());
}

TEST_CASE("A record without an end is predicted: its devices say when the run began") {
  const Scene scene;
  const test::RecordedScene record(scene.plan, all_take(4 * kMs), 4, {}, /*ends=*/false);
  const Predicted what_if(record, scene.plan);
  CHECK(what_if.recorded.epoch_ns == 1'000 * kMs);
  CHECK(what_if.recorded.end_ns > 4'900 * kMs);
  CHECK(what_if.task(Scene::kBoss).exec.count() == record.board.task(Scene::kBoss).exec.count());
  CHECK(what_if.task(Scene::kBoss).lateness.max_ns() == record.board.task(Scene::kBoss).lateness.max_ns());
}

TEST_CASE("The time at full quality comes back to the recorded one at the same level") {
  std::mt19937 random(3);
  for (int i = 0; i < 10'000; ++i) {
    const double cost = 0.05 + 0.95 * static_cast<double>(random() % 1000) / 1000;
    const auto full = static_cast<int64_t>(random() % 100'000'000);
    const auto cpu = static_cast<int64_t>(static_cast<double>(full) * cost);
    const int64_t again = command::at_full_quality_ns(cpu, cost);
    CHECK(static_cast<int64_t>(static_cast<double>(again) * cost) == cpu);
    CHECK(again <= full);
  }
}
