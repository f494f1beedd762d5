// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "hal/sim/sim_devices.hpp"
#include "rt/msg/ace/object_reports.hpp"
#include "rt/msg/laser_scan.hpp"
#include "rt/msg/odometry.hpp"
#include "rt/msg/velocity_command.hpp"
#include "tests/conformance/semantic_link/rig.hpp"
#include "tests/unit/sim/small_world.hpp"

namespace takt::test {

/// The simulator: scanner and base of a small world; the base obeys the client.
class SimulatorFeed final : public Feed {
 public:
  SimulatorFeed() {
    simulation_->set_drive(sim::Drive::command);
    REQUIRE(laser_.open().has_value());
    REQUIRE(laser_.start(7'000'000'000).has_value());
    REQUIRE(base_.start(7'000'000'000).has_value());
  }
  void job(int64_t now_ns, const VelocityCommand& wanted, const Give& give) override {
    base_.command(wanted.speed_m_s, wanted.turn_rad_s, now_ns);
    const BaseReading reading = base_.read(now_ns, INT64_MAX);
    auto& odometry = *static_cast<Odometry*>(odometry_.message());
    odometry.x_m = reading.x_m, odometry.y_m = reading.y_m, odometry.theta_rad = reading.theta_rad;
    odometry.speed_m_s = speed_m_s = reading.speed_m_s;
    give(Kind::odometry, odometry_, reading.stamp_ns);
    auto& scan = *static_cast<LaserScan*>(scan_.message());
    const ScanFormat format = laser_.format();
    scan.range_m.resize(format.beams);
    const ScanReading sweep = laser_.read(scan.range_m.items(), now_ns, INT64_MAX);
    scan.scan_number = sweep.scan_number;
    scan.first_angle_rad = format.first_angle_rad, scan.step_rad = format.step_rad;
    scan.max_range_m = format.max_range_m, scan.sweep_s = format.sweep_s;
    give(Kind::scan, scan_, sweep.stamp_ns);
  }
  double speed_m_s = 0;

 private:
  std::unique_ptr<sim::Simulation> simulation_ = small_simulation();
  sim::SimLaser laser_{"laser", {}, *simulation_};
  sim::SimBase base_{"base", {}, *simulation_};
  Chunk scan_{info_of(Kind::scan)}, odometry_{info_of(Kind::odometry)};
};

/// As semantic processing would feed it: reports of many objects, their sizes changing, scans and odometry, and now and
/// then an outcome or a word about itself.
class MessageFeed final : public Feed {
 public:
  void job(int64_t now_ns, const VelocityCommand&, const Give& give) override {
    const uint32_t number = ++jobs_;
    const auto say = [&](Kind kind) {
      Chunk& chunk = chunks_[index_of(kind)];
      chunk.place();
      fill(kind, number, chunk.message());
      if (kind == Kind::objects) fill(*static_cast<ObjectReports*>(chunk.message()), number, 1 + number % 30);
      give(kind, chunk, now_ns - 3 * kMs);
    };
    say(Kind::odometry);
    if (number % 2 == 0) say(Kind::scan);
    if (number % 5 == 0) say(Kind::objects);
    if (number % 40 == 0) say(Kind::outcome);
    if (number % 60 == 0) say(Kind::status);
  }

 private:
  static std::vector<Chunk> all_chunks() {
    std::vector<Chunk> chunks;
    for (const MessageKind& info : semantic_link::message_kinds()) chunks.emplace_back(info);
    return chunks;
  }
  std::vector<Chunk> chunks_ = all_chunks();
  uint32_t jobs_ = 0;
};

}  // namespace takt::test
