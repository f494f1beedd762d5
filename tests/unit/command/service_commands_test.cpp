// SPDX-License-Identifier: Apache-2.0
#include "graph/command/service_commands.hpp"

#include <doctest/doctest.h>

using namespace takt::command;

namespace {

constexpr const char* kShown =
    "Result=success\nNRestarts=0\nStatusText=mode "
    "full\nId=takt@ace.service\nLoadState=loaded\nActiveState=active\nSubState=running\n"
    "ActiveEnterTimestamp=Mon 2026-11-30 08:12:01 UTC\n\n"
    "Result=watchdog\nNRestarts=5\nStatusText=mode full; not fed: stereo missed a "
    "deadline\nId=takt@yard.service\nLoadState=loaded\n"
    "ActiveState=failed\nSubState=failed\nActiveEnterTimestamp=\n\n"
    "Id=ssh.service\nActiveState=active\n\n"
    "Id=takt@none.service\nLoadState=not-found\nActiveState=inactive\n";

}  // namespace

TEST_CASE("services of takt, as systemctl shows them; others, and those that are not there, are passed over") {
  const auto all = services(kShown);
  REQUIRE(all.size() == 2);
  CHECK(service_text(all[0]) == "ace: active (running) since Mon 2026-11-30 08:12:01 UTC; mode full");
  CHECK(all[0].runs());
  CHECK(service_text(all[1]) ==
        "yard: failed (watchdog), restarted 5 times; mode full; not fed: stereo missed a deadline");
  CHECK(!all[1].runs());
  CHECK(services("").empty());
  CHECK(services("Id\n=\nNRestarts=x\n\n\n").empty());
}
