// SPDX-License-Identifier: Apache-2.0
#include "nodes/mapping_3d/recorded_views.hpp"

#include <fmt/format.h>

#include <fstream>
#include <opencv2/core.hpp>
#include <opencv2/imgcodecs.hpp>
#include <stdexcept>

#include "rt/file/input_file.hpp"

namespace takt::mapping_3d {
namespace {

constexpr double kFx = 518, kFy = 519, kCu = 325.5, kCv = 253.5;  // of the recordings
constexpr int kShrink = 2;
constexpr double kBaseline_m = 0.24, kNoise_px = 0.2, kWrong = 0.02, kMissing = 0.1, kFarthest_m = 5;

}  // namespace

std::vector<RecordedView> read_recorded_views(const std::filesystem::path& folder) {
  require_readable(folder / "pose.txt");
  std::ifstream poses(folder / "pose.txt");
  std::vector<RecordedView> views;
  Transform pose;
  while (poses >> pose.x >> pose.y >> pose.z >> pose.qx >> pose.qy >> pose.qz >> pose.qw) {
    const std::filesystem::path file = folder / "depth" / fmt::format("{}.png", views.size() + 1);
    const cv::Mat image = cv::imread(file.string(), cv::IMREAD_UNCHANGED);
    if (image.empty() || image.type() != CV_16UC1)
      throw std::runtime_error(file.string() + ": is no 16-bit depth image, or cannot be read");
    RecordedView view{{image.cols / kShrink, image.rows / kShrink, kFx / kShrink, kCu / kShrink, kCv / kShrink,
                       1 / (kFx * kBaseline_m)},
                      pose,
                      {}};
    // fy differs from fx by 0.2 %: rows are taken where a camera with square pixels has them.
    for (int v = 0; v < view.camera.height; ++v) {
      const int row =
          std::clamp(static_cast<int>(std::lround(kCv + (v * kShrink - kCv) * kFy / kFx)), 0, image.rows - 1);
      for (int u = 0; u < view.camera.width; ++u)
        view.depth_m.push_back(static_cast<float>(image.at<uint16_t>(row, u * kShrink)) * 0.001f);
    }
    views.push_back(std::move(view));
  }
  if (views.empty()) throw std::runtime_error((folder / "pose.txt").string() + ": holds no pose of seven numbers");
  return views;
}

std::vector<float> with_stereo_noise(const RecordedView& view, Lot& lot) {
  std::vector<float> noisy;
  for (const float depth : view.depth_m) {
    double disparity = kFx * kBaseline_m / depth + kNoise_px * lot.normal();
    if (lot.chance(kWrong)) disparity = lot.in(kFx * kBaseline_m / kFarthest_m, 100);
    const bool measured = depth > 0 && depth < kFarthest_m && !lot.chance(kMissing) && disparity > 0;
    noisy.push_back(measured ? static_cast<float>(kFx * kBaseline_m / disparity) : 0.0f);
  }
  return noisy;
}

}  // namespace takt::mapping_3d
