// SPDX-License-Identifier: Apache-2.0
#include <doctest/doctest.h>

#include <cstdio>
#include <map>
#include <nlohmann/json.hpp>

#include "tests/conformance/dbc_file.hpp"
#include "tests/recorded/golden.hpp"
#include "tests/unit/head/golden_messages.hpp"

using namespace takt;
using namespace takt::can;
using namespace takt::test;

TEST_CASE("head messages: the whole collection of golden vectors, bit by bit") {
  const auto all = golden("can_head.json");
  const auto text = [](const nlohmann::json& value) { return value.get<std::string>(); };
  for (const auto& golden : all["frames"]) {
    const Message& message = message_of(text(golden["msg"]));
    CHECK(message.id == std::stoul(text(golden["can_id"]), nullptr, 16));
    check_golden(text(golden["id"]), message, golden.value("cnt", -1),
                 golden["phys"].get<std::map<std::string, double>>(), text(golden["data"]));
  }
  for (const auto& golden : all["negative"]) {
    INFO(text(golden["id"]));
    const Message& message = message_of(text(golden["msg"]));
    const Frame frame = frame_of(message, text(golden["data"]));
    const EndToEndStatus status = EndToEndReceiver().check(message, frame);
    std::array<double, kMostSignals> read{};
    CHECK((status == EndToEndStatus::wrong_crc) == (golden["expect"] == "WRONGCRC"));
    CHECK((status == EndToEndStatus::wrong_crc || status == EndToEndStatus::invalid || !decode(message, frame, read)));
  }
  size_t received = 0;
  for (const auto& golden : all["sequences"]) {
    INFO(text(golden["id"]));
    EndToEndReceiver receiver;
    for (size_t i = 0; i < golden["frames"].size(); ++i, ++received) {
      const std::string line = text(golden["frames"][i]);
      const Message& message = head::messages()[head::kPosStatus];
      // Where the collection refers to its note, the receiver has resynchronised on consecutive frames.
      const std::string expected = text(golden["expect"][i]) == "see note" ? "OK" : text(golden["expect"][i]);
      CHECK(word(receiver.check(message, frame_of(message, line.substr(line.find('#') + 1)))) == expected);
    }
  }
  std::printf("can_head.json: %zu frames both ways, %zu refused, %zu frames of %zu sequences judged\n",
              all["frames"].size(), all["negative"].size(), received, all["sequences"].size());
}

TEST_CASE("head messages: the table is that of the DBC file") {
  check_table(head::messages(), reference("golden/ace_head.dbc"));
}
