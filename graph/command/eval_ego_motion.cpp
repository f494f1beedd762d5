// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <fstream>
#include <nlohmann/json.hpp>
#include <opencv2/imgcodecs.hpp>
#include <sstream>

#include "graph/command/eval_command.hpp"
#include "graph/command/run_command.hpp"
#include "nodes/ego_motion/ego_motion.hpp"
#include "nodes/ego_motion/evaluate.hpp"
#include "nodes/stereo/matcher.hpp"

namespace takt::command {
namespace {

using ego_motion::Rigid;

/// What is wrong with the data, with the file and the next step.
struct BadData : std::runtime_error {
  using std::runtime_error::runtime_error;
};

std::vector<double> numbers(const std::string& line) {
  std::istringstream in(line);
  std::vector<double> values;
  for (double v; in >> v;) values.push_back(v);
  return values;
}

/// P0 and P1 of a KITTI calib.txt: 3x4 row-major projection matrices.
CameraModel read_calibration(const std::filesystem::path& file) {
  std::ifstream in(file);
  if (!in) throw BadData(fmt::format("{}: cannot be read; --data wants calib.txt with P0: and P1:", file.string()));
  std::vector<double> p0, p1;
  for (std::string line; std::getline(in, line);) {
    if (line.rfind("P0:", 0) == 0) p0 = numbers(line.substr(3));
    if (line.rfind("P1:", 0) == 0) p1 = numbers(line.substr(3));
  }
  const auto usable = [](const std::vector<double>& p) {
    return p.size() == 12 && std::all_of(p.begin(), p.end(), [](double v) { return std::isfinite(v); });
  };
  if (!usable(p0) || !usable(p1) || p0[0] <= 0 || p1[3] >= 0)
    throw BadData(
        fmt::format("{}: P0 and P1 must be 12 finite numbers each, with a baseline to the right", file.string()));
  return {p0[0], p0[2], p0[6], -p1[3] / p1[0]};
}

std::vector<Rigid> read_poses(const std::filesystem::path& file) {
  std::ifstream in(file);
  if (!in) throw BadData(fmt::format("{}: cannot be read; --data wants poses.txt, a 3x4 matrix a line", file.string()));
  std::vector<Rigid> poses;
  for (std::string line; std::getline(in, line);) {
    const std::vector<double> v = numbers(line);
    if (v.empty()) continue;
    if (v.size() != 12)
      throw BadData(fmt::format("{}:{}: {} numbers, 12 are wanted", file.string(), poses.size() + 1, v.size()));
    Rigid pose;
    for (int r = 0; r < 3; ++r) {
      for (int c = 0; c < 3; ++c) pose.R(r, c) = v[static_cast<size_t>(4 * r + c)];
      pose.t(r) = v[static_cast<size_t>(4 * r + 3)];
    }
    poses.push_back(pose);
  }
  return poses;
}

std::vector<std::filesystem::path> images(const std::filesystem::path& folder) {
  std::vector<std::filesystem::path> files;
  std::error_code error;
  for (const auto& entry : std::filesystem::directory_iterator(folder, error)) files.push_back(entry.path());
  if (files.empty()) throw BadData(fmt::format("{}: no images; --data wants image_l/ and image_r/", folder.string()));
  std::sort(files.begin(), files.end());
  return files;
}

cv::Mat read_grey(const std::filesystem::path& file) {
  cv::Mat image = cv::imread(file.string(), cv::IMREAD_GRAYSCALE);
  if (image.empty()) throw BadData(fmt::format("{}: cannot be decoded", file.string()));
  return image;
}

ImageView<const uint8_t> view(const cv::Mat& m) { return {m.data, m.cols, m.rows, 1, static_cast<ptrdiff_t>(m.step)}; }

struct Track {
  std::vector<Rigid> poses;
  std::vector<double> stereo_ms, step_ms;
  int valid = 0;
};

double ms_since(std::chrono::steady_clock::time_point start) {
  return std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - start).count();
}

double median(std::vector<double> v) {
  if (v.empty()) return 0;
  std::nth_element(v.begin(), v.begin() + static_cast<ptrdiff_t>(v.size() / 2), v.end());
  return v[v.size() / 2];
}

Track follow(const EvalEgoMotionOptions& options) {
  const CameraModel camera = read_calibration(options.data / "calib.txt");
  const auto left = images(options.data / "image_l"), right = images(options.data / "image_r");
  if (left.size() != right.size())
    throw BadData(fmt::format("{}: {} left and {} right images", options.data.string(), left.size(), right.size()));
  const cv::Mat first = read_grey(left.front());
  stereo::MatcherParameters match;
  match.disparities = options.disparities;
  const auto matcher = stereo::make_matcher(first.cols, first.rows, 1, match);
  ego_motion::EgoMotion ego;
  ego.configure(first.cols, first.rows, {});
  cv::Mat disparity(first.size(), CV_16S), confidence(first.size(), CV_8U);
  Track track;
  for (size_t i = 0; i < left.size(); ++i) {
    const cv::Mat l = read_grey(left[i]), r = read_grey(right[i]);
    auto start = std::chrono::steady_clock::now();
    const ImageView<int16_t> d{disparity.ptr<int16_t>(), first.cols, first.rows};
    if (!matcher->match(view(l), view(r), {d, {confidence.data, first.cols, first.rows}}))
      throw BadData(fmt::format("{}: size differs from the first image", left[i].string()));
    track.stereo_ms.push_back(ms_since(start));
    start = std::chrono::steady_clock::now();
    const auto result = ego.step({view(l), view(r), d, camera, static_cast<int64_t>(i) * 100'000'000});
    track.step_ms.push_back(ms_since(start));
    track.poses.push_back(result.pose);
    track.valid += result.valid || result.keyframe;
  }
  return track;
}

int evaluate(const EvalEgoMotionOptions& options) {
  try {
    const std::vector<Rigid> truth = read_poses(options.data / "poses.txt");
    const Track track = follow(options);
    if (truth.size() != track.poses.size())
      throw BadData(fmt::format("{}: {} poses for {} images", (options.data / "poses.txt").string(), truth.size(),
                                track.poses.size()));
    const auto q = ego_motion::evaluate(track.poses, truth);
    const std::vector<Rigid> standing(truth.size());
    const auto still = ego_motion::evaluate(standing, truth);
    nlohmann::ordered_json out{
        {"drift_pct", q.drift_pct},
        {"deg_per_frame", q.deg_per_frame},
        {"metres_per_frame", q.metres_per_frame},
        {"path_m", q.path_m},
        {"frames", truth.size()},
        {"valid_frames", track.valid},
        {"time_ms", median(track.step_ms)},
        {"stereo_time_ms", median(track.stereo_ms)},
        {"baseline",
         {{"name", "standing still"}, {"drift_pct", still.drift_pct}, {"deg_per_frame", still.deg_per_frame}}}};
    if (options.json) {
      std::printf("%s\n", out.dump(2).c_str());
    } else {
      std::printf("%-18s %10s %14s %14s %9s\n", "method", "drift %", "deg per frame", "m per frame", "time ms");
      std::printf("%-18s %10.2f %14.4f %14.4f %9.2f\n", "takt ego_motion", q.drift_pct, q.deg_per_frame,
                  q.metres_per_frame, median(track.step_ms));
      std::printf("%-18s %10.2f %14.4f %14.4f %9s\n", "standing still", still.drift_pct, still.deg_per_frame,
                  still.metres_per_frame, "-");
      std::printf("path %.1f m, %zu frames, %d with a valid motion; stereo %.2f ms a frame\n", q.path_m, truth.size(),
                  track.valid, median(track.stereo_ms));
    }
    return kOk;
  } catch (const std::exception& error) {
    std::fprintf(stderr, "takt: error: %s\n", error.what());
    return kBadInput;
  }
}

}  // namespace

void add_eval_ego_motion(CLI::App& eval, EvalEgoMotionOptions& o, int& exit_code) {
  CLI::App* app = eval.add_subcommand("ego_motion", "drift and rotation error of stereo ego-motion against poses");
  app->add_option("--data", o.data, "folder with image_l/, image_r/, calib.txt, poses.txt")->required();
  app->add_option("--disparities", o.disparities, "search range, px (default 128)")->check(CLI::Range(16, 512));
  app->add_flag("--json", o.json, "one JSON object on stdout");
  app->callback([&] { exit_code = evaluate(o); });
}

}  // namespace takt::command
