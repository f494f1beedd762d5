// SPDX-License-Identifier: Apache-2.0
#include "nodes/laser_fusion/registration.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <fstream>
#include <limits>
#include <numbers>
#include <opencv2/imgcodecs.hpp>
#include <stdexcept>

#include "graph/cli/outcome.hpp"
#include "graph/evaluate/evaluations.hpp"
#include "graph/evaluate/laser_stereo.hpp"
#include "hal/settings/json.hpp"
#include "nodes/cloud/cloud_file.hpp"
#include "nodes/laser_fusion/evaluate.hpp"
#include "nodes/laser_fusion/fusion.hpp"
#include "nodes/picture/clouds.hpp"
#include "nodes/picture/curves.hpp"
#include "nodes/picture/image_file.hpp"
#include "rt/file/input_file.hpp"
#include "rt/msg/geometry.hpp"
#include "rt/msg/point.hpp"
#include "rt/time/clock.hpp"

namespace takt::command {
namespace {

using namespace laser_fusion;
using Json = nlohmann::ordered_json;

constexpr double kDegree = std::numbers::pi / 180;
constexpr double kSigmaOfCut = 0.4;  // 0.10 m at the cut of 0.25 m

// Two recorded clouds ------------------------------------------------------------------------------------------------

cloud::Cloud read(const std::filesystem::path& file) {
  auto cloud = cloud::read_cloud(file);
  if (!cloud) throw std::invalid_argument(cloud.error());
  // The reference pose is that of absolute coordinates.
  if (const std::string rounded = cloud::add_origin(*cloud); !rounded.empty()) cloud->left_out.push_back(rounded);
  for (const std::string& left : cloud->left_out) std::fprintf(stderr, "takt: %s: %s\n", file.c_str(), left.c_str());
  return std::move(*cloud);
}

/// Four rows of four numbers.
Rigid read_pose(const std::filesystem::path& file) {
  require_readable<std::invalid_argument>(file);
  std::ifstream in(file);
  double m[16] = {};
  for (int i = 0; i < 16; ++i)
    if (!(in >> m[i]))
      throw std::invalid_argument(
          fmt::format("{}: number {} of a 4 x 4 matrix is missing, or none", file.string(), i + 1));
  Rigid pose;
  for (int row = 0; row < 3; ++row) {
    for (int column = 0; column < 3; ++column) pose.R(row, column) = m[4 * row + column];
    pose.t(row) = m[4 * row + 3];
  }
  if ((pose.R * pose.R.transpose() - Eigen::Matrix3d::Identity()).norm() > 0.01)
    throw std::invalid_argument(file.string() + ": its first three columns are no rotation");
  return pose;
}

RegistrationParameters parameters_of(const EvalRegistrationOptions& o) {
  RegistrationParameters p;
  p.points = o.points;
  p.metric = o.metric == "thesis" ? Metric::thesis : Metric::truncated;
  p.cut_m = o.cut_m;
  p.seed = o.seed;
  p.genetic.generations = o.generations;
  p.genetic.population = o.population;
  p.genetic.patience = o.patience;
  return p;
}

/// Its laser is the target, its vision the source.
struct Recorded {
  CloudPair pair;
  std::optional<CameraModel> camera;  ///< of a scene
};

/// The pair that the options name, if any.
std::optional<Recorded> recorded_pair(const EvalRegistrationOptions& o) {
  const auto files = {&o.source, &o.target, &o.reference};
  const auto named = std::count_if(files.begin(), files.end(), [](const auto* file) { return !file->empty(); });
  if (named == 0 && o.scene.empty()) return std::nullopt;
  if (o.scene.empty() ? named != 3 : named != 0)
    throw std::invalid_argument(
        "registration wants --source, --target and --reference, or --scene, of recorded clouds");
  if (o.scene.empty()) return Recorded{{read(o.target), read(o.source), read_pose(o.reference)}, std::nullopt};
  const LaserStereo scene = read_laser_stereo(o.scene);
  return Recorded{scene.pair, scene.camera};
}

struct Registered {
  Rigid reference, searched, refined, plain, generalised;
  double time_ms = 0;  ///< CPU time of the search
};

/// A laser cloud, coloured by its matches.
struct Fused {
  cloud::Cloud coloured, confidence;
};

Fused fused(const cloud::Cloud& target, const cloud::Cloud& source, const Rigid& pose, double sigma_m) {
  const FusionParameters p{.sigma_m = sigma_m};
  NearestTable table(source.points.size());
  table.build(source.points, farthest_match_m(p));
  const std::vector<Colour> grey(source.points.size(), Colour{200, 200, 200});
  Fused out;
  fuse(target.points, table, source.colours.empty() ? grey : source.colours, pose, p,
       [&](const Point& point, const Colour& colour, double confidence) {
         out.coloured.points.push_back(point);
         out.coloured.colours.push_back(colour);
         out.confidence.points.push_back(point);
         out.confidence.colours.push_back(confidence_colour(confidence));
       });
  return out;
}

/// Both clouds in one, the target white, the source orange.
cloud::Cloud laid_over(const cloud::Cloud& target, const cloud::Cloud& source, const Rigid& pose) {
  cloud::Cloud both{target.points, std::vector<Colour>(target.points.size(), Colour{220, 220, 220})};
  for (const Point& p : source.points) {
    const Eigen::Vector3f moved = (pose * Eigen::Vector3d(p.x, p.y, p.z)).cast<float>();
    both.points.push_back({moved.x(), moved.y(), moved.z()});
    both.colours.push_back({0, 140, 255});
  }
  return both;
}

void write_results(const EvalRegistrationOptions& o, const cloud::Cloud& target, const cloud::Cloud& source,
                   const Registered& r, double sigma_m) {
  if (o.picture.empty() && o.out.empty()) return;
  const Fused result = fused(target, source, r.refined, sigma_m);
  if (!o.out.empty())
    if (const auto written = cloud::write_cloud(o.out, result.coloured.view()); !written)
      throw std::invalid_argument("--out " + written.error());
  if (o.picture.empty()) return;
  const cloud::Cloud before = laid_over(target, source, {}), after = laid_over(target, source, r.refined);
  const cloud::CloudView views[] = {before.view(), after.view(), result.confidence.view(), result.coloured.view()};
  require_written(
      picture::write_image(o.picture, picture::draw_clouds(std::span(views).first(source.colours.empty() ? 3 : 4))));
}

Json errors(const Rigid& found, const Rigid& reference) {
  const PoseError error = error_of(found, reference);
  return {{"error_m", error.m}, {"error_deg", error.rad / kDegree}};
}

CloudPair displaced_as(const EvalRegistrationOptions& o, const CloudPair& pair) {
  return o.displace.empty() ? pair : displaced(pair, o.displace[0], o.displace[1] * kDegree, o.seed);
}

/// How far the camera's disparities are off against the laser at the true pose, and the pose that is found without.
Json disparity_bias(const EvalRegistrationOptions& o, const LaserStereo& scene) {
  constexpr double kRanges_m[] = {3, 6, 9, 13, 20};
  Json out;
  for (size_t i = 0; i + 1 < std::size(kRanges_m); ++i)
    if (const auto bias_px = disparity_bias_px(scene, kRanges_m[i], kRanges_m[i + 1]))
      out[fmt::format("px_{}_to_{}_m", kRanges_m[i], kRanges_m[i + 1])] = *bias_px;
  const auto bias_px = disparity_bias_px(scene, 0, std::numeric_limits<double>::infinity());
  if (!bias_px) return out;
  out["px"] = *bias_px;
  CloudPair pair = scene.pair;
  pair.vision = with_less_disparity(pair.vision, scene.camera, *bias_px);
  pair = displaced_as(o, pair);
  Registration registration(pair.laser.view(), pair.vision.view(), parameters_of(o));
  const Rigid found = registration.refined(registration.search({}));
  Json without = errors(found, pair.vision_in_laser);
  without["score_at_found"] = registration.judged(found).score;
  without["score_at_truth"] = registration.judged(pair.vision_in_laser).score;
  out["without"] = without;
  return out;
}

Json measure_pair(const EvalRegistrationOptions& o, const Recorded& recorded) {
  const CloudPair pair = displaced_as(o, recorded.pair);
  const cloud::Cloud &source = pair.vision, &target = pair.laser;
  Registered r;
  r.reference = pair.vision_in_laser;
  Registration registration(target.view(), source.view(), parameters_of(o));
  const int64_t start_ns = thread_cpu_ns();
  r.searched = registration.search({});
  r.time_ms = static_cast<double>(thread_cpu_ns() - start_ns) / 1e6;
  r.refined = registration.refined(r.searched);
  r.plain = registration.refined(registration.plain({}));
  r.generalised = registration.refined(registration.generalised({}));
  const double sigma_m = o.sigma_m > 0 ? o.sigma_m : kSigmaOfCut * registration.cut_m();
  write_results(o, target, source, r, sigma_m);

  Json out = errors(r.refined, r.reference);
  out["error_of_search_m"] = error_of(r.searched, r.reference).m;
  out["error_of_search_deg"] = error_of(r.searched, r.reference).rad / kDegree;
  out["score_at_found"] = registration.judged(r.refined).score;
  out["score_at_truth"] = registration.judged(r.reference).score;
  out["thesis_score_at_found"] = registration.judged_by_thesis(r.refined).score;
  out["thesis_score_at_truth"] = registration.judged_by_thesis(r.reference).score;
  out["pairs_share"] =
      static_cast<double>(registration.judged(r.refined).pairs) / static_cast<double>(registration.fixed_points());
  out["cut_m"] = registration.cut_m();
  out["last_cut_m"] = registration.last_cut_m();
  out["target_points"] = registration.fixed_points();
  out["source_points"] = registration.moving_points();
  out["generations_per_s"] = o.generations / (r.time_ms / 1e3);
  out["time_ms"] = r.time_ms;
  out["seed"] = o.seed;
  out["baseline"] = {{"plain_icp", errors(r.plain, r.reference)},
                     {"generalised_icp", errors(r.generalised, r.reference)},
                     {"identity", errors({}, r.reference)}};
  if (recorded.camera) out["disparity_bias"] = disparity_bias(o, {recorded.pair, *recorded.camera});
  return out;
}

void print(const Json& out, const std::string& indent = "") {
  for (const auto& [key, value] : out.items())
    if (value.is_object()) {
      std::printf("%s%s\n", indent.c_str(), key.c_str());
      print(value, indent + "  ");
    } else {
      std::printf("%s%-*s %s\n", indent.c_str(), static_cast<int>(24 - indent.size()), key.c_str(),
                  value.is_number_float() ? fmt::format("{:.6g}", value.get<double>()).c_str() : value.dump().c_str());
    }
}

// Sweeps -------------------------------------------------------------------------------------------------------------

constexpr size_t kPointsOfSensors = 8000;
constexpr double kOverlaps[] = {1, 0.9, 0.8, 0.6, 0.45, 0.3};
constexpr struct { double m, degrees; } kOffsets[] = {{0.25, 15}, {0.5, 30}, {0.75, 45}, {1, 60}};

SuccessParameters sweep_parameters(const EvalRegistrationOptions& o, bool generated) {
  SuccessParameters p;
  p.registration = parameters_of(o);
  if (o.cut_m == 0 && generated) p.registration.cut_m = QualityParameters{}.cut_m;
  p.seed = o.seed;
  p.runs = o.runs;
  return p;
}

/// 95 % interval of a share (Wilson 1927), per cent: what so few runs can say.
std::pair<double, double> wilson_pct(size_t part, size_t all) {
  constexpr double kZ = 1.959964;
  const double n = static_cast<double>(all), p = static_cast<double>(part) / n, z2 = kZ * kZ;
  const double middle = p + z2 / (2 * n), half = kZ * std::sqrt(p * (1 - p) / n + z2 / (4 * n * n));
  return {100 * std::max(0.0, middle - half) / (1 + z2 / n), 100 * std::min(1 + z2 / n, middle + half) / (1 + z2 / n)};
}

/// Of generated pairs over overlaps and offsets, of a recorded one over offsets.
int sweep_success(const EvalRegistrationOptions& o, const std::optional<Recorded>& recorded) {
  SuccessParameters p = sweep_parameters(o, !recorded);
  p.pair.points = kPointsOfSensors;
  std::vector<double> overlaps(std::begin(kOverlaps), std::end(kOverlaps));
  if (recorded) overlaps = {0};  // whatever it is
  Json rows = Json::array();
  std::vector<picture::Curve> curves;
  if (!o.json)
    std::printf("%7s %7s %7s %9s %9s %9s %9s %9s %9s %9s %11s %11s\n", "overlap", "m", "deg", "genetic %", "95 %",
                "plain %", "general %", "deceived %", "median m", "deg", "at truth", "at found");
  for (const auto& offset : kOffsets) {
    curves.push_back({fmt::format("successes of genetic ICP, %, offset {} m / {} deg", offset.m, offset.degrees), {}});
    for (const double overlap : overlaps) {
      p.pair.overlap = overlap;
      p.pair.offset_m = offset.m;
      p.pair.offset_rad = offset.degrees * kDegree;
      const Success s = measure_success(p, [&](uint64_t seed) {
        return recorded ? displaced(recorded->pair, p.pair.offset_m, p.pair.offset_rad, seed)
                        : generate_pair(p.pair, seed);
      });
      const auto percent = [&](size_t count) { return 100 * static_cast<double>(count) / static_cast<double>(s.runs); };
      const auto [low, high] = wilson_pct(s.genetic, s.runs);
      curves.back().values.push_back(percent(s.genetic));
      rows.push_back({{"overlap", recorded ? Json(nullptr) : Json(overlap)},
                      {"offset_m", offset.m},
                      {"offset_deg", offset.degrees},
                      {"runs", s.runs},
                      {"success_pct", percent(s.genetic)},
                      {"success_low_pct", low},
                      {"success_high_pct", high},
                      {"deceived_pct", percent(s.deceived)},
                      {"error_m", s.median_m},
                      {"error_deg", s.median_rad / kDegree},
                      {"score_at_truth", s.score_at_truth},
                      {"score_at_found", s.score_at_found},
                      {"baseline",
                       {{"plain_icp", {{"success_pct", percent(s.plain)}}},
                        {"generalised_icp", {{"success_pct", percent(s.generalised)}}}}}});
      if (o.json) continue;
      std::printf("%7s %7g %7g %9.0f %9s %9.0f %9.0f %9.0f %9.4f %9.3f %11.5f %11.5f\n",
                  recorded ? "-" : fmt::format("{}", overlap).c_str(), offset.m, offset.degrees, percent(s.genetic),
                  fmt::format("{:.0f}..{:.0f}", low, high).c_str(), percent(s.plain), percent(s.generalised),
                  percent(s.deceived), s.median_m, s.median_rad / kDegree, s.score_at_truth, s.score_at_found);
      std::fflush(stdout);
    }
  }
  if (o.json)
    std::printf("%s\n", Json{{"seed", o.seed}, {"generations", o.generations}, {"success", rows}}.dump(2).c_str());
  if (!o.picture.empty()) picture::write_curves(o.picture, "overlap", overlaps, curves);
  return kOk;
}

int sweep_population(const EvalRegistrationOptions& o) {
  const std::vector<size_t> populations{2, 5, 10, 20, 50, 100, 200, 500, 1000};
  const std::vector<uint32_t> generations{300, 1'000, 3'000, 10'000, 50'000};
  Json rows = Json::array();
  std::vector<picture::Curve> curves;
  for (const double overlap : {1.0, 0.6}) {
    SuccessParameters p = sweep_parameters(o, true);
    p.registration.genetic.patience = 0;  // the thesis's search, whose populations these curves are about
    p.pair.points = o.points;
    p.pair.overlap = overlap;
    const auto measured = measure_populations(p, populations, generations);
    for (size_t g = 0; g < generations.size(); ++g) {
      curves.push_back({fmt::format("median score after {} generations, overlap {}", generations[g], overlap), {}});
      for (const PopulationCurve& c : measured) {
        curves.back().values.push_back(c.score[g]);
        rows.push_back({{"overlap", overlap},
                        {"population", c.population},
                        {"generations", generations[g]},
                        {"score", c.score[g]}});
      }
      curves.back().foot = *std::min_element(curves.back().values.begin(), curves.back().values.end());
      if (o.json) continue;
      std::printf("%s:\n ", curves.back().label.c_str());
      for (const PopulationCurve& c : measured) std::printf(" %zu: %.5f", c.population, c.score[g]);
      std::printf("\n");
    }
  }
  if (o.json) std::printf("%s\n", Json{{"seed", o.seed}, {"runs", o.runs}, {"population", rows}}.dump(2).c_str());
  if (!o.picture.empty())
    picture::write_curves(o.picture, "population", {populations.begin(), populations.end()}, curves);
  return kOk;
}

}  // namespace

int evaluate(const EvalRegistrationOptions& o) {
  if (o.sweep == "population") return sweep_population(o);
  const std::optional<Recorded> recorded = recorded_pair(o);
  if (o.sweep == "success") return sweep_success(o, recorded);
  if (!recorded)
    throw std::invalid_argument(
        "registration wants --source, --target and --reference, or --scene, or --sweep success or population");
  const Json out = measure_pair(o, *recorded);
  if (o.json) std::printf("%s\n", out.dump(2).c_str());
  else print(out);
  return kOk;
}

}  // namespace takt::command
