// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <takt/msg/velocity_command.hpp>
#include <takt/node.hpp>

/// Lets a speed change no faster than a limit allows.
class Smoother final : public takt::Node {
 public:
  takt::Input<takt::VelocityCommand> in{this, "in", "wanted speed"};
  takt::Output<takt::VelocityCommand> out{this, "out", "speed that follows it"};
  takt::Param<double> step{this, "step", 0.1, {0.001, 10.0}, "m/s", "largest change from one job to the next"};

  void setup(takt::Setup&) override {}
  void run(takt::Job& job) override;
  void remember(takt::StateArchive& archive) override { TAKT_STATE(archive, speed_m_s_); }

 private:
  double speed_m_s_ = 0;
};
