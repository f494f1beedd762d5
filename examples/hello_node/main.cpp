// SPDX-License-Identifier: Apache-2.0
// Two nodes and an edge between them, without a graph file.
#include <cstdio>
#include <takt/assembly.hpp>
#include <takt/msg/velocity_command.hpp>

struct Pilot : takt::Node {
  takt::Output<takt::VelocityCommand> wanted{this, "wanted", "a little faster with each job"};
  void setup(takt::Setup&) override {}
  void run(takt::Job& job) override {
    wanted.loan()->speed_m_s = 0.125 * static_cast<double>(job.index());
    wanted.send(job.release_ns());
  }
};

struct Wheels : takt::Node {
  takt::Input<takt::VelocityCommand> wanted{this, "wanted", "speed to drive at"};
  int jobs = 0;
  double speed_m_s = 0;
  void setup(takt::Setup&) override {}
  void run(takt::Job&) override {  // no printing in here: a job makes no system calls
    ++jobs;
    if (wanted.newest()) speed_m_s = wanted.newest()->speed_m_s;
  }
  void finish() override { std::printf("%d jobs, at last %g m/s\n", jobs, speed_m_s); }
};

int main() {
  takt::Assembly robot;
  auto& pilot = robot.add<Pilot>("pilot", {.rate = takt::Rate{20, 1}});
  auto& wheels = robot.add<Wheels>("wheels", {});
  robot.connect(pilot.wanted, wheels.wanted, {.triggers = true});
  robot.run({.duration_ns = 1'000'000'000});
}
