// SPDX-License-Identifier: Apache-2.0
// A node for the stock `takt`: built as a shared library that a graph names.
#include <takt/msg/velocity_command.hpp>
#include <takt/plugin.hpp>

class Halve final : public takt::Node {
 public:
  takt::Input<takt::VelocityCommand> in{this, "in", "wanted speeds"};
  takt::Output<takt::VelocityCommand> out{this, "out", "half of them"};
  void setup(takt::Setup&) override {}
  void run(takt::Job& job) override {
    takt::VelocityCommand* command = in.stale() ? nullptr : out.loan();
    if (!command) return job.no_result();
    command->speed_m_s = in.newest()->speed_m_s / 2;
    command->turn_rad_s = in.newest()->turn_rad_s / 2;
    out.send(in.stamp_ns());
  }
  void remember(takt::StateArchive&) override {}
};

void register_halve(takt::Registry& registry) {
  registry.nodes.add<Halve>("halve", takt::Layer::processing, "halves speeds");
}
TAKT_PLUGIN(register_halve)
