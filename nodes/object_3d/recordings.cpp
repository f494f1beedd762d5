// SPDX-License-Identifier: Apache-2.0
// Recorded table scenes with labels, for evaluate.hpp.
#include <Eigen/Dense>
#include <algorithm>
#include <map>
#include <set>
#include <stdexcept>

#include "nodes/object_3d/evaluate.hpp"
#include "rt/image_file/image_file.hpp"
#include "rt/msg/geometry.hpp"
#include "rt/msg/point.hpp"
#include "rt/time/clock.hpp"

namespace takt::object_3d {
namespace {

/// The camera that mOSD was recorded with: depth on the pixels of the colour image.
const CameraModel kKinect{525, 319.5, 239.5, 0.075};
constexpr int kTableLabels = 9, kLabelsPerObject = 10;
constexpr double kTable_m = 0.75;

struct Recording {
  std::vector<Point> points;
  std::vector<Colour> colours;
  std::vector<int> object;  ///< of each point: 0 none, else the number of the object
  Transform sensor_in_robot;
  SensorCloud cloud() const { return {points, colours, kKinect, 1, sensor_in_robot}; }
};

/// The pose in which that plane is level and kTable_m high, the camera above the origin.
Transform level(const std::vector<Eigen::Vector3d>& table) {
  Eigen::Vector3d mean = Eigen::Vector3d::Zero();
  for (const auto& p : table) mean += p;
  mean /= static_cast<double>(table.size());
  Eigen::Matrix3d covariance = Eigen::Matrix3d::Zero();
  for (const auto& p : table) covariance += (p - mean) * (p - mean).transpose();
  Eigen::Vector3d up = Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d>(covariance).eigenvectors().col(0);
  if (up.dot(mean) > 0) up = -up;  // towards the camera
  const Eigen::Vector3d right = Eigen::Vector3d::UnitX() - up * up.x(), forward = up.cross(right.normalized());
  Eigen::Matrix3d rotation;
  rotation << right.normalized().transpose(), forward.transpose(), up.transpose();
  const Eigen::Quaterniond q(rotation);
  return {0, 0, kTable_m - (rotation * mean).z(), q.w(), q.x(), q.y(), q.z()};
}

Recording read_recording(const std::filesystem::path& folder, const std::string& name) {
  const cv::Mat3b picture = read_image(folder / (name + "_rgb.png"), Channels::colour);
  const cv::Mat depth = read_values(folder / (name + "_depth_mm.png"));
  const cv::Mat label = read_values(folder / (name + "_label.png"));
  if (depth.type() != CV_16UC1 || label.type() != CV_8UC1 || depth.size() != picture.size() ||
      label.size() != depth.size())
    throw std::runtime_error((folder / name).string() +
                             ": depth must have 16 bit, labels 8, both the size of the picture");
  Recording r;
  std::vector<Eigen::Vector3d> table;
  for (int v = 0; v < depth.rows; ++v)
    for (int u = 0; u < depth.cols; ++u) {
      const double z = depth.at<uint16_t>(v, u) * 1e-3;
      if (z <= 0) continue;
      const double x = (u - kKinect.cu_px) * z / kKinect.focal_px, y = (v - kKinect.cv_px) * z / kKinect.focal_px;
      const int what = label.at<uint8_t>(v, u);
      r.points.push_back({static_cast<float>(x), static_cast<float>(y), static_cast<float>(z)});
      r.colours.push_back({picture(v, u)[0], picture(v, u)[1], picture(v, u)[2]});
      r.object.push_back(what > kTableLabels ? what / kLabelsPerObject : 0);
      if (what > 0 && what <= kTableLabels) table.emplace_back(x, y, z);
    }
  if (table.size() < 3)
    throw std::runtime_error((folder / name).string() + "_label.png: no pixel is labelled as table");
  r.sensor_in_robot = level(table);
  return r;
}

MatchedScene match(const std::string& name, const Recording& r, double colour_max) {
  FinderParameters p;
  p.segment.points_min = 300;
  p.segment.grow.colour_max = static_cast<float>(colour_max);
  ObjectFinder finder(r.points.size(), 64, p, nullptr);
  MatchedScene scene{name};
  const int64_t begin = thread_cpu_ns();  // replay: a figure of the evaluation, no node calls this
  const auto found = finder.run(r.cloud(), {}, [] { return true; });
  scene.time_ms = static_cast<double>(thread_cpu_ns() - begin) * 1e-6;  // replay: likewise
  scene.found = found.size();
  std::map<int, size_t> labelled;
  for (const int object : r.object) labelled[object] += object > 0;
  labelled.erase(0);
  std::map<int, double> best;
  for (const FoundObject& object : found) {
    const auto points = finder.points_of(object);
    std::map<int, size_t> common;
    for (const uint32_t i : points) ++common[r.object[i]];
    for (const auto& [number, size] : labelled) {
      const size_t both = common[number];
      const double overlap = static_cast<double>(both) / static_cast<double>(points.size() + size - both);
      best[number] = std::max(best[number], overlap);
    }
  }
  scene.labelled = labelled.size();
  for (const auto& [number, size] : labelled) {
    scene.matched += best[number] >= 0.5;
    scene.mean_overlap += best[number] / static_cast<double>(labelled.size());
  }
  return scene;
}

}  // namespace

std::vector<MatchedScene> match_recordings(const std::filesystem::path& folder, double colour_max) {
  constexpr std::string_view kEnd = "_label.png";
  std::set<std::string> names;
  std::error_code none;
  for (const auto& entry : std::filesystem::directory_iterator(folder, none)) {
    const std::string name = entry.path().filename().string();
    if (name.size() > kEnd.size() && name.ends_with(kEnd)) names.insert(name.substr(0, name.size() - kEnd.size()));
  }
  if (names.empty()) throw std::runtime_error(folder.string() + ": holds no NAME_label.png");
  std::vector<MatchedScene> scenes;
  for (const std::string& name : names) scenes.push_back(match(name, read_recording(folder, name), colour_max));
  return scenes;
}

}  // namespace takt::object_3d
