// SPDX-License-Identifier: Apache-2.0
#include "rt/supervise/restart_policy.hpp"

#include <algorithm>

namespace takt {

std::optional<int64_t> RestartPolicy::ended(int64_t now_ns) {
  ends_.push_back(now_ns);
  while (ends_.front() <= now_ns - limits_.window_ns) ends_.pop_front();
  if (ends_.size() >= limits_.most_in_window) return std::nullopt;
  const bool calm = ends_.size() == 1 || now_ns - started_ns_ >= limits_.calm_ns;
  if (calm) wait_ns_ = limits_.first_wait_ns;
  else wait_ns_ = std::min(limits_.most_ns, std::max(limits_.step_ns, 2 * wait_ns_));
  return now_ns + wait_ns_;
}

}  // namespace takt
