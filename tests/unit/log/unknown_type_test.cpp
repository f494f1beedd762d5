// SPDX-License-Identifier: Apache-2.0
// Records of message types that the rooms of `takt` do not know: this program alone declares them.
#include <doctest/doctest.h>

#include <algorithm>
#include <cstddef>
#include <optional>

#include "graph/log/cut_log.hpp"
#include "graph/log/echo_log.hpp"
#include "graph/log/export_log.hpp"
#include "graph/log/log_content.hpp"
#include "graph/log/recorded_type.hpp"
#include "tests/temporary_folder.hpp"
#include "tests/unit/log/known_types.hpp"
#include "tests/unit/record/recorded_run.hpp"

using namespace takt;
using namespace takt::log;

namespace {

struct Wheel {
  static constexpr std::string_view type_name = "wheel";
  double speed_m_s = 0;
  int32_t ticks[2] = {};
  Array<float> current_a;
  Array<char> note;
  TAKT_FIELDS(Wheel, (speed_m_s, "m/s"), (ticks, "1"), (current_a, "A"), (note, ""))
};

/// A type of that name is known to this program, with other fields.
struct OtherGrid : Wheel {
  static constexpr std::string_view type_name = "grid";
};

/// Another declaration of the name.
struct OtherWheel {
  static constexpr std::string_view type_name = "wheel";
  int32_t turns = 0;
  TAKT_FIELDS(OtherWheel, (turns, "1"))
};

template <class Message>
struct WheelDevice final : Node {
  Output<Message> wheel{this, "wheel", ""};
  double speed_m_s = 1.5;
  void setup(Setup&) override {}
  void run(Job& job) override {
    Message* message = wheel.loan();
    if (message == nullptr) return;
    message->speed_m_s = speed_m_s;
    message->ticks[1] = static_cast<int32_t>(job.index());
    message->current_a.push_back(0.25f);
    for (const char letter : {'o', 'k', '\xff'}) message->note.push_back(letter);
    wheel.send(job.release_ns());
  }
};

/// One second of a wheel at 10 Hz.
template <class Message = Wheel>
struct WheelRun {
  test::TemporaryFolder folder;
  std::optional<record::LogFile> log;
  explicit WheelRun(double speed_m_s = 1.5, std::vector<char> whole = {}) {
    WheelDevice<Message> device;
    device.speed_m_s = speed_m_s;
    Plan plan;
    test::add_task(plan, device, "left", 0, {0, 0, 1, 4});
    plan.ports[0].port = "wheel";
    plan.ports[0].history = plan.ports[0].held = 4;
    const std::string text = plan_json(plan).dump();
    auto sink = mcap::FileSink::open(folder.path / "run.mcap");
    REQUIRE(sink);
    test::record_run(plan, *sink, 1, {.ports = test::with_fields(whole)},
                     {{}, {{0, 0, "plan.json", "application/json", mcap::bytes_of(text)}}});
    log.emplace(open("run.mcap"));
  }
  record::LogFile open(const char* name) const {
    auto opened = record::LogFile::open(folder.path / name);
    REQUIRE_MESSAGE(opened, opened.error());
    return std::move(*opened);
  }
  Exported exported() {
    auto sink = mcap::FileSink::open(folder.path / "export.mcap");
    REQUIRE(sink);
    const auto done = export_log(*log, test::known_types(), json_encoding(), *sink);
    REQUIRE_MESSAGE(done, done.error());
    return *done;
  }
};

/// The messages of an export as JSON, and the schema of the first channel.
struct Read {
  std::vector<Json> messages;
  std::string schema_name;
  Json schema;
};

Read read_export(const std::filesystem::path& file) {
  const auto reader = mcap::Reader::open(file);
  REQUIRE(reader);
  Read read;
  REQUIRE(reader->schemas().size() == 1);
  read.schema_name = reader->schemas()[0].name;
  read.schema = Json::parse(reader->schemas()[0].data);
  REQUIRE(reader->for_each([&](const mcap::Message& message) {
    read.messages.push_back(
        Json::parse(std::string_view(reinterpret_cast<const char*>(message.data.data()), message.data.size())));
    return true;
  }));
  return read;
}

tl::expected<RecordedType, std::string> described(const std::string& layout) {
  return RecordedType::read({1, "takt.wheel", "json", layout});
}

}  // namespace

TEST_CASE("An unknown type is exported by its own fields, and named") {
  WheelRun made;
  const Exported exported = made.exported();
  CHECK(exported.messages == 10);
  CHECK(exported.unreadable == 0);
  CHECK(exported.own_fields == std::set<std::string>{"wheel"});
  const Read read = read_export(made.folder.path / "export.mcap");
  REQUIRE(read.messages.size() == 10);
  const Json& third = read.messages[2];
  CHECK(third["speed_m_s"] == 1.5);
  CHECK(third["ticks"] == Json({0, 2}));
  CHECK(third["current_a"] == Json{{"size", 1}, {"first", {0.25}}});
  CHECK(third["note"] == "ok\uFFFD");  // what is no UTF-8 is replaced
  CHECK(third["timestamp"]["sec"] == 1);
  CHECK(read.schema_name == "takt.wheel");
  const Json& properties = read.schema["properties"];
  CHECK(properties["speed_m_s"] == Json{{"type", "number"}, {"description", "m/s"}});
  CHECK(properties["ticks"]["items"]["type"] == "integer");
  CHECK(properties["current_a"]["properties"]["first"]["items"]["type"] == "number");
  CHECK(properties["note"]["type"] == "string");
}

TEST_CASE("A type of a known name with other fields is exported by those that the record describes") {
  WheelRun<OtherGrid> made;
  CHECK(made.exported().own_fields == std::set<std::string>{"grid"});
  const Read read = read_export(made.folder.path / "export.mcap");
  CHECK(read.schema_name == "takt.grid");
  REQUIRE(read.messages.size() == 10);
  CHECK(read.messages[0]["speed_m_s"] == 1.5);
}

TEST_CASE("The content, a cut and the differences of records of an unknown type") {
  WheelRun made, faster(2.5);
  const Json content = content_json(*made.log);
  CHECK(content["ports"][0]["type"] == "takt.wheel");
  CHECK(content["ports"][0]["messages"] == 10);
  const LogDifference apart = difference(*made.log, *faster.log);
  CHECK_FALSE(apart.same);
  REQUIRE(apart.lines.size() == 1);
  CHECK(apart.lines[0] ==
        "left.wheel: 10 of 10 common messages differ; first 1: speed_m_s (byte 6) is 2.5 instead of 1.5");
  {
    auto sink = mcap::FileSink::open(made.folder.path / "cut.mcap");
    REQUIRE(sink);
    const int64_t start = epoch_ns(*made.log);
    REQUIRE(cut_log(*made.log, start + 200'000'000, start + 500'000'000, *sink));
  }
  made.log.emplace(made.open("cut.mcap"));
  const uint64_t kept = content_json(*made.log)["ports"][0]["messages"];
  CHECK(kept >= 3);
  CHECK(kept < 10);
  CHECK(made.exported().messages == kept);
}

TEST_CASE(
    "An echo gives all fields of an unknown type, as many elements as asked for, and names the ports that there are") {
  WheelRun made;
  const std::string left[]{"left.wheel"}, wrong[]{"left.weel"};
  std::vector<Json> lines;
  const auto keep = [&](const Json& line) { lines.push_back(line); };
  const auto echoed = echo_log(*made.log, left, 8, keep);
  REQUIRE(echoed);
  CHECK(echoed->messages == 10);
  CHECK(echoed->hash_only == 0);
  CHECK(echoed->unreadable == 0);
  REQUIRE(lines.size() == 10);
  CHECK(lines[2]["type"] == "wheel");
  CHECK(lines[2]["sequence"] == 3);
  CHECK(
      lines[2]["message"] ==
      Json{{"speed_m_s", 1.5}, {"ticks", {0, 2}}, {"current_a", {{"size", 1}, {"first", {0.25}}}}, {"note", "ok\xff"}});
  REQUIRE(echo_log(*made.log, {}, 0, keep));
  REQUIRE(lines.size() == 20);
  CHECK(lines[10]["message"]["current_a"] == Json{{"size", 1}, {"first", Json::array()}});
  const auto refused = echo_log(*made.log, wrong, 8, keep);
  REQUIRE_FALSE(refused);
  CHECK(refused.error() ==
        "the record has no output `left.weel`; did you mean `left.wheel`? outputs of this record: left.wheel");
}

TEST_CASE("An echo has the hash of a message that was recorded by it") {
  WheelRun made(1.5, {0});
  size_t hashes = 0;
  const auto echoed = echo_log(*made.log, {}, 8, [&](const Json& line) {
    hashes += line["hash"].get<std::string>().size() == 16 && !line.contains("message");
  });
  REQUIRE(echoed);
  CHECK(echoed->hash_only == 10);
  CHECK(hashes == 10);
}

TEST_CASE("Two records that describe one type by other fields are not compared number by number") {
  WheelRun<OtherGrid> wheel;
  struct GridDevice final : Node {
    Output<Grid> wheel{this, "wheel", ""};
    void setup(Setup&) override {}
    void run(Job& job) override {
      if (wheel.loan() != nullptr) wheel.send(job.release_ns());
    }
  } device;
  Plan plan;
  test::add_task(plan, device, "left", 0, {0, 0, 1, 4});
  plan.ports[0].port = "wheel";
  plan.ports[0].history = plan.ports[0].held = 4;
  const std::string text = plan_json(plan).dump();
  {
    auto sink = mcap::FileSink::open(wheel.folder.path / "grid.mcap");
    REQUIRE(sink);
    test::record_run(plan, *sink, 1, {}, {{}, {{0, 0, "plan.json", "application/json", mcap::bytes_of(text)}}});
  }
  record::LogFile grid = wheel.open("grid.mcap");
  const LogDifference apart = difference(*wheel.log, grid);
  REQUIRE(apart.lines.size() == 1);
  CHECK(apart.lines[0].ends_with(": grid has other fields in the second"));
}

TEST_CASE("Two types of one name in one record keep their fields") {
  const test::TemporaryFolder folder;
  WheelDevice<Wheel> wheel;
  struct OtherDevice final : Node {
    Output<OtherWheel> wheel{this, "wheel", ""};
    void setup(Setup&) override {}
    void run(Job& job) override {
      OtherWheel* message = wheel.loan();
      if (message == nullptr) return;
      message->turns = static_cast<int32_t>(job.index());
      wheel.send(job.release_ns());
    }
  } other;
  Plan plan;
  test::add_task(plan, wheel, "left", 0, {0, 0, 1, 4});
  test::add_task(plan, other, "right", 50'000'000);
  for (PortPlan& port : plan.ports) port.port = "wheel", port.history = port.held = 4;
  {
    auto sink = mcap::FileSink::open(folder.path / "run.mcap");
    REQUIRE(sink);
    test::record_run(plan, *sink, 1);
  }
  const auto log = record::LogFile::open(folder.path / "run.mcap");
  REQUIRE(log);
  std::vector<Json> lines;
  const auto echoed = echo_log(*log, {}, 8, [&](const Json& line) { lines.push_back(line); });
  REQUIRE(echoed);
  CHECK(echoed->unreadable == 0);
  REQUIRE(lines.size() == 20);
  CHECK(lines[0]["message"]["speed_m_s"] == 1.5);
  CHECK(lines[3]["message"] == Json{{"turns", 1}});
}

TEST_CASE("A recorded type that cannot be understood names the field at fault") {
  const auto fault = [](const std::string& layout) {
    const auto type = described(layout);
    REQUIRE_FALSE(type);
    return type.error();
  };
  CHECK(fault("no JSON") == "takt.wheel: the record does not list the fields of this type");
  CHECK(fault(R"({"fields": []})") == "takt.wheel: the record does not list the fields of this type");
  CHECK(fault(R"({"fields": [{"name": "a", "unit": ""}]})") == "takt.wheel: field 1 lacks its name, unit or scalar");
  CHECK(fault(R"({"fields": [{"name": "a", "unit": "", "scalar": "f16", "count": 1}]})")
            .starts_with("takt.wheel: field 1 (a) has scalars of type f16, which is none of u8"));
  for (const char* number :
       {R"("count": 0)", R"("count": -1)", R"("count": 1, "array_of": 1)", R"("count": 4000000000)"})
    CHECK(fault(R"({"fields": [{"name": "a", "unit": "", "scalar": "u8", )" + std::string(number) + "}]}") ==
          "takt.wheel: field 1 (a) must state either its count or what it is an array of");
  const auto type = described(record::layout_of(MessageType::of<Wheel>()));
  REQUIRE(type);
  CHECK(type->name() == "wheel");
  CHECK(type->same_fields(Wheel::fields()));
  CHECK(type->fields()[3].text);
  CHECK_FALSE(type->fields()[2].text);
}
