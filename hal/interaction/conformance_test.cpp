// SPDX-License-Identifier: Apache-2.0
#include <doctest/doctest.h>

#include "hal/interaction/console.hpp"
#include "hal/interaction/loudspeaker.hpp"
#include "hal/interaction/script.hpp"
#include "hal/interaction/speaking.hpp"
#include "hal/interaction/voice_double.hpp"
#include "hal/interaction/web.hpp"
#include "hal/interaction/web_double.hpp"
#include "tests/conformance/devices.hpp"
#include "tests/unit/interaction/fifo.hpp"

using namespace takt;

TEST_CASE("script and console conform") {
  ScriptedPerson script({{2 * test::kDevicePeriod, "goal cup_1.level=full"}, {4 * test::kDevicePeriod, "stop"}},
                        [](int64_t epoch_ns) { return epoch_ns; });
  test::check_interaction(script);
  const test::Fifo fifo;
  Console console("person", {fifo.in, fifo.out});
  test::check_interaction(console, [&](int64_t at_ns) {
    if (at_ns == test::kDeviceEpoch + 2 * test::kDevicePeriod) fifo.write("goal cup_1.level=full\n");
    if (at_ns == test::kDeviceEpoch + 4 * test::kDevicePeriod) fifo.write("stop\n");
  });
}

TEST_CASE("the robot's screen conforms, also with a loudspeaker, and with its double") {
  const auto answer = [](Interaction& screen) {
    return [&screen](int64_t at_ns) {
      if (at_ns == test::kDeviceEpoch + 2 * test::kDevicePeriod) CHECK(screen.answer("goal cup_1.level=full"));
      if (at_ns == test::kDeviceEpoch + 4 * test::kDevicePeriod) CHECK(screen.answer("stop"));
    };
  };
  WebScreen screen;
  CHECK(screen.takes_answers());
  test::check_interaction(screen, answer(screen));

  const test::TemporaryFolder folder;
  VirtualClock clock(test::kDeviceEpoch);
  SpeakingTo speaking(
      std::make_unique<WebScreen>(),
      std::make_unique<Loudspeaker>("person", std::make_unique<VoiceDouble>("person", folder.path / "said"), clock));
  CHECK(speaking.takes_answers());
  test::check_interaction(speaking, answer(speaking));

  auto line = std::make_shared<AnswerLine>();
  WebScreen doubled(line);
  WebDouble fingers({{2 * test::kDevicePeriod, "goal cup_1.level=full"}, {4 * test::kDevicePeriod, "stop"}}, line);
  fingers.begin(test::kDeviceEpoch);
  REQUIRE(fingers.plug_in().has_value());
  test::check_interaction(doubled, [&](int64_t at_ns) { fingers.run_to(at_ns); });
}
