// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "rt/node.hpp"
#include "rt/sched/run_board.hpp"

namespace takt {

/// Posts a value for parameter `param` of the node behind `mail`. False if another value is still on its way there, or
/// a text is too long for the mail. Any thread or process, one at a time.
bool post(ParamMail& mail, size_t param, const ParamValue& value, uint32_t by_user = 0);

/// Why a parameter that is not live cannot be set, and what to do: "is fixed while the graph runs (sizes memory); ...".
std::string fixed_text(const ParamBase& param);

/// Between two jobs, on the thread that runs the node: sets the parameter; or says in the mail why not, and returns
/// false. An accepted mail stays posted until all is noted that must outlive this process (Task::take_mail).
bool deliver(ParamMail& mail, Node& node);

/// Makes `value` the newest of a parameter, after its node accepted it. On the thread that runs the node.
void keep(KeptParam& kept, const PlainParam& value, int64_t at_ns);

/// Gives the node what was kept for it while an earlier process ran it. Before start(), on any thread.
void take_up(RunBoard& board, size_t task, Node& node);

ParamValue value_of(const PlainParam& plain);

}  // namespace takt
