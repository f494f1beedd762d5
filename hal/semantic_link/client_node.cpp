// SPDX-License-Identifier: Apache-2.0
#include "hal/semantic_link/client_node.hpp"

#include "hal/base/must_stand.hpp"

namespace takt::semantic_link {

void ClientNode::setup(Setup& setup) {
  open_in_setup(setup);
  reserve(Kind::objects, objects_);
  reserve(Kind::scan, scan_);
  reserve(Kind::status, status_);
  link_.reserve({0, 0, 1, kLine});
}

void ClientNode::run(Job& job) {
  if (!running(job)) return job.no_result();
  command(job);
  give(Kind::action, action_);
  give(Kind::task, task_);
  end().flush();
  accept(end().read(), job);
  const int64_t oldest_ns = job.release_ns() - lag_ns_;
  pass(Kind::objects, objects_, oldest_ns);
  pass(Kind::scan, scan_, oldest_ns);
  pass(Kind::odometry, odometry_, oldest_ns);
  pass(Kind::outcome, outcome_, INT64_MIN);
  pass(Kind::status, status_, INT64_MIN);
  say(link_, job.release_ns());
}

void ClientNode::command(const Job& job) {
  VelocityCommand wanted;
  if (!must_stand(stop_, job.mode())) {
    if (velocity_.empty() || velocity_.stale()) return;
    wanted.speed_m_s = velocity_.newest()->speed_m_s;
    wanted.turn_rad_s = velocity_.newest()->turn_rad_s;
  }
  end().give(Kind::velocity, &wanted, job.release_ns());
}

}  // namespace takt::semantic_link
