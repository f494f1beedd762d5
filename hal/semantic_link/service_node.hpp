// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "hal/semantic_link/link_node.hpp"
#include "rt/msg/ace/action.hpp"
#include "rt/msg/ace/object_reports.hpp"
#include "rt/msg/ace/robot_task.hpp"
#include "rt/msg/laser_scan.hpp"
#include "rt/msg/odometry.hpp"
#include "rt/msg/text_status.hpp"
#include "rt/msg/velocity_command.hpp"

namespace takt::semantic_link {

/// Device kind `semantic_service`: one robot for a client that may be anywhere. Gives a velocity each job: the
/// client's, or zero while there is no client, or none that has said one for `watchdog`.
class ServiceNode final : public LinkNode {
 public:
  ServiceNode(std::unique_ptr<LinkDevice> device, int64_t watchdog_ns)
      : LinkNode(std::move(device)), watchdog_ns_(watchdog_ns) {}
  void setup(Setup& setup) override;
  void run(Job& job) override;
  /// A client's velocity keeps its stamp, and counts for so long.
  StampLaw stamp_law(const JobTimes&) override { return {watchdog_ns_, 0, 0, {}}; }

 private:
  void command(int64_t now_ns);

  int64_t watchdog_ns_;
  VelocityCommand wanted_;
  int64_t wanted_ns_ = 0;
  bool commanded_ = false;
  Input<ObjectReports> objects_{this, "objects", "objects that the robot knows or sees", Need::optional};
  Input<LaserScan> scan_{this, "scan", "sweeps of its scanner", Need::optional};
  Input<Odometry> odometry_{this, "odometry", "its pose and speeds", Need::optional};
  Input<ActionOutcome> outcome_{this, "outcome", "what became of the action", Need::optional};
  Input<TextStatus> status_{this, "status", "how it stands, for a person", Need::optional};
  Output<VelocityCommand> velocity_{this, "velocity", "the client's, or zero; each job"};
  Output<ActionCommand> action_{this, "action", "what the client wants done"};
  Output<RobotTask> task_{this, "task", "what somebody at the client wants"};
  Output<TextStatus> link_{this, "link", "who is attached, the clocks, what was counted"};
};

}  // namespace takt::semantic_link
