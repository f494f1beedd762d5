// SPDX-License-Identifier: Apache-2.0
#include "hal/replay/recording_layout.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <fstream>
#include <initializer_list>
#include <map>

namespace takt::replay {
namespace {

namespace fs = std::filesystem;

bool folders(const fs::path& directory, std::initializer_list<const char*> names) {
  std::error_code failed;
  return std::all_of(names.begin(), names.end(),
                     [&](const char* name) { return fs::is_directory(directory / name, failed); });
}

/// Names in the folder other than these.
std::string others(const fs::path& directory, std::initializer_list<std::string> read) {
  std::vector<std::string> names;
  std::error_code failed;
  for (fs::directory_iterator at(directory, failed), end; !failed && at != end; at.increment(failed))
    if (const std::string name = at->path().filename().string();
        std::find(read.begin(), read.end(), name) == read.end())
      names.push_back(name);
  std::sort(names.begin(), names.end());
  std::string text;
  for (const std::string& name : names) text += (text.empty() ? "" : ", ") + name;
  return text;
}

void tell_others(RecordingLayout& layout, const char* what, const fs::path& directory,
                 std::initializer_list<std::string> read) {
  if (const std::string names = others(directory, read); !names.empty())
    layout.left_out.push_back(directory.string() + ": a recording as " + what + "; not read: " + names);
}

std::optional<RecordingLayout> kitti_odometry(const fs::path& directory) {
  for (const auto& [left, right] : {std::pair('0', '1'), std::pair('2', '3')}) {
    const std::string a = std::string("image_") + left, b = std::string("image_") + right;
    if (!folders(directory, {a.c_str(), b.c_str()})) continue;
    RecordingLayout layout{directory / a,
                           directory / b,
                           directory / "calib.txt",
                           std::string("P") + left + ":",
                           std::string("P") + right + ":",
                           directory / "times.txt",
                           {}};
    tell_others(layout, "KITTI odometry", directory, {a, b, "calib.txt", "times.txt"});
    return layout;
  }
  return std::nullopt;
}

std::optional<RecordingLayout> kitti_raw(const fs::path& directory) {
  std::error_code failed;
  for (const auto& [left, right] : {std::pair('0', '1'), std::pair('2', '3')}) {
    const std::string a = std::string("image_0") + left, b = std::string("image_0") + right;
    if (!folders(directory, {(a + "/data").c_str(), (b + "/data").c_str()})) continue;
    fs::path calibration = directory / "calib_cam_to_cam.txt";  // that of the day lies above the drive
    if (!fs::exists(calibration, failed))
      calibration = fs::absolute(directory).lexically_normal() / ".." / "calib_cam_to_cam.txt";
    RecordingLayout layout{directory / a / "data",
                           directory / b / "data",
                           calibration.lexically_normal(),
                           std::string("P_rect_0") + left + ":",
                           std::string("P_rect_0") + right + ":",
                           directory / a / "timestamps.txt",
                           {}};
    tell_others(layout, "KITTI raw", directory, {a, b, "calib_cam_to_cam.txt"});
    return layout;
  }
  return std::nullopt;
}

std::optional<RecordingLayout> euroc(const fs::path& directory) {
  for (const fs::path& root : {directory / "mav0", directory}) {
    if (!folders(root, {"cam0/data", "cam1/data"})) continue;
    RecordingLayout layout{root / "cam0/data", root / "cam1/data", {}, "", "", {}, {}};
    tell_others(layout, "EuRoC", root, {"cam0", "cam1"});
    layout.left_out.push_back(root.string() + ": the images are not rectified; give node stereo `calibration: " +
                              (root / "cam0/sensor.yaml").string() + "`");
    return layout;
  }
  return std::nullopt;
}

}  // namespace

std::optional<RecordingLayout> find_layout(const fs::path& directory) {
  if (folders(directory, {"image_l"}) || folders(directory, {"image_r"}))
    return RecordingLayout{directory / "image_l",
                           directory / "image_r",
                           directory / "calib.txt",
                           "P0:",
                           "P1:",
                           directory / "times.txt",
                           {}};
  if (auto layout = kitti_odometry(directory)) return layout;
  if (auto layout = kitti_raw(directory)) return layout;
  return euroc(directory);
}

bool is_rgbd(const fs::path& directory) {
  std::error_code failed;
  return fs::exists(directory / "rgb.txt", failed) && fs::exists(directory / "depth.txt", failed);
}

std::optional<CameraModel> middlebury_camera(const fs::path& calibration, std::vector<std::string>& left_out) {
  std::ifstream in(calibration);
  std::map<std::string, std::string> values;
  for (std::string line; std::getline(in, line);)
    if (const size_t at = line.find('='); at != std::string::npos) values[line.substr(0, at)] = line.substr(at + 1);
  CameraModel camera;
  double skew = 0, baseline_mm = 0, doffs = 0;
  if (std::sscanf(values["cam0"].c_str(), "[%lf %lf %lf; 0 %*f %lf;", &camera.focal_px, &skew, &camera.cu_px,
                  &camera.cv_px) != 4 ||
      std::sscanf(values["baseline"].c_str(), "%lf", &baseline_mm) != 1)
    return std::nullopt;
  camera.baseline_m = baseline_mm / 1000;
  if (std::sscanf(values["doffs"].c_str(), "%lf", &doffs) == 1 && std::abs(doffs) > 0.005)
    left_out.push_back(calibration.string() + ": doffs=" + values["doffs"].substr(0, 20) +
                       " px is not applied: disparities are smaller by it, depths too large");
  return camera;
}

}  // namespace takt::replay
