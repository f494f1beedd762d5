// SPDX-License-Identifier: Apache-2.0
// Stereo on generated pairs: what noise does to each way of matching, and what the window's edge costs and gives
// (thesis Fig. 3.15).
#include <fmt/format.h>

#include <algorithm>
#include <cstdio>

#include "graph/cli/outcome.hpp"
#include "graph/evaluate/evaluations.hpp"
#include "graph/evaluate/stereo_parameters.hpp"
#include "hal/settings/json.hpp"
#include "nodes/picture/curves.hpp"
#include "nodes/stereo/generated_pair.hpp"
#include "nodes/stereo/matcher.hpp"
#include "rt/time/clock.hpp"

namespace takt::command {
namespace {

using namespace stereo;

constexpr int kWidth = 320, kHeight = 240, kPairs = 3, kRepeats = 5;
constexpr double kContrast = 12;

/// Means over the pairs; the time is the median of a pair's repeats.
struct Reading {
  double bad_pct = 0, time_ms = 0;
};

Reading read(const MatcherParameters& p, double noise_sigma) {
  Reading reading;
  const auto matcher = make_matcher(kWidth, kHeight, 3, p);
  std::vector<int16_t> disparity(size_t{kWidth} * kHeight);
  std::vector<uint8_t> confidence(disparity.size());
  for (uint64_t seed = 1; seed <= kPairs; ++seed) {
    const GeneratedPair pair = generate_pair(kWidth, kHeight, p.disparities, kContrast, noise_sigma, seed);
    std::vector<double> times;
    for (int i = 0; i < kRepeats; ++i) {
      const int64_t start = thread_cpu_ns();
      if (!matcher->match(pair.left_view(), pair.right_view(),
                          {{disparity.data(), kWidth, kHeight}, {confidence.data(), kWidth, kHeight}}))
        throw std::logic_error("the matcher refused a generated pair");
      times.push_back(static_cast<double>(thread_cpu_ns() - start) * 1e-6);
    }
    std::nth_element(times.begin(), times.begin() + kRepeats / 2, times.end());
    const ImageView<const int16_t> map{disparity.data(), kWidth, kHeight};
    reading.bad_pct += score(to_disparity_image(map), pair.truth).bad_1px_pct / kPairs;
    reading.time_ms += times[kRepeats / 2] / kPairs;
  }
  return reading;
}

struct Method {
  const char* name;
  MatcherParameters parameters;
};

std::vector<Method> methods(const EvalStereoOptions& options) {
  MatcherParameters gradient;
  gradient.disparities = options.disparities;
  set_stereo_parameters(options.set, gradient);
  MatcherParameters ssd = gradient, sad = gradient, census = gradient, quality = MatcherParameters::quality();
  ssd.cost = CostKind::ssd;
  sad.cost = CostKind::sad;
  census.cost = CostKind::census;
  quality.disparities = gradient.disparities;
  if (options.sweep == "window") return {{"gradient", gradient}, {"thesis: ssd 50", ssd}, {"census", census}};
  return {{"gradient", gradient}, {"thesis: ssd 50", ssd}, {"sad 50", sad}, {"census", census}, {"quality", quality}};
}

}  // namespace

int sweep_stereo(const EvalStereoOptions& options) {
  const bool noise = options.sweep == "noise";
  const std::vector<double> values =
      noise ? std::vector<double>{0, 1, 2, 3, 4, 5, 6} : std::vector<double>{3, 5, 7, 9, 11, 15, 19, 23, 27, 31};
  const std::vector<Method> all = methods(options);
  std::vector<picture::Curve> bad, time;
  nlohmann::ordered_json rows = nlohmann::ordered_json::array();
  for (const Method& method : all) {
    bad.push_back({fmt::format("bad > 1 px, %: {}", method.name), {}});
    time.push_back({fmt::format("CPU ms: {}", method.name), {}});
    for (const double value : values) {
      MatcherParameters p = method.parameters;
      if (!noise) {
        p.n_square = static_cast<int>(value);
        p.n_min = std::min(p.n_min, p.n_square);
      }
      const Reading r = read(p, noise ? value : 2);
      bad.back().values.push_back(r.bad_pct);
      time.back().values.push_back(r.time_ms);
      rows.push_back(
          {{"method", method.name}, {options.sweep, value}, {"bad_1px_pct", r.bad_pct}, {"time_ms", r.time_ms}});
    }
  }
  if (options.json) {
    std::printf("%s\n", rows.dump(2).c_str());
  } else {
    std::printf("%-18s", noise ? "sigma, grey levels" : "n_square, px");
    for (const Method& method : all) std::printf(" %18s", method.name);
    std::printf("   (bad > 1 px %% / CPU ms)\n");
    for (size_t i = 0; i < values.size(); ++i) {
      std::printf("%-18g", values[i]);
      for (size_t m = 0; m < all.size(); ++m)
        std::printf(" %18s", fmt::format("{:.1f} / {:.2f}", bad[m].values[i], time[m].values[i]).c_str());
      std::printf("\n");
    }
  }
  if (!options.picture.empty()) {
    if (!noise) bad.insert(bad.end(), time.begin(), time.end());
    picture::write_curves(options.picture, noise ? "sigma" : "n_square", values, bad);
  }
  return kOk;
}

}  // namespace takt::command
