// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <doctest/doctest.h>

#include <cstring>

#include "hal/sim/simulation.hpp"
#include "rt/msg/ace/action.hpp"
#include "tests/nanoseconds.hpp"
#include "tests/temporary_folder.hpp"

namespace takt::test {

constexpr int64_t kEpoch = 5 * kSecond;

/// A room of 7 m x 6 m in which the robots ace and bea both reach a cup, a bottle and a table; a door stands open, a
/// crate is out of reach. `more` may bring events and objects.
inline std::string acting_xml(const std::string& more = "") {
  std::string rows;
  for (int y = 0; y < 12; ++y)
    rows += (y == 0 || y == 11 ? std::string(14, '#') : "#" + std::string(12, '.') + "#") + "\n";
  return "<world name=\"acting\" resolution=\"0.5m\"><rows>\n" + rows + R"(</rows>
<client name="ace" x="1.5m" y="2.7m"/><client name="bea" x="1.5m" y="3.8m"/>
<object name="cup" type="cup" x="1.95m" y="3.25m"><box z="0.7m" width="0.1m" depth="0.1m" height="0.12m" material="red_stripes"/>
  <attr name="level" value="empty"/>
  <look when="level=full"><box z="0.7m" width="0.1m" depth="0.1m" height="0.12m" material="blue_stripes"/></look></object>
<object name="bottle" type="bottle" x="2.05m" y="3.35m"><box z="0.7m" width="0.1m" depth="0.1m" height="0.3m"/>
  <attr name="level" value="full"/><attr name="closed" value="true"/></object>
<object name="table" type="table" x="0.95m" y="3.25m"><box width="0.3m" depth="0.3m" height="0.7m"/></object>
<object name="crate" type="crate" x="5.5m" y="5m"><box width="0.5m" depth="0.5m" height="0.5m"/></object>
<object name="door" type="door" x="4m" y="2.7m"><attr name="closed" value="false"/>
  <look when="closed=true"><box width="0.1m" depth="1m" height="2m"/></look></object>
<action name="open" cost="1s"><role name="bottle" type="bottle"/>
  <pre role="bottle" attr="closed" value="true"/><post role="bottle" attr="closed" value="false"/></action>
<action name="fill" cost="2s"><role name="vessel" type="cup"/><role name="source" type="bottle"/>
  <pre role="vessel" attr="level" value="empty"/><pre role="source" attr="level" value="full"/>
  <pre role="source" attr="closed" value="false"/>
  <post role="vessel" attr="level" value="full"/><post role="source" attr="level" value="empty"/></action>
<action name="take" cost="500ms"><role name="vessel" type="cup"/><move role="vessel" to="robot"/></action>
<action name="put" cost="500ms"><role name="vessel" type="cup"/><role name="onto" type="table"/>
  <move role="vessel" to="onto"/></action>
<action name="drop" cost="0s"><role name="vessel" type="cup"/><move role="vessel" to="away"/></action>
<action name="move_crate" cost="1s"><role name="crate" type="crate"/><move role="crate" to="away"/></action>
<action name="call" cost="1s" reach="4.3m"><role name="crate" type="crate"/></action>
<action name="whisper" cost="1s" reach="4.2m"><role name="crate" type="crate"/></action>
)" + more +
         "</world>";
}

inline std::shared_ptr<sim::Stage> acting_stage(const std::string& more = "", uint64_t seed = 3) {
  const TemporaryFolder folder;
  auto stage = sim::Stage::load("world", folder.write("acting.xml", acting_xml(more)), seed);
  REQUIRE_MESSAGE(stage.has_value(), (stage ? "" : stage.error().text()));
  return *stage;
}

inline ActionCommand action_command(uint32_t number, const char* action, const char* first, const char* second = "") {
  ActionCommand command;
  command.number = number;
  std::strncpy(command.action, action, sizeof command.action - 1);
  std::strncpy(command.objects[0], first, sizeof command.objects[0] - 1);
  std::strncpy(command.objects[1], second, sizeof command.objects[1] - 1);
  return command;
}

}  // namespace takt::test
