// SPDX-License-Identifier: Apache-2.0
#include "rt/testing.hpp"

#include <doctest/doctest.h>

#include <mutex>
#include <string>

#include "rt/memory/memory_use.hpp"
#include "rt/msg/joint_state.hpp"
#include "rt/msg/pose.hpp"
#include "rt/msg/text_status.hpp"
#include "tests/has.hpp"

using namespace takt;

namespace {

/// Repeats a text, and shows what it sees of the runtime.
class Repeater final : public Node {
 public:
  Input<TextStatus> in{this, "in", "text to repeat"};
  Input<TextStatus> extra{this, "extra", "looked at only", Need::optional};
  Output<TextStatus> out{this, "out", "the text, `times` times"};
  Output<TextStatus> spare{this, "spare", "never sent"};
  Param<int> times{this, "times", 2, {1, 4}, "1", "how often"};
  Param<int> room{this, "room", 64, {1, 1000}, "1", "characters of the output"};
  Levels levels{this, {{"full", 1}, {"cheap", 0.5}}};

  size_t held = 0, fresh = 0;
  bool second_refused = false, stale = false, extra_connected = false, spare_read = true, allocates = false;
  int level = -1;
  int64_t epoch_ns = 0;
  std::string went_on;

  void setup(Setup&) override {
    if (room() > 500) throw SetupError("room is above 500");
    out.reserve({0, 0, 1, static_cast<uint32_t>(room())});
    extra_connected = extra.connected();
  }
  void start(int64_t epoch) override {
    epoch_ns = epoch;
    if (const TextStatus* before = out.handed_over()) went_on.assign(before->text.data(), before->text.size);
  }
  void run(Job& job) override {
    held = in.size(), stale = in.stale(), level = job.level(), spare_read = spare.connected();
    fresh = 0;
    for (size_t i = 0; i < in.size(); ++i) fresh += in.is_new(i);
    if (allocates) delete new std::string(100, 'x');
    if (in.stale()) return job.no_result();
    TextStatus* text = out.loan();
    for (int i = 0; i < times(); ++i)
      for (const char c : in.newest()->text.items()) text->text.push_back(c);
    out.send(in.stamp_ns());
    second_refused = out.loan() == nullptr;
  }
};

void say(NodeTest<Repeater>& test, std::string_view words, int64_t stamp_ns) {
  test.put("in", stamp_ns, [&](TextStatus& message) {
    for (const char c : words) message.text.push_back(c);
  });
}

std::string said(NodeTest<Repeater>& test) {
  const auto* message = test.out<TextStatus>("out");
  return message ? std::string(message->text.data(), message->text.size) : "nothing";
}

template <class Call>
std::string error_of(Call call) {
  try {
    call();
  } catch (const std::logic_error& error) {
    return error.what();
  }
  return "no error";
}

}  // namespace

TEST_CASE("NodeTest: a message in, one job, a message out with its stamp") {
  NodeTest<Repeater> test;
  test.connect("in", {0, 0, 1, 16});
  test.set("times", 3);
  say(test, "ab", 5);
  CHECK(test.run());
  CHECK(said(test) == "ababab");
  CHECK(test.stamp_ns("out") == 5);
  CHECK(test.out<TextStatus>("spare") == nullptr);
  CHECK(test.node().second_refused);  // a job has one message for each output
  CHECK(test.node().spare_read);
  CHECK_FALSE(test.node().extra_connected);
  CHECK(test.node().epoch_ns == test.kEpochNs);
}

TEST_CASE("NodeTest: what was put stays latched and is new once; the newest `depth` of them are held") {
  NodeTest<Repeater> test;
  test.connect("in", {0, 0, 1, 16});
  test.depth("in", 2);
  CHECK_FALSE(test.run());  // nothing there yet
  CHECK(test.node().stale);
  CHECK(said(test) == "nothing");
  for (const char* word : {"a", "b", "c"}) say(test, word, 7);
  test.run();
  CHECK(test.node().held == 2);
  CHECK(test.node().fresh == 2);
  CHECK(said(test) == "cc");
  test.run();
  CHECK(test.node().held == 2);
  CHECK(test.node().fresh == 0);
  say(test, "d", 8);
  test.run();
  CHECK(test.node().fresh == 1);
  test.make_stale("in");
  CHECK_FALSE(test.run());
  CHECK(test.node().held == 2);
  say(test, "e", 9);
  CHECK(test.run());
  test.empty("in");
  CHECK_FALSE(test.run());
  CHECK(test.node().held == 0);
}

TEST_CASE("NodeTest: releases are those of the rate, and time moves with them") {
  NodeTest<Repeater> test;
  test.rate({3, 1});
  for (const int64_t after : {0, 333'333'333, 666'666'666, 1'000'000'000}) {
    test.run();
    CHECK(test.job().release_ns() == test.kEpochNs + after);
    CHECK(test.job().deadline_ns() == test.job().release_ns() + 333'333'334);
    CHECK(test.now_ns() == test.job().release_ns());
  }
  CHECK(test.job().index() == 3);
  test.advance_to(test.kEpochNs + 2'000'000'000);
  test.deadline(1000);
  test.run();
  CHECK(test.job().now_ns() == test.kEpochNs + 2'000'000'000);
  CHECK(test.job().time_left_ns() < 0);
  test.run_at(test.kEpochNs + 5'000'000'000);
  CHECK(test.job().release_ns() == test.kEpochNs + 5'000'000'000);
}

TEST_CASE("NodeTest: levels, modes, unread outputs, optional inputs, a restart") {
  NodeTest<Repeater> test;
  test.level(1);
  test.mode("safe_stop");
  test.leave_unread("spare");
  test.connect("extra", {0, 0, 1, 4});
  TextStatus& before = test.hand_over<TextStatus>("out", {0, 0, 1, 8});
  for (const char c : std::string_view("before")) before.text.push_back(c);
  test.run();
  CHECK(test.node().level == 1);
  CHECK(test.job().mode() == "safe_stop");
  CHECK_FALSE(test.node().spare_read);
  CHECK(test.node().extra_connected);
  CHECK(test.node().went_on == "before");
}

TEST_CASE("NodeTest: counts what a job allocates, and names the calls that no job should make") {
  if (!counting_allocations()) return;
  NodeTest<Repeater> test;
  test.run();
  CHECK(test.allocations() == 0);
  CHECK(test.forbidden_calls().empty());
  test.node().allocates = true;
  test.run();
  CHECK(test.allocations() == 2);
  CHECK(test.forbidden_calls() == "malloc 2");
  test.node().may(bit(JobCall::malloc), "to see it counted");
  test.run();
  CHECK(test.allocations() == 2);
  CHECK(test.forbidden_calls().empty());
}

TEST_CASE("the state of an arm's joints: one entry each, and what is not measured is empty") {
  test::Box<JointState> arm({0, 0, 1, 7});
  for (int joint = 0; joint < 7; ++joint) {
    JointName name;
    name.text[0] = static_cast<char>('a' + joint);
    CHECK(arm->names.push_back(name));
    CHECK(arm->position_rad.push_back(0.1 * joint));
  }
  CHECK_FALSE(arm->position_rad.push_back(0));  // the capacity counts joints
  const MessageType& type = MessageType::of<JointState>();
  CHECK(type.intact(&*arm, {0, 0, 1, 7}));
  CHECK(arm->effort_nm.empty());
  CHECK(std::string_view(arm->names[6].text) == "g");
  CHECK(type.fields.size() == 4);
}

TEST_CASE("NodeTest: a wrong use is answered with the valid choices") {
  NodeTest<Repeater> test;
  CHECK(error_of([&] { test.put<TextStatus>("inn", 0); }) == "the node has no input inn; it has in, extra, control");
  CHECK(error_of([&] { test.set("time", 1); }) == "the node has no parameter time; it has times, room");
  CHECK(test::has(error_of([&] { test.set("times", 9); }), "times is 9"));
  CHECK(error_of([&] { test.put<Pose>("in", 0); }) == "in carries text_status, not pose");
  CHECK(test::has(error_of([&] { test.put<TextStatus>("in", 0); }), "connect(\"in\", {.count = 64})"));
  CHECK(test::has(error_of([&] { test.depth("in", 65); }), "1..64"));
  CHECK(test::has(error_of([&] { test.level(2); }), "0..1"));
  CHECK(error_of([&] { test.job(); }) == "no job has run yet");
  test.run();
  CHECK(error_of([&] { test.stamp_ns("out"); }) == "the last job sent nothing on out");
  CHECK(error_of([&] { test.out<Pose>("out"); }) == "out carries text_status, not pose");
  CHECK(test::has(error_of([&] { test.set("room", 5); }), "set it before the first job"));
  CHECK(test::has(error_of([&] { test.connect("in"); }), "before the node is set up"));
  test.set("times", 4);  // live
  NodeTest<Repeater> refused;
  refused.set("room", 501);
  CHECK_THROWS_AS(refused.start(), SetupError);
}
