// SPDX-License-Identifier: Apache-2.0
#include "hal/semantic_link/service_node.hpp"

namespace takt::semantic_link {

void ServiceNode::setup(Setup& setup) {
  open_in_setup(setup);
  reserve(Kind::task, task_);
  link_.reserve({0, 0, 1, kLine});
  commanded_ = false;
}

void ServiceNode::run(Job& job) {
  if (!running(job)) return job.no_result();
  give(Kind::objects, objects_);
  give(Kind::scan, scan_);
  give(Kind::odometry, odometry_);
  give(Kind::outcome, outcome_);
  give(Kind::status, status_);
  end().flush();
  accept(end().read(), job);
  command(job.release_ns());
  pass(Kind::action, action_, INT64_MIN);
  pass(Kind::task, task_, INT64_MIN);
  say(link_, job.release_ns());
}

void ServiceNode::command(int64_t now_ns) {
  if (const Parcel* parcel = end().take(Kind::velocity)) {
    commanded_ = LinkDevice::unpack(Kind::velocity, *parcel, &wanted_);
    wanted_ns_ = parcel->stamp_ns;
  }
  VelocityCommand* message = velocity_.loan();
  if (message == nullptr) return;
  const bool fresh = commanded_ && end().attached() && now_ns - wanted_ns_ <= watchdog_ns_;
  message->speed_m_s = fresh ? wanted_.speed_m_s : 0;
  message->turn_rad_s = fresh ? wanted_.turn_rad_s : 0;
  velocity_.send(fresh ? wanted_ns_ : now_ns);
}

}  // namespace takt::semantic_link
