// SPDX-License-Identifier: Apache-2.0
#include "graph/evaluate/ego_motion_drive.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <opencv2/imgproc.hpp>
#include <sstream>
#include <string>

#include "graph/evaluate/evaluations.hpp"
#include "nodes/ego_motion/evaluate.hpp"
#include "nodes/stereo/matcher.hpp"
#include "rt/file/input_file.hpp"
#include "rt/image_file/image_file.hpp"
#include "rt/image_file/image_list.hpp"
#include "rt/quantile.hpp"
#include "rt/time/clock.hpp"

namespace takt::command {
namespace {

using ego_motion::Rigid;

std::vector<double> numbers(const std::string& line) {
  std::istringstream in(line);
  std::vector<double> values;
  for (double v; in >> v;) values.push_back(v);
  return values;
}

/// P0 and P1 of a KITTI calib.txt: 3x4 row-major projection matrices.
CameraModel read_calibration(const std::filesystem::path& file) {
  if (std::filesystem::exists(file)) require_readable<BadData>(file);
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
  if (std::filesystem::exists(file)) require_readable<BadData>(file);
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
  ImageList list;
  if (std::filesystem::is_directory(folder)) list = list_images(folder);
  if (list.files.empty())
    throw BadData(fmt::format("{}: no images; --data wants image_l/ and image_r/", folder.string()));
  if (const std::string left = left_out_text(folder, list); !left.empty())
    std::fprintf(stderr, "takt: %s\n", left.c_str());
  return list.files;
}

cv::Mat read_grey(const std::filesystem::path& file, double scale) {
  cv::Mat image = read_image(file, Channels::grey);
  if (scale != 1) cv::resize(image, image, {}, scale, scale, cv::INTER_AREA);
  return image;
}

ImageView<const uint8_t> view(const cv::Mat& m) { return {m.data, m.cols, m.rows, 1, static_cast<ptrdiff_t>(m.step)}; }

template <class Work>
double cpu_ms(Work work) {
  const int64_t start = thread_cpu_ns();
  work();
  return static_cast<double>(thread_cpu_ns() - start) / 1e6;
}

}  // namespace

void add_disparity(Drive& drive, int disparities) {
  const cv::Size size = drive.frames.front().left.size();
  stereo::MatcherParameters parameters;
  parameters.disparities = disparities;
  const auto matcher = stereo::make_matcher(size.width, size.height, 1, parameters);
  cv::Mat confidence(size, CV_8U);
  std::vector<double> times;
  for (DriveFrame& frame : drive.frames) {
    frame.disparity.create(size, CV_16S);
    bool matched = false;
    times.push_back(cpu_ms([&] {
      matched = matcher->match(
          view(frame.left), view(frame.right),
          {{frame.disparity.ptr<int16_t>(), size.width, size.height}, {confidence.data, size.width, size.height}});
    }));
    if (!matched)
      throw BadData(fmt::format("frame {}: size differs from the first image", &frame - drive.frames.data()));
  }
  drive.stereo_ms = quantile(times, 0.5);
}

Drive read_drive(const std::filesystem::path& folder, double scale, int disparities) {
  const auto poses = read_poses(folder / "poses.txt");
  Drive drive;
  drive.camera = read_calibration(folder / "calib.txt");
  // Pixel centres have whole coordinates.
  drive.camera.focal_px *= scale;
  drive.camera.cu_px = (drive.camera.cu_px + 0.5) * scale - 0.5;
  drive.camera.cv_px = (drive.camera.cv_px + 0.5) * scale - 0.5;
  const auto left = images(folder / "image_l"), right = images(folder / "image_r");
  if (left.size() != right.size() || left.size() != poses.size())
    throw BadData(fmt::format("{}: {} left images, {} right images and {} poses", folder.string(), left.size(),
                              right.size(), poses.size()));
  for (size_t i = 0; i < left.size(); ++i)
    drive.frames.push_back(
        {read_grey(left[i], scale), read_grey(right[i], scale), {}, poses[i], static_cast<int64_t>(i) * 100'000'000});
  add_disparity(drive, disparities);
  return drive;
}

Drive recorded_drive(const EvalEgoMotionOptions& options) {
  return read_drive(options.data, options.scale, static_cast<int>(std::ceil(options.disparities * options.scale)));
}

std::vector<Rigid> Track::poses() const {
  std::vector<Rigid> all;
  for (const auto& result : results) all.push_back(ego_motion::from_transform(result.pose.transform));
  return all;
}

ego_motion::Frame frame_of(const Drive& drive, size_t index) {
  const DriveFrame& frame = drive.frames[index];
  return {view(frame.left),
          view(frame.right),
          {frame.disparity.ptr<int16_t>(), frame.disparity.cols, frame.disparity.rows},
          drive.camera,
          frame.stamp_ns};
}

Track follow(const Drive& drive, const ego_motion::Parameters& parameters) {
  ego_motion::EgoMotion ego;
  ego.configure(drive.frames.front().left.cols, drive.frames.front().left.rows, parameters);
  Track track;
  std::vector<double> times;
  for (size_t i = 0; i < drive.frames.size(); ++i)
    times.push_back(cpu_ms([&] { track.results.push_back(ego.step(frame_of(drive, i))); }));
  track.step_ms = quantile(times, 0.5);
  return track;
}

}  // namespace takt::command
