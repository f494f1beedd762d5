// SPDX-License-Identifier: Apache-2.0
#include "nodes/robot_client/state_machine.hpp"

#include <doctest/doctest.h>

#include <algorithm>
#include <vector>

using namespace takt::robot_client;
using enum State;

namespace {

struct Expected {
  Mode from;
  Event event;
  Mode to;
};

/// row by row; drive and action come back to whoever called them.
const std::vector<Expected> kThesis{
    {{idle}, Event::plan_task, {planning}},
    {{idle}, Event::drive_to, {drive, idle}},
    {{idle}, Event::perform_action, {action, idle}},
    {{planning}, Event::wait, {planning}},
    {{planning}, Event::plan_found, {execute}},
    {{planning}, Event::no_plan, {idle}},
    {{execute}, Event::drive_to, {drive, execute}},
    {{execute}, Event::perform_action, {action, execute}},
    {{execute}, Event::goal_reached, {idle}},
    {{drive, idle}, Event::wait, {drive, idle}},
    {{drive, execute}, Event::wait, {drive, execute}},
    {{drive, execute}, Event::arrived, {execute}},
    {{drive, idle}, Event::arrived, {idle}},
    {{action, idle}, Event::wait, {action, idle}},
    {{action, execute}, Event::wait, {action, execute}},
    {{action, execute}, Event::action_done, {execute}},
    {{action, idle}, Event::action_done, {idle}},
};
const std::vector<Expected> kOurs{
    {{execute}, Event::wait, {execute}},      {{execute}, Event::differs, {planning}},
    {{execute}, Event::failed, {idle}},       {{drive, execute}, Event::failed, {execute}},
    {{drive, idle}, Event::failed, {idle}},   {{action, execute}, Event::failed, {execute}},
    {{action, idle}, Event::failed, {idle}},  {{idle}, Event::stop, {idle}},
    {{planning}, Event::stop, {idle}},        {{execute}, Event::stop, {idle}},
    {{drive, execute}, Event::stop, {idle}},  {{drive, idle}, Event::stop, {idle}},
    {{action, execute}, Event::stop, {idle}}, {{action, idle}, Event::stop, {idle}},
};

}  // namespace

TEST_CASE("every row of the thesis's state machine, and every one of ours; nothing else can occur") {
  std::vector<Expected> all = kThesis;
  all.insert(all.end(), kOurs.begin(), kOurs.end());
  const Mode modes[] = {{idle},           {planning},     {execute},        {drive, idle},
                        {drive, execute}, {action, idle}, {action, execute}};
  size_t occurring = 0;
  for (const Mode& mode : modes)
    for (size_t e = 0; e < kEvents; ++e) {
      const auto event = static_cast<Event>(e);
      CAPTURE(to_string(mode.state));
      CAPTURE(to_string(event));
      const auto row =
          std::find_if(all.begin(), all.end(), [&](const Expected& x) { return x.from == mode && x.event == event; });
      const auto to = next(mode, event);
      CHECK(to.has_value() == (row != all.end()));
      if (to && row != all.end()) CHECK(*to == row->to);
      occurring += to ? 1 : 0;
    }
  CHECK(occurring == all.size());
}

TEST_CASE("the table says which rows are the thesis's") {
  const auto rows = transitions();
  CHECK(std::count_if(rows.begin(), rows.end(), [](const Row& row) { return !row.ours; }) == 13);
}
