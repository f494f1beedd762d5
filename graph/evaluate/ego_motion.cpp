// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <algorithm>
#include <cstdio>
#include <opencv2/core.hpp>

#include "graph/cli/outcome.hpp"
#include "graph/evaluate/ego_motion_drive.hpp"
#include "graph/evaluate/ego_motion_picture.hpp"
#include "graph/evaluate/ego_motion_score.hpp"
#include "graph/evaluate/ego_motion_sweep.hpp"
#include "graph/evaluate/evaluations.hpp"
#include "hal/settings/json.hpp"
#include "nodes/ego_motion/evaluate.hpp"

namespace takt::command {
namespace {

using namespace ego_motion;
using Json = nlohmann::ordered_json;

// A recorded drive -------------------------------------------------------------------------------------------------

Json measure_recorded(const EvalEgoMotionOptions& options) {
  const Drive drive = recorded_drive(options);
  const Track track = follow(drive, {});
  std::vector<Rigid> truth;
  for (const DriveFrame& frame : drive.frames) truth.push_back(frame.pose);
  const Quality q = ego_motion::evaluate(track.poses(), truth);
  const Quality still = ego_motion::evaluate(std::vector<Rigid>(truth.size()), truth);
  if (!options.picture.empty()) write_flow_picture(options.picture, drive, {});
  return {{"drift_pct", q.drift_pct},
          {"deg_per_frame", q.deg_per_frame},
          {"metres_per_frame", q.metres_per_frame},
          {"path_m", q.path_m},
          {"frames", truth.size()},
          {"valid_frames", std::count_if(track.results.begin(), track.results.end(), [](auto& r) { return r.valid; })},
          {"time_ms", track.step_ms},
          {"stereo_time_ms", drive.stereo_ms},
          {"baseline",
           {{"name", "standing still"},
            {"drift_pct", still.drift_pct},
            {"deg_per_frame", still.deg_per_frame},
            {"metres_per_frame", still.metres_per_frame}}}};
}

void print_recorded(const Json& out) {
  const auto number = [](const Json& row, const char* key) { return row[key].get<double>(); };
  std::printf("%-18s %10s %14s %14s %9s\n", "method", "drift %", "deg per frame", "m per frame", "CPU ms");
  std::printf("%-18s %10.2f %14.4f %14.4f %9.2f\n", "takt ego_motion", number(out, "drift_pct"),
              number(out, "deg_per_frame"), number(out, "metres_per_frame"), number(out, "time_ms"));
  const Json& still = out["baseline"];
  std::printf("%-18s %10.2f %14.4f %14.4f %9s\n", "standing still", number(still, "drift_pct"),
              number(still, "deg_per_frame"), number(still, "metres_per_frame"), "-");
  std::printf("path %.1f m, %.0f frames, %.0f with a valid motion; stereo %.2f ms a frame\n", number(out, "path_m"),
              number(out, "frames"), number(out, "valid_frames"), number(out, "stereo_time_ms"));
}

// Generated drives -------------------------------------------------------------------------------------------------

Json measure_generated(const EvalEgoMotionOptions& options) {
  Json out{{"seed", options.seed}, {"frames", options.frames}};
  for (const DriveCondition& condition : drive_conditions()) {
    const Drive drive = generate_drive(condition, options.seed, options.frames, options.disparities);
    Json row{{"condition", condition.name}};
    row.update(score(drive, follow(drive, {})));
    out["conditions"].push_back(row);
    if (!options.picture.empty() && condition.movers) write_flow_picture(options.picture, drive, {});
  }
  return out;
}

void print_row(const std::string& condition, const std::string& method, const Json& row) {
  std::printf("%-22s %-18s %7s %7s %6s %7s %7s %9s %9s %9s %8s %8s\n", condition.c_str(), method.c_str(),
              text(row, "median_mm", 2).c_str(), text(row, "p95_mm", 2).c_str(), text(row, "median_pct", 2).c_str(),
              text(row, "median_deg", 3).c_str(), text(row, "p95_deg", 3).c_str(), text(row, "refused_pct", 1).c_str(),
              text(row, "refused_rightly_pct", 0).c_str(), text(row, "accepted_wrong_pct", 1).c_str(),
              text(row, "within_95_pct", 0).c_str(), text(row, "corners", 0).c_str());
}

void print_generated(const Json& out) {
  std::printf("%-22s %-18s %7s %7s %6s %7s %7s %9s %9s %9s %8s %8s\n", "condition", "method", "mm p50", "p95", "% p50",
              "deg p50", "p95", "refused %", "rightly %", "wrong %", "in 95 %", "corners");
  for (const Json& condition : out["conditions"]) {
    print_row(condition["condition"], "takt ego_motion", condition);
    for (const auto& [name, row] : condition["baseline"].items()) print_row("", name, row);
  }
  std::printf(
      "error per step; wrong: an accepted estimate off by more than %.0f mm + %.0f %% of the step or %.1f deg; "
      "rightly: a refused one is\nin 95 %%: steps whose error lies within the 95 %% ellipsoid of the stated "
      "covariance\n",
      1000 * kWrong_m, 100 * kWrongShare, kWrong_deg);
}

}  // namespace

int evaluate(const EvalEgoMotionOptions& options) {
  if (options.generated != options.data.empty())
    throw BadData("takt eval ego_motion wants either --data DIR or --generated");
  if (options.generated && options.scale != 1) throw BadData("--scale makes recorded images smaller: it wants --data");
  cv::setNumThreads(1);
  if (!options.sweep.empty()) {
    const Json out = measure_sweep(options);
    if (options.json) std::printf("%s\n", out.dump(2).c_str());
    else print_sweep(out);
    return kOk;
  }
  const Json out = options.generated ? measure_generated(options) : measure_recorded(options);
  if (options.json) std::printf("%s\n", out.dump(2).c_str());
  else if (options.generated) print_generated(out);
  else print_recorded(out);
  return kOk;
}

}  // namespace takt::command
