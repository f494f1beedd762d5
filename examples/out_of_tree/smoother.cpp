// SPDX-License-Identifier: Apache-2.0
#include "smoother.hpp"

#include <algorithm>

void Smoother::run(takt::Job& job) {
  if (in.stale()) return job.no_result();
  speed_m_s_ += std::clamp(in.newest()->speed_m_s - speed_m_s_, -step(), step());
  if (takt::VelocityCommand* command = out.loan()) {
    command->speed_m_s = speed_m_s_;
    out.send(in.stamp_ns());
  }
}
