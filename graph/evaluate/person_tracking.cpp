// SPDX-License-Identifier: Apache-2.0
#include <cstdio>
#include <opencv2/core.hpp>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>

#include "graph/cli/outcome.hpp"
#include "graph/evaluate/evaluations.hpp"
#include "graph/evaluate/percent.hpp"
#include "hal/settings/json.hpp"
#include "nodes/person_tracking/evaluate.hpp"
#include "nodes/picture/image_file.hpp"
#include "rt/quantile.hpp"

namespace takt::command {
namespace {

using namespace person_tracking;
using Json = nlohmann::ordered_json;

constexpr int kPictureFrame = 30;

Json to_json(const WalkFigures& f, const TrackFigures& t) {
  return {{"tracked_pct", percent(t.tracked, f.frames)},
          {"tracked_shown_pct", percent(t.tracked_shown, f.shown)},
          {"false_lock_frames", t.false_locks},
          {"lost", t.lost},
          {"recovered", t.recovered},
          {"position_p50_m", quantile(t.position_m, 0.5)},
          {"position_p95_m", quantile(t.position_m, 0.95)},
          {"hidden_p50_m", quantile(t.hidden_m, 0.5)},
          {"hidden_p95_m", quantile(t.hidden_m, 0.95)},
          {"speed_p50_m_s", quantile(t.speed_m_s, 0.5)},
          {"speed_p95_m_s", quantile(t.speed_m_s, 0.95)},
          {"turn_p50_rad_s", quantile(t.turn_rad_s, 0.5)},
          {"turn_p95_rad_s", quantile(t.turn_rad_s, 0.95)}};
}

/// The boards that are found in a frame of the first walk, and all saddle points of the search that found them.
void draw(const std::string& file, uint64_t seed) {
  const WalkParameters p;
  GeneratedWalk walk(p, seed, 0);
  for (int i = 1; i < kPictureFrame; ++i) walk.next();
  WalkFrame frame = walk.next();
  const cv::Mat image(p.height, p.width, CV_8UC3, frame.left.data());
  ShirtSearch search(p.width, p.height, 3, {});
  const auto boards = search.run({frame.left.data(), p.width, p.height, 3}, std::nullopt, [] { return true; });
  cv::Mat picture = image.clone();
  for (const Board& board : boards) {
    ChessboardFinder finder(p.width, p.height, 3, {});
    finder.find({frame.left.data(), p.width, p.height, 3}, board.box, ChessboardFinder::level_for(board.square_px));
    for (const Corner& corner : finder.corners())
      cv::circle(picture, cv::Point2f(corner.x, corner.y), 2, {0, 0, 255}, cv::FILLED);
    cv::rectangle(picture, {board.box.x, board.box.y, board.box.width, board.box.height}, {0, 200, 0}, 2);
  }
  require_written(picture::write_image(file, picture));
}

}  // namespace

int evaluate(const EvalPersonTrackingOptions& o) {
  if (!o.picture.empty()) draw(o.picture, o.seed);
  const WalkFigures f = measure_walks({}, {}, o.seed, o.walks, o.frames);
  Json out{{"seed", o.seed},
           {"frames", f.frames},
           {"shown", f.shown},
           {"sighted_pct", percent(f.sighted, f.frames)},
           {"sighted_shown_pct", percent(f.sighted_shown, f.shown)},
           {"wrong_sightings", f.wrong_sightings},
           {"time_p50_ms", quantile(f.time_ms, 0.5)},
           {"time_p99_ms", quantile(f.time_ms, 0.99)},
           {"time_max_ms", quantile(f.time_ms, 1)}};
  Json trackers{{"filter", to_json(f, f.filter)},
                {"last_held", to_json(f, f.hold)},
                {"constant_velocity", to_json(f, f.constant)}};
  if (o.json) {
    out["trackers"] = trackers;
    std::printf("%s\n", out.dump(2).c_str());
    return kOk;
  }
  for (const auto& [key, value] : out.items())
    std::printf("%-20s %s\n", key.c_str(),
                value.is_number_float() ? std::to_string(value.get<double>()).c_str() : value.dump().c_str());
  std::printf("%-20s %10s %10s %18s\n", "", "filter", "last held", "constant velocity");
  for (const auto& [key, value] : trackers["filter"].items())
    std::printf("%-20s %10.3f %10.3f %18.3f\n", key.c_str(), value.get<double>(),
                trackers["last_held"][key].get<double>(), trackers["constant_velocity"][key].get<double>());
  return kOk;
}

}  // namespace takt::command
