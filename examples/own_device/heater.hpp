// SPDX-License-Identifier: Apache-2.0
// A node that uses the device: it heats a cold room, and never without a fresh temperature.
#pragma once
#include <takt/node.hpp>

#include "thermometer.hpp"

struct Heating {
  static constexpr std::string_view type_name = "heating";
  uint32_t on = 0;
  TAKT_FIELDS(Heating, (on, ""))
};

class Heater final : public takt::Node {
 public:
  takt::Input<Temperature> room{this, "room", "temperature of the room"};
  takt::Output<Heating> heating{this, "heating", "1: heats; with every job"};
  takt::Param<double> below{this, "below", 21.0, {0.0, 40.0}, "degC", "it heats below this"};
  void setup(takt::Setup&) override {}
  void run(takt::Job& job) override {
    Heating* message = heating.loan();
    if (message == nullptr) return job.no_result();
    message->on = !room.stale() && room.newest()->celsius < below() ? 1 : 0;
    heating.send(job.release_ns());
  }
  void remember(takt::StateArchive&) override {}
};
