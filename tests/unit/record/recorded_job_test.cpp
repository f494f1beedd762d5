// SPDX-License-Identifier: Apache-2.0
#include "rt/record/recorded_job.hpp"

#include <doctest/doctest.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstring>

#include "rt/record/job_assembler.hpp"
#include "rt/sched/run_board.hpp"

using namespace takt;
using namespace takt::record;
using trace::Event;
using trace::Kind;

namespace {

RecordedJob full_job() {
  RecordedJob job;
  job.task = 3;
  job.index = 70'000;
  job.release_ns = 5'000;
  job.deadline_ns = 9'000;
  job.start_ns = 5'100;
  job.finish_ns = 6'000;
  job.published_ns = 6'100;
  job.cpu_ns = 850;
  job.level = 1;
  job.mode = 2;
  job.late = true;
  job.params = {{0, true}, {1, int64_t{-4}}, {2, -0.0}, {3, std::string("half a word")}};
  job.inputs = {{0, false, {{7, 3}, {12, 1}}}, {2, true, {}}};
  job.answers = {{Question::time_left, -17}, {Question::chunk, 0}, {Question::now, INT64_MAX}};
  job.outputs = {{0, false, 9}, {1, true, 11}};
  job.visible_at_ns = 6'200;
  job.cut_off = true;
  return job;
}

struct Heard {
  std::vector<RecordedJob> jobs;
  std::vector<RecordedEvent> events;
  JobAssembler assembler{[this](const RecordedJob& job) { jobs.push_back(job); },
                         [this](const RecordedEvent& event) { events.push_back(event); }};
  void add(int32_t ring, Kind kind, int64_t at_ns, int64_t value = 0, int64_t extra = 0, uint8_t port = 0,
           uint32_t job = 1, uint16_t task = 4) {
    assembler.add(ring, Event{at_ns, value, extra, job, task, kind, port});
  }
  /// `lost`: events of the ring, when it began and when it ended.
  void whole_job(int32_t ring, uint32_t job, int64_t lost = 0, int64_t lost_at_end = -1) {
    add(ring, Kind::release, 100, 200, lost, 0, job);
    add(ring, Kind::start, 110, 0, 0, 0, job);
    add(ring, Kind::finish, 120, 9, 0, 0, job);
    add(ring, Kind::publish, 125, 0, lost_at_end < 0 ? lost : lost_at_end, 0, job);
  }
  void restart(int32_t ring, uint32_t job, int64_t at_ns, uint64_t newest) {
    add(ring, Kind::handed, at_ns, static_cast<int64_t>(newest), static_cast<int64_t>(newest), 0, job);
    add(ring, Kind::seen, at_ns, 17, 0, 2, job);
    add(ring, Kind::restart, at_ns, 1, 0, 0, job);
  }
};

}  // namespace

TEST_CASE("A job that is packed and unpacked is the same") {
  for (const RecordedJob& job : {RecordedJob{}, full_job()}) {
    std::vector<std::byte> packed;
    pack(job, packed);
    const auto again = unpack_job(packed);
    REQUIRE(again);
    CHECK(*again == job);
    CHECK(std::signbit(job.params.empty() ? -0.0 : std::get<double>(again->params[2].value)));
  }
}

TEST_CASE("A job of format 1 says neither when it became visible nor that it was cut off") {
  std::vector<std::byte> first, second;
  pack(full_job(), first, 1);
  pack(full_job(), second);
  CHECK(first.size() + 9 == second.size());
  const auto again = unpack_job(first, 1);
  REQUIRE(again);
  RecordedJob told = full_job();
  told.visible_at_ns = 0;
  told.cut_off = false;
  CHECK(*again == told);
  CHECK_FALSE(unpack_job(first, 2));
}

TEST_CASE("Bytes that are no job are refused, wherever they end") {
  std::vector<std::byte> packed;
  pack(full_job(), packed);
  for (size_t length = 0; length < packed.size(); ++length) CHECK_FALSE(unpack_job(std::span(packed).first(length)));
  packed.push_back({});
  CHECK_FALSE(unpack_job(packed));
  // A number of elements that no memory could hold is no reason to ask for it.
  std::vector<std::byte> claims(51 + 4, std::byte{0xff});
  CHECK_FALSE(unpack_job(claims));
}

TEST_CASE("The events of a job make its record") {
  Heard heard;
  heard.add(1, Kind::param, 100, std::bit_cast<int64_t>(2.5), ParamMail::number, 2);
  heard.add(1, Kind::release, 100, 200);
  heard.add(1, Kind::start, 110, 0, 0, 1);
  heard.add(1, Kind::stale, 110, 0, 0, 1);
  heard.add(1, Kind::latch, 110, 8, 77, 0);
  heard.add(1, Kind::held, 110, 5, 2, 0);
  heard.add(1, Kind::held, 110, 8, 1, 0);
  heard.add(1, Kind::latch, 110, 3, 70, 2);
  heard.add(1, Kind::answer, 0, 40, static_cast<int64_t>(Question::time_left), 0, 1, trace::kNoTask);
  heard.add(1, Kind::answer, 0, 0, static_cast<int64_t>(Question::chunk), 0, 0, trace::kNoTask);
  heard.add(1, Kind::finish, 150, 33, 0);
  heard.add(1, Kind::miss, 200, 5);
  heard.add(1, Kind::publish, 205, 6, 77, 1);
  heard.add(1, Kind::repeat, 205, 4, 0, 0);
  CHECK(heard.jobs.empty());
  heard.add(1, Kind::publish, 205);
  REQUIRE(heard.jobs.size() == 1);
  const RecordedJob& job = heard.jobs[0];
  CHECK(job.task == 4);
  CHECK(job.index == 1);
  CHECK(job.release_ns == 100);
  CHECK(job.deadline_ns == 200);
  CHECK(job.start_ns == 110);
  CHECK(job.finish_ns == 150);
  CHECK(job.published_ns == 205);
  CHECK(job.cpu_ns == 33);
  CHECK(job.level == 1);
  CHECK(job.late);
  CHECK(job.visible_at_ns == 205);
  CHECK_FALSE(job.cut_off);
  CHECK(job.params == std::vector<RecordedJob::Param>{{2, 2.5}});
  CHECK(job.inputs ==
        std::vector<RecordedJob::Input>{{1, true, {}}, {0, false, {{5, 2}, {8, 1}}}, {2, false, {{3, 1}}}});
  CHECK(job.answers == std::vector<RecordedJob::Answer>{{Question::time_left, 40}, {Question::chunk, 0}});
  CHECK(job.outputs == std::vector<RecordedJob::Output>{{1, false, 6}, {0, true, 4}});
  CHECK(heard.assembler.incomplete() == 0);
}

TEST_CASE("A parameter of text comes in pieces of eight characters") {
  for (const std::string text : {"", "seven77", "eight888", "a text of more than sixteen"}) {
    Heard heard;
    for (size_t at = 0; at <= text.size(); at += 8) {
      int64_t piece = 0;
      std::memcpy(&piece, text.data() + at, std::min<size_t>(8, text.size() - at));
      heard.add(1, Kind::param, 100, piece, ParamMail::text, 3);
    }
    heard.whole_job(1, 1);
    REQUIRE(heard.jobs.size() == 1);
    CHECK(heard.jobs[0].params == std::vector<RecordedJob::Param>{{3, text}});
  }
}

TEST_CASE("A parameter of a job that never ends is told with the next one of its task, once") {
  Heard heard;
  heard.add(1, Kind::param, 90, 7, ParamMail::integer, 2);
  heard.add(1, Kind::release, 100, 200, 0, 0, 1);  // its process dies
  heard.whole_job(3, 1, 0);
  heard.whole_job(3, 2, 0);
  REQUIRE(heard.jobs.size() == 2);
  CHECK(heard.jobs[0].params == std::vector<RecordedJob::Param>{{2, int64_t{7}}});
  CHECK(heard.jobs[1].params.empty());
}

TEST_CASE("A text that its process did not finish is no part of the one that comes next") {
  Heard heard;
  const auto piece = [&](int32_t thread, const char* eight, int64_t at_ns) {
    int64_t value = 0;
    std::memcpy(&value, eight, 8);
    heard.add(thread, Kind::param, at_ns, value, ParamMail::text, 3);
  };
  piece(1, "half a w", 100);
  piece(2, "half a w", 200);
  piece(2, "ord\0\0\0\0", 200);
  heard.whole_job(2, 1);
  REQUIRE(heard.jobs.size() == 1);
  CHECK(heard.jobs[0].params == std::vector<RecordedJob::Param>{{3, std::string("half a word")}});
}

TEST_CASE("Jobs of several threads are told apart; a job of which an event was lost is counted, not told") {
  Heard heard;
  heard.add(1, Kind::release, 100, 200, 0, 0, 1);
  heard.add(2, Kind::release, 101, 201, 0, 0, 2);
  heard.add(1, Kind::publish, 125, 0, 0, 0, 1);
  heard.add(2, Kind::publish, 126, 0, 0, 0, 2);
  CHECK(heard.jobs.size() == 2);
  SUBCASE("within") {
    heard.whole_job(1, 3, 0, 2);
    CHECK(heard.jobs.size() == 2);
    CHECK(heard.assembler.incomplete() == 1);
    heard.whole_job(1, 4, 2);
    CHECK(heard.jobs.size() == 3);
  }
  SUBCASE("at its end") {
    heard.add(1, Kind::release, 100, 200, 0, 0, 3);
    heard.whole_job(1, 4, 1);
    CHECK(heard.jobs.size() == 2);
    CHECK(heard.assembler.incomplete() == 2);  // the second, too, lacks an event as far as is known
    heard.whole_job(1, 5, 1);
    CHECK(heard.jobs.size() == 3);
  }
  SUBCASE("at its beginning") {
    heard.add(1, Kind::finish, 120, 9, 0, 0, 3);
    heard.add(1, Kind::publish, 125, 0, 1, 0, 3);
    CHECK(heard.jobs.size() == 2);
    CHECK(heard.assembler.incomplete() == 1);
    heard.whole_job(1, 4, 1);
    CHECK(heard.jobs.size() == 3);
  }
  SUBCASE("a skipped release is no job") {
    heard.add(1, Kind::skip, 130, 0, 0, 0, 3);
    heard.whole_job(1, 4);
    CHECK(heard.jobs.size() == 3);
    CHECK(heard.assembler.incomplete() == 0);
  }
}

TEST_CASE("Members of a lane end together: the answers are those of the one at work") {
  Heard heard;
  heard.add(1, Kind::release, 100, 200, 0, 0, 1, 4);
  heard.add(1, Kind::offer, 110, 6, 0, 0, 1, 4);
  heard.add(1, Kind::release, 110, 300, 0, 0, 9, 5);
  heard.add(1, Kind::answer, 0, 40, static_cast<int64_t>(Question::now), 0, 9, trace::kNoTask);
  heard.add(1, Kind::publish, 111, 6, 77, 0, 1, 4);
  heard.add(1, Kind::publish, 111, 0, 0, 0, 1, 4);
  heard.add(1, Kind::publish, 120, 0, 0, 0, 9, 5);
  REQUIRE(heard.jobs.size() == 2);
  CHECK(heard.jobs[0].task == 4);
  CHECK(heard.jobs[0].answers.empty());
  CHECK(heard.jobs[0].outputs == std::vector<RecordedJob::Output>{{0, false, 6}});
  CHECK(heard.jobs[1].answers.size() == 1);
  CHECK(heard.assembler.incomplete() == 0);
}

TEST_CASE("A job that its process did not live to end is told, with what it was about to publish") {
  Heard heard;
  heard.whole_job(1, 1);
  heard.add(1, Kind::release, 300, 400, 0, 0, 2);
  heard.add(1, Kind::start, 310, 0, 0, 0, 2);
  heard.add(1, Kind::offer, 350, 6, 0, 0, 2);
  heard.add(1, Kind::offer, 350, 9, 0, 1, 2);
  SUBCASE("once its ring goes on") { heard.restart(1, 4, 500, 6); }
  SUBCASE("once another of its task begins in its ring, which the first one after the restart need not") {
    heard.whole_job(1, 5);
  }
  SUBCASE("else at the end: its task goes on in another ring") {
    heard.restart(2, 4, 500, 6);
    heard.whole_job(2, 4);
    CHECK(heard.jobs.size() == 2);
    heard.assembler.end();
    std::swap(heard.jobs[1], heard.jobs.back());
  }
  SUBCASE("and if it had told of a part of it when it died") {
    heard.add(1, Kind::publish, 360, 6, 77, 0, 2);
    heard.assembler.end();
  }
  SUBCASE("the last offer of an output counts") {
    heard.add(1, Kind::offer, 355, 6, 1, 0, 2);
    heard.assembler.end();
    REQUIRE(heard.jobs.size() == 2);
    CHECK(heard.jobs[1].outputs == std::vector<RecordedJob::Output>{{1, false, 9}, {0, true, 6}});
    heard.jobs[1].outputs = {{0, false, 6}, {1, false, 9}};
    heard.jobs[1].finish_ns = heard.jobs[1].published_ns = 350;
  }
  REQUIRE(heard.jobs.size() >= 2);
  const RecordedJob& job = heard.jobs[1];
  CHECK(job.cut_off);
  CHECK(job.index == 2);
  CHECK(job.finish_ns == 350);
  CHECK(job.published_ns == 350);
  CHECK(job.outputs == std::vector<RecordedJob::Output>{{0, false, 6}, {1, false, 9}});
  CHECK(heard.assembler.incomplete() == 0);
}

TEST_CASE("A job that was cut off and lost an event is counted, not told") {
  Heard heard;
  heard.add(1, Kind::release, 300, 400, 0, 0, 2);
  SUBCASE("before its offer") { heard.add(1, Kind::offer, 350, 6, 2 * 1, 0, 2); }
  SUBCASE("before the next in its ring") { heard.add(1, Kind::release, 500, 600, 1, 0, 3); }
  heard.assembler.end();
  CHECK(std::none_of(heard.jobs.begin(), heard.jobs.end(), [](const RecordedJob& job) { return job.index == 2; }));
  CHECK(heard.assembler.incomplete() > 0);
}

TEST_CASE("A restart says what its task went on from, and forgets what was set before it") {
  Heard heard;
  heard.add(1, Kind::param, 100, std::bit_cast<int64_t>(2.5), ParamMail::number | 1000 << 8, 2);
  heard.restart(1, 7, 500, 6);
  heard.add(1, Kind::param, 500, std::bit_cast<int64_t>(3.5), ParamMail::number, 3, 7);
  heard.whole_job(1, 7);
  REQUIRE(heard.events.size() == 3);
  CHECK(heard.events[0] == RecordedEvent{2, 4, 1, 100, ParameterSet{2, 2.5, "uid 1000"}});
  CHECK(heard.events[1] == RecordedEvent{1, 4, 7, 500, Restart{1, 0, {{0, 6, 6}}, {{2, 17}}, {}}});
  REQUIRE(heard.jobs.size() == 1);
  CHECK(heard.jobs[0].params == std::vector<RecordedJob::Param>{{3, 3.5}});
}

TEST_CASE("A text that its thread did not live to note to its end leaves nothing in the next one") {
  Heard heard;
  int64_t piece = 0;
  std::memcpy(&piece, "eightcha", 8);
  heard.add(1, Kind::param, 100, piece, ParamMail::text, 3);
  std::memcpy(&piece, "short\0\0\0", 8);
  heard.add(1, Kind::param, 600, piece, ParamMail::text, 3, 7);
  heard.whole_job(1, 7);
  REQUIRE(heard.jobs.size() == 1);
  CHECK(heard.jobs[0].params == std::vector<RecordedJob::Param>{{3, std::string("short")}});
}

TEST_CASE("A restart says which values its node took up; the next job has only what was set after it") {
  Heard heard;
  const auto noted = [&](Kind kind, int64_t at_ns, const char* eight) {
    int64_t piece = 0;
    std::memcpy(&piece, eight, 8);
    heard.add(1, kind, at_ns, piece, ParamMail::text | 1000 << 8, 3, 7);
  };
  noted(Kind::param, 100, "eightcha");  // its process died in the middle of the text
  heard.add(1, Kind::handed, 500, 6, 6, 0, 7);
  noted(Kind::kept, 500, "eightcha");
  noted(Kind::kept, 500, "racters\0");
  heard.add(1, Kind::kept, 500, 5, ParamMail::integer, 4, 7);
  heard.add(1, Kind::restart, 500, 0, 0, 0, 7);
  noted(Kind::param, 500, "short\0\0\0");
  // That of the process before comes late where its thread had another ring.
  heard.add(2, Kind::param, 100, 9, ParamMail::integer, 4);
  heard.whole_job(1, 7);
  heard.whole_job(1, 8);
  REQUIRE(heard.events.size() == 3);
  CHECK(std::get<Restart>(heard.events[0].what).params ==
        std::vector<RecordedJob::Param>{{3, std::string("eightcharacters")}, {4, int64_t{5}}});
  REQUIRE(heard.jobs.size() == 2);
  CHECK(heard.jobs[0].params == std::vector<RecordedJob::Param>{{3, std::string("short")}});
  CHECK(heard.jobs[1].params.empty());
  CHECK(heard.assembler.incomplete() == 0);
}

TEST_CASE("What was set before a job that lost an event is told with the next whole one") {
  Heard heard;
  heard.add(1, Kind::param, 90, 7, ParamMail::integer, 2);
  heard.whole_job(1, 1, 0, 2);
  heard.whole_job(1, 2, 2);
  REQUIRE(heard.jobs.size() == 1);
  CHECK(heard.jobs[0].params == std::vector<RecordedJob::Param>{{2, int64_t{7}}});
}

TEST_CASE("Two processes that died while they noted the same restart leave one") {
  Heard heard;
  heard.add(1, Kind::handed, 400, 6, 6, 0, 7);
  heard.restart(1, 7, 500, 6);
  REQUIRE(heard.events.size() == 1);
  CHECK(std::get<Restart>(heard.events[0].what).outputs.size() == 1);
  CHECK(heard.events[0].at_ns == 500);
}
