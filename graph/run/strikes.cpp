// SPDX-License-Identifier: Apache-2.0
#include "graph/run/strikes.hpp"

#include <algorithm>
#include <csignal>

namespace takt::command {

void Strikes::strike(int64_t now_ns) {
  for (const graph::ProcessStrike& strike : faults_.due(now_ns)) {
    const auto named = std::find(partition_.names.begin(), partition_.names.end(), strike.process);
    const auto p = static_cast<size_t>(named - partition_.names.begin());
    if (p == partition_.names.size() || group_.pid(p) == 0) continue;  // away already
    faults_.count(strike);
    if (strike.kind == graph::FaultKind::kill_at_step) order(p, strike);
    else kill(group_.pid(p), strike.kind == graph::FaultKind::kill ? SIGKILL : SIGSTOP);
    if (strike.kind == graph::FaultKind::stop_process) stopped_.push_back({group_.pid(p), now_ns + strike.for_ns});
  }
  std::erase_if(stopped_,
                [&](const auto& stopped) { return now_ns >= stopped.second && (kill(stopped.first, SIGCONT), true); });
}

void Strikes::order(size_t process, const graph::ProcessStrike& strike) {
  KillOrder& order = board_.process(process).kill;
  for (size_t port = 0; port < plan_.ports.size(); ++port)
    if (plan_.ports[port].node + "." + plan_.ports[port].port == strike.output)
      order.port.store(static_cast<uint32_t>(port));
  order.passes.store(strike.passes);
  order.step.store(strike.step);
}

}  // namespace takt::command
