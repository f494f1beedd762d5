// SPDX-License-Identifier: Apache-2.0
// An own message, and two nodes that speak of it.
#pragma once
#include <takt/msg/field_list.hpp>
#include <takt/node.hpp>

/// What a thermometer measured.
struct Temperature {
  static constexpr std::string_view type_name = "temperature";
  double celsius = 0;
  uint32_t number = 0;
  TAKT_FIELDS(Temperature, (celsius, "degC"), (number, ""))
};

/// A temperature that rises by half a degree with each job.
class Oven final : public takt::Node {
 public:
  takt::Output<Temperature> inside{this, "inside", "temperature of the air"};
  void setup(takt::Setup&) override {}
  void run(takt::Job& job) override {
    Temperature* measured = inside.loan();
    if (!measured) return job.no_result();
    measured->celsius = 20 + 0.5 * static_cast<double>(job.index());
    measured->number = static_cast<uint32_t>(job.index());
    inside.send(job.release_ns());
  }
  void remember(takt::StateArchive&) override {}  // nothing from one job to the next
};

/// Passes on what is too hot.
class Alarm final : public takt::Node {
 public:
  takt::Input<Temperature> measured{this, "measured", "temperature to watch"};
  takt::Output<Temperature> hot{this, "hot", "those above the limit"};
  takt::Param<double> limit{this, "limit", 25.0, {0.0, 500.0}, "degC", "what is still right"};
  void setup(takt::Setup&) override {}
  void run(takt::Job&) override {
    if (measured.stale() || !measured.is_new() || measured.newest()->celsius <= limit()) return;
    if (Temperature* message = hot.loan()) {
      *message = *measured.newest();
      hot.send(measured.stamp_ns());
    }
  }
  void remember(takt::StateArchive&) override {}
};
