// SPDX-License-Identifier: Apache-2.0
#include "nodes/mapping_3d/recorded_views.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <iterator>
#include <map>
#include <opencv2/core.hpp>
#include <sstream>
#include <stdexcept>

#include "rt/file/input_file.hpp"
#include "rt/image_file/image_file.hpp"

namespace takt::mapping_3d {
namespace {

/// Focal lengths and principal point, px; the depth of a 1, m.
struct Sensor {
  double fx, fy, cu, cv;
  float unit_m;
};
constexpr Sensor kSlambook{518, 519, 325.5, 253.5, 0.001f}, kTum{525, 525, 319.5, 239.5, 0.0002f};
constexpr int kShrink = 2;
constexpr double kBaseline_m = 0.24, kNoise_px = 0.2, kWrong = 0.02, kMissing = 0.1, kFarthest_m = 5;
constexpr size_t kTumViews = 8;
constexpr double kTumApart_s = 0.2, kTumNearest_s = 0.02;

RecordedView read_view(const std::filesystem::path& file, const Sensor& s, const Transform& pose) {
  const cv::Mat image = read_values(file);
  if (image.type() != CV_16UC1) throw std::runtime_error(file.string() + ": is no 16-bit depth image");
  RecordedView view{{image.cols / kShrink, image.rows / kShrink, s.fx / kShrink, s.cu / kShrink, s.cv / kShrink,
                     1 / (s.fx * kBaseline_m)},
                    pose,
                    {}};
  // fy differs from fx by 0.2 %: rows are taken where a camera with square pixels has them.
  for (int v = 0; v < view.camera.height; ++v) {
    const int row =
        std::clamp(static_cast<int>(std::lround(s.cv + (v * kShrink - s.cv) * s.fy / s.fx)), 0, image.rows - 1);
    for (int u = 0; u < view.camera.width; ++u)
      view.depth_m.push_back(static_cast<float>(image.at<uint16_t>(row, u * kShrink)) * s.unit_m);
  }
  return view;
}

/// "TIME WORDS" of each line that is no comment: `take(time, rest of the line)` says whether it was understood.
template <class Take>
void read_lines(const std::filesystem::path& file, const Take& take) {
  std::ifstream in(file);
  if (!in) throw std::runtime_error(file.string() + ": cannot be read");
  std::string line;
  for (int number = 1; std::getline(in, line); ++number) {
    if (line.find_first_not_of(" \t\r") == std::string::npos || line[0] == '#') continue;
    std::istringstream words(line);
    double time_s = 0;
    if (!(words >> time_s) || !take(time_s, words))
      throw std::runtime_error(
          fmt::format("{}:{}: `{}` is no time with what belongs to it", file.string(), number, line.substr(0, 60)));
  }
}

std::vector<RecordedView> read_tum(const std::filesystem::path& folder, std::vector<std::string>& left_out) {
  std::map<double, Transform> poses;
  read_lines(folder / "groundtruth.txt", [&](double time_s, std::istream& words) {
    Transform& p = poses[time_s];
    return static_cast<bool>(words >> p.x >> p.y >> p.z >> p.qx >> p.qy >> p.qz >> p.qw);
  });
  std::vector<RecordedView> views;
  size_t images = 0, without_pose = 0;
  double last_s = -kTumApart_s;
  read_lines(folder / "depth.txt", [&](double time_s, std::istream& words) {
    std::string file;
    if (!(words >> file)) return false;
    ++images;
    auto nearest = poses.lower_bound(time_s);
    if (nearest != poses.begin() &&
        (nearest == poses.end() || time_s - std::prev(nearest)->first < nearest->first - time_s))
      --nearest;
    const bool has_pose = nearest != poses.end() && std::abs(nearest->first - time_s) <= kTumNearest_s;
    without_pose += has_pose ? 0 : 1;
    if (!has_pose || views.size() == kTumViews || time_s - last_s < kTumApart_s - 1e-3) return true;
    views.push_back(read_view(folder / file, kTum, nearest->second));
    last_s = time_s;
    return true;
  });
  left_out.push_back(
      fmt::format("{}: as TUM RGB-D; {} of {} depth images are read, {} have no pose within {} s; colour and "
                  "acceleration are not read",
                  folder.string(), views.size(), images, without_pose, kTumNearest_s));
  if (views.empty()) throw std::runtime_error((folder / "depth.txt").string() + ": no depth image has a pose");
  return views;
}

}  // namespace

std::vector<RecordedView> read_recorded_views(const std::filesystem::path& folder, std::vector<std::string>& left_out) {
  if (std::filesystem::exists(folder / "groundtruth.txt") && std::filesystem::exists(folder / "depth.txt"))
    return read_tum(folder, left_out);
  require_readable(folder / "pose.txt");
  std::ifstream poses(folder / "pose.txt");
  std::vector<RecordedView> views;
  Transform pose;
  while (poses >> pose.x >> pose.y >> pose.z >> pose.qx >> pose.qy >> pose.qz >> pose.qw)
    views.push_back(read_view(folder / "depth" / fmt::format("{}.png", views.size() + 1), kSlambook, pose));
  if (views.empty()) throw std::runtime_error((folder / "pose.txt").string() + ": holds no pose of seven numbers");
  if (!poses.eof())
    left_out.push_back(
        fmt::format("{}: lines behind the first {} poses are no poses", (folder / "pose.txt").string(), views.size()));
  return views;
}

std::vector<float> with_stereo_noise(const RecordedView& view, Lot& lot) {
  std::vector<float> noisy;
  for (const float depth : view.depth_m) {
    double disparity = kSlambook.fx * kBaseline_m / depth + kNoise_px * lot.normal();
    if (lot.chance(kWrong)) disparity = lot.in(kSlambook.fx * kBaseline_m / kFarthest_m, 100);
    const bool measured = depth > 0 && depth < kFarthest_m && !lot.chance(kMissing) && disparity > 0;
    noisy.push_back(measured ? static_cast<float>(kSlambook.fx * kBaseline_m / disparity) : 0.0f);
  }
  return noisy;
}

}  // namespace takt::mapping_3d
