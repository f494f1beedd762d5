// SPDX-License-Identifier: Apache-2.0
// What `takt log` says of a record: its content, its hash, how it differs from another, and the export.
#include <doctest/doctest.h>

#include <optional>

#include "graph/log/export_log.hpp"
#include "graph/log/log_content.hpp"
#include "tests/temporary_folder.hpp"
#include "tests/unit/log/known_types.hpp"
#include "tests/unit/record/recorded_run.hpp"

using namespace takt;
using namespace takt::log;

namespace {

struct Made {
  test::TemporaryFolder folder;
  std::optional<record::LogFile> log;
  explicit Made(double gain = 2.0, record::Recorder::Options how = {}) {
    test::SmallGraph graph;
    REQUIRE(graph.filter.gain.set(gain));
    const std::string plan = plan_json(graph.plan).dump();
    auto sink = mcap::FileSink::open(folder.path / "run.mcap");
    REQUIRE(sink);
    test::record_run(graph.plan, *sink, 3, std::move(how),
                     {{}, {{0, 0, "plan.json", "application/json", mcap::bytes_of(plan)}}});
    auto opened = record::LogFile::open(folder.path / "run.mcap");
    REQUIRE(opened);
    log.emplace(std::move(*opened));
  }
};

std::optional<mcap::Channel> channel_of(const mcap::Reader& reader, const std::string& topic) {
  for (const mcap::Channel& channel : reader.channels())
    if (channel.topic == topic) return channel;
  return std::nullopt;
}

}  // namespace

TEST_CASE("The content of a record: ports, nodes, nothing lost") {
  Made made({}, {.ports = test::with_fields({1, 0, 1})});
  const Json content = content_json(*made.log);
  REQUIRE(content["ports"].size() == 3);
  CHECK(content["ports"][0]["port"] == "base.odometry");
  CHECK(content["ports"][0]["messages"] == 77);
  CHECK(content["ports"][0]["missing"] == 0);
  CHECK(content["ports"][1]["fields"] == "hash");
  REQUIRE(content["nodes"].size() == 3);
  CHECK(content["nodes"][1]["name"] == "filter");
  CHECK(content["nodes"][1]["jobs"] == 30);
  CHECK(content["lost"]["overwritten"] == 0);
  CHECK(content["damages"].empty());
  const std::string text = content_text(content);
  for (const char* words : {"base.odometry", "takt.grid", "lost: 0 messages overwritten", "content "}) {
    CAPTURE(words);
    CHECK(text.find(words) != std::string::npos);
  }
}

TEST_CASE("Equal runs have equal hashes and no difference; a changed parameter is found in what it changed") {
  Made a, b, other(2.5);
  CHECK(content_hash(*a.log) == content_hash(*b.log));
  CHECK(difference(*a.log, *b.log).same);
  CHECK(content_hash(*a.log) != content_hash(*other.log));
  const LogDifference difference = log::difference(*a.log, *other.log);
  CHECK_FALSE(difference.same);
  REQUIRE(difference.lines.size() == 2);  // the device is the same
  CHECK(difference.lines[0].find("filter.grid: 29 of 30 common messages differ; first 2: cell_m (byte 8) is") == 0);
  CHECK(difference.lines[1].find("reader.seen: 29 of 30 common messages differ") == 0);
}

TEST_CASE("A plan of today is the recorded one, or the first thing that differs is named") {
  test::SmallGraph graph, same, other;
  const Json recorded = plan_json(graph.plan);
  CHECK_FALSE(structure_differs(recorded, plan_json(same.plan)));
  CHECK(changed_params(recorded, plan_json(same.plan)).empty());
  CHECK(capacity_of(recorded, 1).width == 4);
  REQUIRE(other.filter.gain.set(3.0));
  CHECK_FALSE(structure_differs(recorded, plan_json(other.plan)));
  CHECK(changed_params(recorded, plan_json(other.plan)) == std::vector<std::string>{"filter.gain is 3 instead of 2"});
  SUBCASE("edge") {
    other.plan.tasks[1].edges[0].depth = 2;
    const auto differs = structure_differs(recorded, plan_json(other.plan));
    REQUIRE(differs);
    CHECK(differs->find("filter in the record is") == 0);
  }
  SUBCASE("capacity") {
    other.plan.ports[1].capacity.width = 5;
    const auto differs = structure_differs(recorded, plan_json(other.plan));
    REQUIRE(differs);
    CHECK(differs->find("filter.grid in the record is") == 0);
  }
  SUBCASE("tasks") {
    other.plan.tasks.pop_back();
    CHECK(structure_differs(recorded, plan_json(other.plan)) == "the record has 3 tasks, the graph 2");
  }
}

TEST_CASE("An export has every whole message in JSON, with a schema") {
  Made made({}, {.ports = test::with_fields({1, 1, 0})});
  auto sink = mcap::FileSink::open(made.folder.path / "export.mcap");
  REQUIRE(sink);
  const auto exported = export_log(*made.log, test::known_types(), json_encoding(), *sink);
  REQUIRE(exported);
  CHECK(exported->messages == 77 + 30);
  CHECK(exported->hash_only == 30);
  const auto reader = mcap::Reader::open(made.folder.path / "export.mcap");
  REQUIRE(reader);
  CHECK(reader->missing().empty());
  const auto channel = channel_of(*reader, "filter.grid");
  REQUIRE(channel);
  CHECK(channel->encoding == "json");
  const mcap::Schema& schema = reader->schemas()[channel->schema - 1U];
  CHECK(schema.name == "foxglove.Grid");
  CHECK(schema.encoding == "jsonschema");
  CHECK(Json::parse(schema.data)["properties"]["data"]["contentEncoding"] == "base64");
  size_t grids = 0;
  REQUIRE(reader->for_each([&](const mcap::Message& message) {
    if (message.channel != channel->id) return true;
    const Json json =
        Json::parse(std::string_view(reinterpret_cast<const char*>(message.data.data()), message.data.size()));
    CHECK(json["column_count"] == 4);
    CHECK(json["row_stride"] == 8);
    // Job 0: cells 0, 1 ... 7 as little-endian numbers of 16 bits.
    if (grids++ == 0) CHECK(json["data"] == "AAABAAIAAwAEAAUABgAHAA==");
    return true;
  }));
  CHECK(grids == 30);
  CHECK_FALSE(channel_of(*reader, "reader.seen"));
}

TEST_CASE("A record without its plan cannot be exported") {
  const test::TemporaryFolder folder;
  test::SmallGraph graph;
  auto sink = mcap::FileSink::open(folder.path / "run.mcap");
  REQUIRE(sink);
  test::record_run(graph.plan, *sink, 1);
  auto log = record::LogFile::open(folder.path / "run.mcap");
  REQUIRE(log);
  auto out = mcap::FileSink::open(folder.path / "export.mcap");
  const auto exported = export_log(*log, test::known_types(), json_encoding(), *out);
  REQUIRE_FALSE(exported);
  CHECK(exported.error() == "the record does not hold its plan");
}
