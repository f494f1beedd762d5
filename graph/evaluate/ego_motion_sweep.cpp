// SPDX-License-Identifier: Apache-2.0
#include "graph/evaluate/ego_motion_sweep.hpp"

#include <algorithm>
#include <cstdio>

#include "graph/evaluate/ego_motion_drive.hpp"
#include "graph/evaluate/ego_motion_picture.hpp"
#include "graph/evaluate/ego_motion_score.hpp"
#include "nodes/ego_motion/evaluate.hpp"
#include "nodes/picture/curves.hpp"

namespace takt::command {
namespace {

using ego_motion::Parameters;
using Json = nlohmann::ordered_json;

struct Sweep {
  std::string name, what;
  std::vector<double> values;
  void (*set)(Parameters& p, double value);
};

/// sigma and r_const act on a search within one window only, r_min on the flow filter only.
const std::vector<Sweep>& sweeps() {
  static const std::vector<Sweep> list{
      {"sigma",
       "growth of the search window with the disparity, predict: constant_velocity",
       {0, 0.1, 0.2, 0.4, 0.8, 1.6},
       [](Parameters& p, double value) {
         p.predict = ego_motion::Predict::constant_velocity;
         p.sigma = value;
       }},
      {"r_const",
       "search window at disparity 0 in px, predict: constant_velocity",
       {5, 10, 20, 30, 40, 60, 80},
       [](Parameters& p, double value) {
         p.predict = ego_motion::Predict::constant_velocity;
         p.r_const = value;
       }},
      {"search",
       "edge of the matching block (n_search) in px",
       {3, 5, 7, 9, 11, 13, 15},
       [](Parameters& p, double value) { p.n_search = static_cast<int>(value); }},
      {"r_min",
       "radius of the flow filter's neighbourhood in px",
       {5, 10, 20, 30, 40, 60, 100},
       [](Parameters& p, double value) {
         p.flow_filter = true;
         p.flow.r_min_px = value;
       }},
      {"corners",
       "most corners of an image",
       {50, 100, 200, 500, 800, 1500, 3000},
       [](Parameters& p, double value) { p.corners.maximum = static_cast<int>(value); }},
  };
  return list;
}

Drive drive_of(const EvalEgoMotionOptions& options) {
  if (!options.generated) return recorded_drive(options);
  const auto all = drive_conditions();
  const auto condition = std::find_if(all.begin(), all.end(), [](auto& c) { return c.name == "drive and turn"; });
  return generate_drive(*condition, options.seed, options.frames, options.disparities);
}

}  // namespace

std::vector<std::string> sweep_names() {
  std::vector<std::string> names;
  for (const Sweep& sweep : sweeps()) names.push_back(sweep.name);
  return names;
}

Json measure_sweep(const EvalEgoMotionOptions& options) {
  const auto sweep =
      std::find_if(sweeps().begin(), sweeps().end(), [&](const Sweep& s) { return s.name == options.sweep; });
  const Drive drive = drive_of(options);
  std::vector<ego_motion::Rigid> truth;
  for (const DriveFrame& frame : drive.frames) truth.push_back(frame.pose);
  Json out{{"sweep", sweep->name}, {"what", sweep->what}};
  picture::Curve metres{"median error per step, mm", {}}, degrees{"median error per step, deg", {}},
      refused{"refused, %", {}}, time{"CPU time per step, ms", {}};
  for (const double value : sweep->values) {
    Parameters parameters;
    sweep->set(parameters, value);
    const Track track = follow(drive, parameters);
    Json row{{"value", value}, {"drift_pct", ego_motion::evaluate(track.poses(), truth).drift_pct}};
    row.update(score(drive, track));
    row.erase("baseline");
    metres.values.push_back(row["median_mm"]);
    degrees.values.push_back(row["median_deg"]);
    refused.values.push_back(row["refused_pct"]);
    time.values.push_back(row["time_ms"]);
    out["rows"].push_back(row);
  }
  if (!options.picture.empty())
    picture::write_curves(options.picture, sweep->name, sweep->values, {metres, degrees, refused, time});
  return out;
}

void print_sweep(const Json& out) {
  std::printf("%s: %s\n", out["sweep"].get<std::string>().c_str(), out["what"].get<std::string>().c_str());
  std::printf("%8s %8s %8s %8s %8s %8s %10s %8s\n", "value", "mm p50", "mm p95", "deg p50", "deg p95", "drift %",
              "refused %", "CPU ms");
  for (const Json& row : out["rows"])
    std::printf("%8g %8s %8s %8s %8s %8s %10s %8s\n", row["value"].get<double>(), text(row, "median_mm", 2).c_str(),
                text(row, "p95_mm", 2).c_str(), text(row, "median_deg", 3).c_str(), text(row, "p95_deg", 3).c_str(),
                text(row, "drift_pct", 2).c_str(), text(row, "refused_pct", 1).c_str(),
                text(row, "time_ms", 2).c_str());
}

}  // namespace takt::command
