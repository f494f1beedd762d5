// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "hal/semantic_link/link_node.hpp"
#include "rt/msg/ace/action.hpp"
#include "rt/msg/ace/object_reports.hpp"
#include "rt/msg/ace/robot_task.hpp"
#include "rt/msg/ace/stop_command.hpp"
#include "rt/msg/laser_scan.hpp"
#include "rt/msg/odometry.hpp"
#include "rt/msg/text_status.hpp"
#include "rt/msg/velocity_command.hpp"

namespace takt::semantic_link {

/// Device kind `semantic_link`: a robot that is elsewhere, simulated or real. Says the newest velocity each job, so
/// that silence means stop; zero where the robot must stand.
class ClientNode final : public LinkNode {
 public:
  /// Objects, scans and odometry that are older than `lag_ns` at a release are not sent.
  ClientNode(std::unique_ptr<LinkDevice> device, int64_t lag_ns) : LinkNode(std::move(device)), lag_ns_(lag_ns) {}
  void setup(Setup& setup) override;
  void run(Job& job) override;
  StampLaw stamp_law(const JobTimes&) override { return {lag_ns_, 0, 0, {}}; }

 private:
  void command(const Job& job);

  int64_t lag_ns_;
  Input<VelocityCommand> velocity_{this, "velocity", "wanted speeds", Need::optional};
  Input<ActionCommand> action_{this, "action", "what is to be done", Need::optional};
  Input<RobotTask> task_{this, "task", "what somebody wants, for the robot's own mind", Need::optional};
  Input<StopCommand> stop_{this, "stop", "drive only while it says so", Need::optional};
  Output<ObjectReports> objects_{this, "objects", "objects that the robot knows or sees"};
  Output<LaserScan> scan_{this, "scan", "newest sweep of its scanner"};
  Output<Odometry> odometry_{this, "odometry", "its pose and speeds"};
  Output<ActionOutcome> outcome_{this, "outcome", "what became of the action"};
  Output<TextStatus> status_{this, "status", "how it stands, for a person"};
  Output<TextStatus> link_{this, "link", "whether it is attached, the clocks, what was counted"};
};

}  // namespace takt::semantic_link
