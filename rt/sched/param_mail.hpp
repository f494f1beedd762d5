// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "rt/node.hpp"
#include "rt/sched/run_board.hpp"

namespace takt {

/// Posts a value for parameter `param` of the node behind `mail`. False if another value is still on its way there, or
/// a text is too long for the mail. Any thread or process, one at a time.
bool post(ParamMail& mail, size_t param, const ParamValue& value);

/// Between two jobs, on the thread that runs the node: sets the parameter, or says in the mail why not.
void deliver(ParamMail& mail, Node& node);

}  // namespace takt
