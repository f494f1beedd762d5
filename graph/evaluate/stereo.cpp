// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>
#include <stdexcept>

#include "graph/cli/outcome.hpp"
#include "graph/evaluate/evaluations.hpp"
#include "graph/evaluate/laser_stereo.hpp"
#include "graph/evaluate/stereo_parameters.hpp"
#include "hal/settings/json.hpp"
#include "nodes/stereo/evaluate.hpp"
#include "nodes/stereo/evaluate_peers.hpp"
#include "nodes/stereo/half_resolution.hpp"
#include "nodes/stereo/matcher.hpp"
#include "rt/image_file/image_file.hpp"
#include "rt/quantile.hpp"
#include "rt/time/clock.hpp"

namespace takt::command {
namespace {

using Json = nlohmann::ordered_json;
constexpr int kRepeats = 7;

struct BadData : std::runtime_error {
  using std::runtime_error::runtime_error;
};

ImageView<const uint8_t> view(const cv::Mat& m) {
  return {m.data, m.cols, m.rows, m.channels(), static_cast<ptrdiff_t>(m.step)};
}

stereo::DisparityImage read_truth(const std::filesystem::path& file, double scale) {
  if (file.extension() == ".pfm") {  // 0 in ground truth: unknown
    const cv::Mat1f values = read_floats(file);
    stereo::DisparityImage image{values.cols, values.rows, {}};
    for (const float value : values)
      image.pixels.push_back(std::isfinite(value) ? value / static_cast<float>(scale) : 0);
    return image;
  }
  cv::Mat truth = read_values(file);
  if (truth.channels() > 1) cv::cvtColor(truth, truth, cv::COLOR_BGR2GRAY);
  if (truth.depth() == CV_16U)
    return stereo::ground_truth(ImageView<const uint16_t>{truth.ptr<uint16_t>(), truth.cols, truth.rows, 1,
                                                          static_cast<ptrdiff_t>(truth.step1())},
                                scale);
  return stereo::ground_truth(view(truth), scale);
}

Json row(const stereo::StereoScore& score, double time_ms) {
  return {{"bad_1px_pct", score.bad_1px_pct},
          {"bad_1px_all_pct", score.bad_1px_all_pct},
          {"bad_half_px_pct", score.bad_half_px_pct},
          {"density_pct", score.density_pct},
          {"time_ms", time_ms}};
}

Json run_ours(const cv::Mat& left, const cv::Mat& right, const stereo::DisparityImage& truth, stereo::Matcher& matcher,
              int repeats) {
  cv::Mat disparity(left.size(), CV_16S), confidence(left.size(), CV_8U), fraction(left.size(), CV_8U);
  const stereo::DisparityViews out{{disparity.ptr<int16_t>(), left.cols, left.rows},
                                   {confidence.data, left.cols, left.rows},
                                   {fraction.data, left.cols, left.rows}};
  std::vector<double> times;
  for (int i = 0; i < repeats; ++i) {
    const int64_t start = thread_cpu_ns();
    if (!matcher.match(view(left), view(right), out)) throw BadData("left and right image differ in size or channels");
    times.push_back(static_cast<double>(thread_cpu_ns() - start) / 1e6);
  }
  Json json = row(stereo::score(stereo::to_disparity_image(out), truth), quantile(times, 0.5));
  std::vector<double> right_ones, wrong_ones;
  for (int y = 0; y < truth.height; ++y)
    for (int x = 0; x < truth.width; ++x) {
      if (truth.at(x, y) <= 0 || out.disparity.at(x, y) < 0) continue;
      const bool is_right = std::abs(static_cast<float>(out.disparity.at(x, y)) - truth.at(x, y)) <= 1;
      (is_right ? right_ones : wrong_ones).push_back(out.confidence.at(x, y) / 255.0);
    }
  json["confidence_right"] = right_ones.empty() ? Json() : Json(quantile(right_ones, 0.5));
  json["confidence_wrong"] = wrong_ones.empty() ? Json() : Json(quantile(wrong_ones, 0.5));
  return json;
}

Json run_variants(const cv::Mat& left, const cv::Mat& right, const stereo::DisparityImage& truth, int disparities) {
  Json rows = Json::object();
  for (const StereoVariant& variant : stereo_variants(disparities)) {
    const auto matcher = stereo::make_matcher(left.cols, left.rows, left.channels(), variant.parameters);
    const bool slow = std::string_view(matcher->target()) == "scalar";  // seconds: once is enough
    rows[variant.name] = run_ours(left, right, truth, *matcher, slow ? 1 : kRepeats);
  }
  return rows;
}

Json run_peer(stereo::Peer peer, const cv::Mat& left, const cv::Mat& right, const stereo::DisparityImage& truth,
              int disparities) {
  std::vector<double> times(kRepeats);
  stereo::DisparityImage result;
  for (double& time : times) result = stereo::run_peer(peer, view(left), view(right), disparities, &time);
  return row(stereo::score(result, truth), quantile(times, 0.5));
}

std::string confidence(const Json& row, const char* key) {
  const auto found = row.find(key);
  return found == row.end() || found->is_null() ? "-" : fmt::format("{:.2f}", found->get<double>());
}

void print_row(const char* name, const Json& r) {
  std::printf("%-34s %9.2f %9.2f %9.2f %10.1f %9.2f %6s %6s\n", name, r["bad_1px_pct"].get<double>(),
              r["bad_1px_all_pct"].get<double>(), r["bad_half_px_pct"].get<double>(), r["density_pct"].get<double>(),
              r["time_ms"].get<double>(), confidence(r, "confidence_right").c_str(),
              confidence(r, "confidence_wrong").c_str());
}

/// What is matched, and what should come out.
LaserTruth read_pair(const EvalStereoOptions& options) {
  if (!options.scene.empty()) return read_laser_truth(options.scene);
  LaserTruth pair{read_image(options.left, Channels::colour), read_image(options.right, Channels::colour),
                  read_truth(options.truth, options.truth_scale)};
  if (pair.left.size() != pair.right.size())
    throw BadData(fmt::format("{} and {} differ in size", options.left.string(), options.right.string()));
  if (pair.disparity.width != pair.left.cols || pair.disparity.height != pair.left.rows)
    throw BadData(fmt::format("{}: {} x {}, the images are {} x {}", options.truth.string(), pair.disparity.width,
                              pair.disparity.height, pair.left.cols, pair.left.rows));
  return pair;
}

Json measure(const EvalStereoOptions& options) {
  LaserTruth pair = read_pair(options);
  const cv::Mat &left = pair.left, &right = pair.right;
  const stereo::DisparityImage& truth = pair.disparity;
  pair.right.convertTo(pair.right, -1, options.exposure);  // saturates as a sensor does
  stereo::MatcherParameters p;
  p.disparities = options.disparities;
  set_stereo_parameters(options.set, p);
  const auto matcher = stereo::make_matcher(left.cols, left.rows, left.channels(), p);
  Json out = run_ours(left, right, truth, *matcher, kRepeats);
  out["known_px"] = std::count_if(truth.pixels.begin(), truth.pixels.end(), [](float d) { return d > 0; });
  stereo::HalfMatcher half(left.cols, left.rows, left.channels(), p);
  out["levels"]["half"] = run_ours(left, right, truth, half, kRepeats);
  half.limit_search((p.disparities + 1) / 2);
  out["levels"]["half_range"] = run_ours(left, right, truth, half, kRepeats);
  if (options.variants) out["variants"] = run_variants(left, right, truth, p.disparities);
  stereo::DisparityImage middle = truth;
  std::fill(middle.pixels.begin(), middle.pixels.end(), static_cast<float>(p.disparities) / 2);
  out["baseline"] = row(stereo::score(middle, truth), 0);
  out["baseline"]["name"] = "half the search range everywhere";
  for (const auto peer : {stereo::Peer::block_matching, stereo::Peer::block_matching_unfiltered,
                          stereo::Peer::semi_global, stereo::Peer::semi_global_equal_light})
    out["peers"][stereo::to_string(peer)] = run_peer(peer, left, right, truth, p.disparities);
  return out;
}

}  // namespace

int evaluate(const EvalStereoOptions& options) {
  if (!options.sweep.empty()) return sweep_stereo(options);
  if (options.left.empty() && options.scene.empty())
    throw std::invalid_argument("stereo wants --left, --right and --gt of a recorded pair, or --scene, or --sweep");
  cv::setNumThreads(1);
  const Json out = measure(options);
  if (options.json) {
    std::printf("%s\n", out.dump(2).c_str());
    return kOk;
  }
  std::printf("%-34s %9s %9s %9s %10s %9s %13s\n", "method", "bad >1px", "bad, all", "bad >0.5", "density %", "CPU ms",
              "zeta: right, wrong");
  print_row("takt stereo", out);
  print_row("takt stereo, level half", out["levels"]["half"]);
  print_row("takt stereo, level half_range", out["levels"]["half_range"]);
  if (out.contains("variants"))
    for (const auto& [name, variant] : out["variants"].items()) print_row(name.c_str(), variant);
  for (const auto& [name, peer] : out["peers"].items()) print_row(name.c_str(), peer);
  print_row("half the search range everywhere", out["baseline"]);
  return kOk;
}

}  // namespace takt::command
