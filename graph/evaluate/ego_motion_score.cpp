// SPDX-License-Identifier: Apache-2.0
#include "graph/evaluate/ego_motion_score.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <vector>

#include "graph/evaluate/percent.hpp"
#include "nodes/ego_motion/evaluate.hpp"
#include "rt/quantile.hpp"

namespace takt::command {
namespace {

using namespace ego_motion;
using Json = nlohmann::ordered_json;

constexpr double kChi2_95 = 12.592;  // 95 % quantile of chi^2 with 6 degrees of freedom

bool is_wrong(const Rigid& motion, const Rigid& truth) {
  const StepError e = step_error(motion, truth);
  return e.metres > kWrong_m + kWrongShare * truth.t.norm() || e.degrees > kWrong_deg;
}

/// Errors of one method over the steps of a drive.
class Errors {
 public:
  void add(const Rigid& motion, const Rigid& truth) {
    const StepError e = step_error(motion, truth);
    mm_.push_back(1000 * e.metres);
    degrees_.push_back(e.degrees);
    if (truth.t.norm() > kLeastStep_m) percent_.push_back(100 * e.metres / truth.t.norm());
  }
  Json row() const {
    return {{"median_mm", quantile(mm_, 0.5)},
            {"p95_mm", quantile(mm_, 0.95)},
            {"median_pct", percent_.empty() ? Json() : Json(quantile(percent_, 0.5))},
            {"median_deg", quantile(degrees_, 0.5)},
            {"p95_deg", quantile(degrees_, 0.95)}};
  }

 private:
  static constexpr double kLeastStep_m = 0.01;  // of a shorter step a share says nothing
  std::vector<double> mm_, percent_, degrees_;
};

}  // namespace

Json score(const Drive& drive, const Track& track) {
  Errors ours, zero, constant;
  int steps = 0, refused = 0, rightly = 0, accepted_wrong = 0, within = 0, corners = 0;
  Rigid before;
  for (size_t i = 1; i < drive.frames.size(); ++i) {
    const Rigid truth = drive.frames[i - 1].pose.inverse() * drive.frames[i].pose;
    const Result& r = track.results[i];
    const bool wrong = !r.estimate || is_wrong(*r.estimate, truth);
    ++steps;
    corners += r.corners;
    refused += !r.valid;
    rightly += !r.valid && wrong;
    accepted_wrong += r.valid && wrong;
    within += normalised_error_squared(r.camera_in_previous, truth) < kChi2_95;
    ours.add(from_transform(r.camera_in_previous.transform), truth);
    zero.add({}, truth);
    if (i > 1) constant.add(before, truth);
    before = truth;
  }
  Json out{{"steps", steps}};
  out.update(ours.row());
  out["refused_pct"] = percent(refused, steps);
  out["refused_rightly_pct"] = refused == 0 ? Json() : Json(percent(rightly, refused));
  out["accepted_wrong_pct"] = percent(accepted_wrong, steps);
  out["within_95_pct"] = percent(within, steps);
  out["corners"] = static_cast<double>(corners) / std::max(1, steps);
  out["time_ms"] = track.step_ms;
  out["baseline"] = {{"zero motion", zero.row()}, {"constant velocity", constant.row()}};
  return out;
}

std::string text(const Json& row, const char* key, int digits) {
  const bool known = row.contains(key) && !row[key].is_null();
  return known ? fmt::format("{:.{}f}", row[key].get<double>(), digits) : "-";
}

}  // namespace takt::command
