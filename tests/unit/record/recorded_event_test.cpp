// SPDX-License-Identifier: Apache-2.0
#include "rt/record/recorded_event.hpp"

#include <doctest/doctest.h>

using namespace takt;
using namespace takt::record;

namespace {

const std::vector<RecordedEvent>& all_known() {
  static const std::vector<RecordedEvent> events{
      {1, 3, 70'000, 5'000, Restart{2, 0, {{0, 7, 9}, {1, 0, 0}}, {{4, 12}}, {{1, 0.5}, {3, std::string("words")}}}},
      {2, 3, 70'001, 6'000, ParameterSet{1, ParamValue(std::string("half a word")), "uid 1000"}},
      {2, 0, 1, 6'000, ParameterSet{0, ParamValue(false), ""}},
      {3, RecordedEvent::kNoTask, 0, 7'000, ModeChange{2, "deadline missed"}},
      {9, 2, 70'002, 8'000, LogSaid{2, 17, "only 3 of 8 points fit"}}};
  return events;
}

}  // namespace

TEST_CASE("An event that is packed and unpacked is the same") {
  for (const RecordedEvent& event : all_known()) {
    std::vector<std::byte> packed;
    pack(event, packed);
    const auto again = unpack_event(packed);
    REQUIRE(again);
    CHECK(*again == event);
    // A later program may have more to say of it.
    packed.push_back({});
    REQUIRE(unpack_event(packed));
    CHECK(*unpack_event(packed) == event);
  }
}

TEST_CASE("An event of a known kind that ends too early is refused, wherever it ends") {
  for (const RecordedEvent& event : all_known()) {
    std::vector<std::byte> packed;
    pack(event, packed);
    for (size_t length = 0; length < packed.size(); ++length)
      CHECK_FALSE(unpack_event(std::span(packed).first(length)));
  }
}

TEST_CASE("Kinds that this program does not know are passed over, and named") {
  for (const int number : {4, 7, 8, 10, 99, 65535}) {
    const auto kind = static_cast<uint16_t>(number);
    std::vector<std::byte> packed;
    pack(RecordedEvent{kind, 1, 2, 3, {}}, packed);
    packed.resize(packed.size() + 40, std::byte{0xff});
    const auto event = unpack_event(packed);
    REQUIRE(event);
    CHECK(event->kind == kind);
    CHECK(event->at_ns == 3);
    CHECK(std::holds_alternative<std::monostate>(event->what));
  }
  CHECK(name_of(1) == "restart");
  CHECK(name_of(4) == "reserved kind 4 (request)");
  CHECK(name_of(5) == "mark");
  CHECK(name_of(6) == "snapshot");
  CHECK(name_of(8) == "reserved kind 8 (level)");
  CHECK(name_of(9) == "log");
  CHECK(name_of(10) == "unknown kind 10");
  CHECK(name_of(0) == "unknown kind 0");
}
