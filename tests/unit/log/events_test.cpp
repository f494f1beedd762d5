// SPDX-License-Identifier: Apache-2.0
// What `takt log` does with the events of a record: told, compared, cut, exported.
#include <doctest/doctest.h>

#include <optional>

#include "graph/log/cut_log.hpp"
#include "graph/log/export_log.hpp"
#include "graph/log/log_content.hpp"
#include "tests/temporary_folder.hpp"
#include "tests/unit/log/known_types.hpp"
#include "tests/unit/record/restarted_run.hpp"

using namespace takt;
using namespace takt::log;

namespace {

using test::kMs;

record::Head head_of(const std::string& plan) {
  return {{}, {{0, 0, "plan.json", "application/json", mcap::bytes_of(plan)}}};
}

record::LogFile opened(const std::filesystem::path& file) {
  auto log = record::LogFile::open(file);
  REQUIRE_MESSAGE(log, log.error());
  return std::move(*log);
}

/// The filter goes on from what it is handed over, and adds nothing. Its grids are in the record by their hash only.
struct Restarted {
  test::TemporaryFolder folder;
  std::optional<record::LogFile> log;
  explicit Restarted(const std::vector<test::Life>& lives) {
    auto sink = mcap::FileSink::open(folder.path / "run.mcap");
    REQUIRE(sink);
    const std::string plan = plan_json(test::LongGraph().plan).dump();
    test::RestartedRun run(*sink, {.ports = test::with_fields({1, 0, 1})}, lives.size(), head_of(plan), 0.0);
    for (const test::Life& life : lives) run.live(life);
    run.finish();
    log.emplace(opened(folder.path / "run.mcap"));
  }
};

const std::vector<test::Life> kTwoKills{
    {MessageStep::after_commit, 1, 6, 0.5}, {MessageStep::after_loan, 1, 6, 0.25}, {}};

record::ReplayResult replayed(record::LogFile& log) {
  test::Renewable nodes(0.0);
  return record::Replayer(nodes.graph.plan, log, nodes.options()).run();
}

}  // namespace

TEST_CASE("What is told of a record counts its events, its restarts and the jobs that were cut off") {
  Restarted run(kTwoKills);
  const Json content = content_json(*run.log);
  CHECK(content["format"] == 2);
  CHECK(content["events"] == Json{{"parameter", 2}, {"restart", 6}});
  CHECK(content["nodes"][1]["restarts"] == 2);
  CHECK(content["nodes"][1]["cut_off"] == 2);
  CHECK(content_text(content).find("events: 2 parameter, 6 restart") != std::string::npos);
}

TEST_CASE("Records with other events differ") {
  Restarted a(kTwoKills), b({{MessageStep::after_commit, 1, 6, 0.5}, {}});
  CHECK(difference(*a.log, *a.log).same);
  const LogDifference told = difference(*a.log, *b.log);
  CHECK_FALSE(told.same);
  CHECK(std::count(told.lines.begin(), told.lines.end(), "events: restart 6 -> 3") == 1);
  CHECK(content_hash(*a.log) != content_hash(*b.log));
}

TEST_CASE("A cut goes on from the last restart before it, with the message that was handed over") {
  Restarted run(kTwoKills);
  REQUIRE(replayed(*run.log).different == 0);
  std::optional<int64_t> second_ns;
  for (const auto& event : run.log->events())
    if (event.task == 1 && std::holds_alternative<record::Restart>(event.what)) second_ns = event.at_ns;
  REQUIRE(second_ns);
  auto sink = mcap::FileSink::open(run.folder.path / "cut.mcap");
  REQUIRE(sink);
  const auto cut = cut_log(*run.log, *second_ns + 300 * kMs, *second_ns + 700 * kMs, *sink);
  REQUIRE_MESSAGE(cut, cut.error());
  record::LogFile part = opened(run.folder.path / "cut.mcap");
  CHECK(part.damages().empty());
  CHECK(part.format() == 2);
  CHECK(cut->events == part.events().size());
  CHECK(part.jobs().size() < run.log->jobs().size() / 2);
  const record::ReplayResult result = replayed(part);
  CHECK(result.restarts > 0);
  CHECK(result.compared > 6);
  INFO((result.first ? result.first->node + ", job " + std::to_string(result.first->job) + ": " + result.first->what
                     : ""));
  CHECK(result.different == 0);
  CHECK(result.lacking == 0);
}

TEST_CASE("Events are exported as log lines") {
  Restarted run(kTwoKills);
  auto sink = mcap::FileSink::open(run.folder.path / "export.mcap");
  REQUIRE(sink);
  REQUIRE(export_log(*run.log, test::known_types(), json_encoding(), *sink));
  const auto reader = mcap::Reader::open(run.folder.path / "export.mcap");
  REQUIRE(reader);
  std::vector<std::string> lines;
  REQUIRE(reader->for_each([&](const mcap::Message& message) {
    for (const mcap::Channel& channel : reader->channels())
      if (channel.id == message.channel && channel.topic == "takt/events") {
        const auto json =
            Json::parse(std::string_view(reinterpret_cast<const char*>(message.data.data()), message.data.size()));
        lines.push_back(json["name"].get<std::string>() + ": " + json["message"].get<std::string>());
      }
    return true;
  }));
  CHECK(lines.size() == 8);
  CHECK(std::count(lines.begin(), lines.end(), "filter: bias set to 0.5 by uid 0") == 1);
  CHECK(std::count_if(lines.begin(), lines.end(),
                      [](const std::string& line) { return line.starts_with("filter: restart before job "); }) == 2);
}

TEST_CASE("Kinds of events that this program does not know are counted by their numbers, and hurt nothing") {
  const test::TemporaryFolder folder;
  {
    auto sink = mcap::FileSink::open(folder.path / "run.mcap");
    REQUIRE(sink);
    mcap::Writer file(*sink, {});
    REQUIRE(file.begin("", "takt"));
    REQUIRE(file.metadata(record::Recorder::kFacts, {{"format", "2"}}));
    const std::string plan = plan_json(test::LongGraph().plan).dump();
    for (const mcap::Attachment& attached : head_of(plan).files) REQUIRE(file.attach(attached));
    const uint16_t channel = file.add_channel(file.add_schema("takt.Event", "text", record::event_layout()),
                                              record::Recorder::kEvents, record::Recorder::kEncoding, {});
    for (const int kind : {4, 8, 99, 99}) {
      std::vector<std::byte> packed;
      record::pack(record::RecordedEvent{static_cast<uint16_t>(kind), 1, 2, 3 * kMs, {}}, packed);
      packed.resize(packed.size() + 5, std::byte{0xff});
      REQUIRE(file.write({channel, 0, 3'000'000, 3'000'000, packed}));
    }
    REQUIRE(file.finish());
  }
  record::LogFile log = opened(folder.path / "run.mcap");
  CHECK(log.damages().empty());
  CHECK(content_json(log)["events"] ==
        Json{{"reserved kind 4 (request)", 1}, {"reserved kind 8 (level)", 1}, {"unknown kind 99", 2}});
  CHECK(replayed(log).different == 0);
  auto sink = mcap::FileSink::open(folder.path / "cut.mcap");
  REQUIRE(sink);
  const auto cut = cut_log(log, 0, 1'000 * kMs, *sink);
  REQUIRE(cut);
  CHECK(cut->events == 4);
  CHECK(opened(folder.path / "cut.mcap").events() == log.events());
}
