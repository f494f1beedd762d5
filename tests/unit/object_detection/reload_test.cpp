// SPDX-License-Identifier: Apache-2.0
// The database of a running node is changed: as a whole, in no job's time, and a replay does the same.
#include <doctest/doctest.h>

#include <algorithm>
#include <opencv2/core.hpp>
#include <opencv2/imgcodecs.hpp>

#include "nodes/object_detection/reloader.hpp"
#include "nodes/object_detection/revisions.hpp"
#include "rt/msg/ace/detections.hpp"
#include "rt/msg/image.hpp"
#include "rt/msg/odometry.hpp"
#include "rt/record/log_file.hpp"
#include "rt/record/replayer.hpp"
#include "rt/sched/param_mail.hpp"
#include "rt/sched/port_access.hpp"
#include "rt/testing.hpp"
#include "tests/going_on.hpp"
#include "tests/temporary_folder.hpp"
#include "tests/unit/record/recorded_run.hpp"

namespace takt {
void register_object_detection(NodeTypes& types);
}

using namespace takt;
using namespace takt::object_detection;

namespace {

constexpr int kSide = 16, kWidth = 96, kHeight = 48;
constexpr Capacity kSmallImages{kWidth, kHeight, 3, 0};

cv::Mat3b striped(const cv::Scalar& colour, const cv::Scalar& other) {
  cv::Mat3b image(kSide, kSide);
  for (int y = 0; y < kSide; y += 4) image.rowRange(y, y + 4) = y % 8 == 0 ? colour : other;
  return image;
}

cv::Mat3b red() { return striped({20, 30, 200}, {20, 200, 220}); }
cv::Mat3b blue() { return striped({210, 60, 10}, {40, 160, 20}); }

/// Two revisions of one database, which hold the same two views the other way round and under other names.
struct Database : test::TemporaryFolder {
  std::filesystem::path folder = path / "objects";
  std::string revisions[2];
  Database() {
    std::filesystem::create_directory(folder);
    cv::imwrite((folder / "red.png").string(), red());
    cv::imwrite((folder / "blue.png").string(), blue());
    write("objects/objects.txt", "object navy\nview blue.png\nobject crimson\nview red.png\n");
    revisions[1] = publish_revision(folder, kSide);
    write("objects/objects.txt", "object red\nview red.png\nobject blue\nview blue.png\n");
    revisions[0] = publish_revision(folder, kSide);
  }
};

/// Red on the left, blue on the right.
struct Camera final : Node {
  Output<StereoPair> pair{this, "pair", ""};
  void setup(Setup&) override { pair.reserve(kSmallImages); }
  void run(Job& job) override {
    StereoPair* message = pair.loan();
    message->width = kWidth, message->height = kHeight, message->channels = 3;
    message->left.resize(kWidth * kHeight * 3);
    cv::Mat3b image(kHeight, kWidth, reinterpret_cast<cv::Vec3b*>(message->left.data()));
    image.setTo(90);
    red().copyTo(image(cv::Rect(8, 16, kSide, kSide)));
    blue().copyTo(image(cv::Rect(72, 16, kSide, kSide)));
    pair.send(job.release_ns());
  }
};

/// Of which revision both boxes are, by their classes; -1: of neither.
struct Reader final : Node {
  Input<Detections> detections{this, "detections", ""};
  Output<Odometry> seen{this, "seen", ""};
  std::vector<int> revision;
  void setup(Setup&) override {}
  void run(Job& job) override {
    const Detections* found = detections.newest();
    if (found == nullptr || !detections.is_new()) return job.no_result();
    int classes[2] = {-1, -1};  // left, right
    for (const Detection& box : found->boxes.items()) classes[box.x_px > 40] = static_cast<int>(box.class_id);
    const auto both = [&](int left, int right) {
      return found->boxes.size == 2 && classes[0] == left && classes[1] == right;
    };
    revision.push_back(both(0, 1) ? 0 : both(3, 2) ? 1 : -1);
  }
};

struct ReloadScene {
  Camera camera;
  std::unique_ptr<Node> node;
  Reader reader;
  Plan plan;
  size_t revision = 0;  ///< index of the parameter

  explicit ReloadScene(const Database& database) {
    NodeTypes types;
    register_object_detection(types);
    node = types.find("object_detection")->make();
    test::set(*node, "database", database.folder.string());
    test::set(*node, "reference", int64_t{kSide});
    test::set(*node, "window", int64_t{24});
    test::set(*node, "scales", std::string("1+0.7"));
    while (node->params()[revision]->name() != "revision") ++revision;
    test::add_task(plan, camera, "camera", 0, kSmallImages);
    test::add_task(plan, *node, "detection", 10'000'000, {0, 0, 1, 32});
    test::add_task(plan, reader, "reader", 90'000'000);
    plan.tasks[0].device = true;
    for (TaskPlan& task : plan.tasks) task.rate = Rate{7, 1};
    plan.tasks[1].budget_ns = 20'000'000;
    plan.tasks[1].edges.push_back({0, 0, 1, 0});
    plan.tasks[2].edges.push_back({0, 1, 1, 0});
    for (size_t p = 0; p < plan.ports.size(); ++p) {
      plan.ports[p].port = plan.tasks[p].node->outputs()[0]->name();
      plan.ports[p].history = 16;
      plan.ports[p].held = 8;
      plan.ports[p].readers = 2;
    }
    const VirtualClock clock;
    Setup setup{clock, {}, {}, 1, std::nullopt, 0};
    camera.setup(setup);
    PortAccess::connect(*node->inputs()[0], kSmallImages);
    PortAccess::mark_read(*node->outputs()[0]);
    node->setup(setup);
    reader.setup(setup);
    PortAccess::connect(reader.detections, plan.ports[1].capacity);
    for (const TaskPlan& task : plan.tasks) task.node->end_setup();
  }
};

}  // namespace

TEST_CASE(
    "object_detection: a hundred changes at 7 Hz: each job has one whole database, none is missed, a replay agrees") {
  const Database database;
  const test::TemporaryFolder folder;
  {
    ReloadScene scene(database);
    auto sink = mcap::FileSink::open(folder.path / "run.mcap");
    REQUIRE(sink);
    uint64_t jobs = 0, missed = 0;
    size_t changes = 0;
    test::record_run(scene.plan, *sink, 16, {}, {}, [&](RunBoard& board) {
      const uint64_t done = board.task(1).completed.load();
      missed = board.task(1).deadline_misses.load() + board.task(1).skipped.load();
      if (done == jobs) return;
      jobs = done;
      if (changes < 100) CHECK(post(board.mail(1), scene.revision, ParamValue(database.revisions[++changes % 2])));
    });
    CHECK(changes == 100);
    CHECK(jobs == 16 * 7);
    CHECK(missed == 0);
    const std::vector<int>& seen = scene.reader.revision;
    REQUIRE(seen.size() >= 110);
    for (size_t i = 0; i < seen.size(); ++i) CHECK(seen[i] == static_cast<int>(std::min<size_t>(i, 100) % 2));
  }
  ReloadScene again(database);
  again.node->start(0);
  auto log = record::LogFile::open(folder.path / "run.mcap");
  REQUIRE(log);
  const record::ReplayResult replayed = record::Replayer(again.plan, *log, {}).run();
  CHECK(replayed.compared >= 110);
  CHECK(replayed.different == 0);
}

TEST_CASE("object_detection goes on from what was remembered with the revision and the class ids that it had") {
  const Database database;
  const test::TemporaryFolder folder;
  ReloadScene scene(database), later(database);
  auto sink = mcap::FileSink::open(folder.path / "run.mcap");
  REQUIRE(sink);
  size_t changes = 0;
  uint64_t jobs = 0;
  test::record_run(scene.plan, *sink, 2, {}, {}, [&](RunBoard& board) {
    const uint64_t done = board.task(1).completed.load();
    if (done == jobs || changes == 3) return;
    jobs = done;
    CHECK(post(board.mail(1), scene.revision, ParamValue(database.revisions[++changes % 2])));
  });
  REQUIRE(scene.reader.revision.back() == 1);
  later.node->start(0);
  later.node = test::going_on(*scene.node, std::move(later.node));
  test::set(*later.node, "revision", database.revisions[1]);
  auto other = mcap::FileSink::open(folder.path / "later.mcap");
  REQUIRE(other);
  test::record_run(later.plan, *other, 1);
  REQUIRE(later.reader.revision.size() >= 5);
  for (const int seen : later.reader.revision) CHECK(seen == 1);
}

TEST_CASE(
    "object_detection: a revision that was wanted too early is used once it is there; without one the start's is "
    "back") {
  const Database database;
  const test::TemporaryFolder folder;
  const auto published = revision_folder(database.folder, database.revisions[1]), away = database.path / "away";
  std::filesystem::rename(published, away);
  ReloadScene scene(database);
  auto sink = mcap::FileSink::open(folder.path / "run.mcap");
  REQUIRE(sink);
  uint64_t jobs = 0;
  test::record_run(scene.plan, *sink, 10, {}, {}, [&](RunBoard& board) {
    const uint64_t done = board.task(1).completed.load();
    if (done == jobs) return;
    jobs = done;
    if (jobs == 2) CHECK(post(board.mail(1), scene.revision, ParamValue(database.revisions[1])));
    if (jobs == 8) std::filesystem::rename(away, published);
    if (jobs == 40) {  // as one who edits the list that the next revision is made of
      database.write("objects/objects.txt", "object other\nview blue.png\n");
      CHECK(post(board.mail(1), scene.revision, ParamValue(std::string())));
    }
  });
  const std::vector<int>& seen = scene.reader.revision;
  REQUIRE(seen.size() >= 60);
  for (size_t i = 0; i < 9; ++i) CHECK(seen[i] == 0);
  for (size_t i = 26; i < 40; ++i) CHECK(seen[i] == 1);
  for (size_t i = 42; i < seen.size(); ++i) CHECK(seen[i] == 0);
}

TEST_CASE("class ids stay when entries change their places, and new ones are counted on") {
  const auto list = [](std::initializer_list<const char*> names) {
    std::vector<DatabaseObject> database;
    for (const char* name : names) database.emplace_back().name = name;
    return database;
  };
  auto bottles = list({"bottle", "bottle"});
  bottles[0].attributes = {{"closed", "true"}};
  bottles[1].attributes = {{"closed", "false"}};
  CHECK(ClassIds(bottles).of({bottles[1], bottles[0]}) == std::vector<float>{1, 0});
  ClassIds ids(list({"red", "blue"}));
  CHECK(ids.of(list({"blue", "red"})) == std::vector<float>{1, 0});
  CHECK(ids.of(list({"green", "blue"})) == std::vector<float>{2, 1});
  CHECK(ids.of(list({"yellow", "green", "red"})) == std::vector<float>{3, 2, 0});
}

TEST_CASE("object_detection: beside jobs in real time the old database stays until the new one is whole") {
  const Database database;
  std::atomic<bool> go{false};
  std::atomic<int> built{0};
  Reloader reloader([&](const std::string& revision) {
    while (!go) std::this_thread::yield();
    ++built;
    DetectorParameters p;
    p.window_px = 24;
    return std::make_unique<Detector>(kWidth, kHeight, read_revision(database.folder, revision, kSide), p);
  });
  std::unique_ptr<Detector> in_use;
  reloader.ask(database.revisions[0]);
  CHECK_FALSE(reloader.built());
  go = true;
  reloader.wait();
  REQUIRE(reloader.built());
  CHECK(reloader.exchange(in_use));
  REQUIRE(in_use != nullptr);
  const Detector* first = in_use.get();
  // What cannot be used leaves the old one.
  reloader.ask("0123456789abcdef");
  reloader.wait();
  CHECK_FALSE(reloader.exchange(in_use));
  CHECK(in_use.get() == first);
  CHECK(reloader.error().find("revision `0123456789abcdef`") == 0);
  CHECK(reloader.error().find(database.revisions[1]) != std::string_view::npos);
  for (int i = 0; i < 20; ++i) {
    reloader.ask(database.revisions[i % 2]);
    reloader.wait();
    CHECK(reloader.exchange(in_use));
  }
  CHECK(built == 22);
}

TEST_CASE("a revision is a copy under the name of its content, and a changed copy is refused") {
  const Database database;
  CHECK(database.revisions[0] != database.revisions[1]);
  CHECK(publish_revision(database.folder, kSide) == database.revisions[0]);  // it is there already
  CHECK(publish_revision(database.folder / "", kSide) == database.revisions[0]);
  CHECK(read_revision(database.folder, database.revisions[1], kSide)[0].name == "navy");
  const auto refusal = [&](const std::string& name) {
    try {
      read_revision(database.folder, name, kSide);
    } catch (const DatabaseError& error) {
      return std::string(error.what());
    }
    return std::string();
  };
  CHECK(refusal("").find("is not there; valid are") != std::string::npos);
  CHECK(refusal("../objects").find("is not there") != std::string::npos);
  database.write("objects.revisions/" + database.revisions[1] + "/objects.txt", "object blue\nview blue.png\n");
  CHECK(refusal(database.revisions[1]).find("was changed") != std::string::npos);
}
