// SPDX-License-Identifier: Apache-2.0
#include "graph/evaluate/laser_stereo.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <map>
#include <sstream>
#include <stdexcept>
#include <tuple>
#include <vector>

#include "nodes/stereo/matcher.hpp"
#include "nodes/stereo/triangulate.hpp"
#include "rt/file/input_file.hpp"
#include "rt/image_file/image_file.hpp"
#include "rt/msg/point.hpp"
#include "rt/quantile.hpp"

namespace takt::command {
namespace {

using Eigen::Matrix3d, Eigen::Vector3d;
using laser_fusion::Rigid;

constexpr float kNearest_m = 3, kFarthest_m = 20;
constexpr float kAside = 0.84f, kUpwards = 0.25f;  // tangents of 40 and 14 degrees
constexpr double kSameSurface_px = 3;
constexpr size_t kLeastOfMedian = 100;
constexpr int kDisparities = 160, kStep = 2;  // every other pixel

/// Lines of "NAME: number ...".
class CalibrationFile {
 public:
  explicit CalibrationFile(std::filesystem::path file) : file_(std::move(file)) {}

  Eigen::MatrixXd matrix(const std::string& name, int rows, int columns) const {
    require_readable<std::invalid_argument>(file_);
    std::ifstream in(file_);
    for (std::string line; std::getline(in, line);) {
      if (line.rfind(name + ":", 0) != 0) continue;
      std::istringstream numbers(line.substr(name.size() + 1));
      Eigen::MatrixXd out(rows, columns);
      for (int i = 0; i < rows * columns; ++i)
        if (!(numbers >> out(i / columns, i % columns)))
          throw std::invalid_argument(
              fmt::format("{}: {} must be {} x {} numbers", file_.string(), name, rows, columns));
      return out;
    }
    throw std::invalid_argument(fmt::format("{}: has no line \"{}: ...\"", file_.string(), name));
  }

 private:
  std::filesystem::path file_;
};

/// The laser in the frame of the rectified left colour camera: its own rectified frame is that of camera 0, shifted.
Rigid laser_in_camera(const std::filesystem::path& folder, const Eigen::MatrixXd& left) {
  const CalibrationFile cameras(folder / "calib_cam_to_cam.txt"), laser(folder / "calib_velo_to_cam.txt");
  const Matrix3d rectify = cameras.matrix("R_rect_00", 3, 3), turn = laser.matrix("R", 3, 3);
  const Vector3d shift = laser.matrix("T", 3, 1);
  const Vector3d camera = left.leftCols<3>().inverse() * left.col(3);
  return {rectify * turn, rectify * shift + camera};
}

/// Left and right.
std::pair<cv::Mat, cv::Mat> read_images(const std::filesystem::path& folder) {
  std::pair pair(read_image(folder / "image_02.png", Channels::colour),
                 read_image(folder / "image_03.png", Channels::colour));
  if (pair.first.size() != pair.second.size())
    throw std::invalid_argument(folder.string() + ": image_02.png and image_03.png differ in size");
  return pair;
}

cloud::Cloud stereo_cloud(const std::filesystem::path& folder, const CameraModel& camera) {
  const auto [left, right] = read_images(folder);
  stereo::MatcherParameters p = stereo::MatcherParameters::quality();
  p.disparities = kDisparities;
  p.subpixel = p.left_right_check = true;
  const auto view = [](const cv::Mat& m) {
    return ImageView<const uint8_t>{m.data, m.cols, m.rows, m.channels(), static_cast<ptrdiff_t>(m.step)};
  };
  cv::Mat disparity(left.size(), CV_16S), confidence(left.size(), CV_8U), fraction(left.size(), CV_8U);
  const stereo::DisparityViews map{{disparity.ptr<int16_t>(), left.cols, left.rows},
                                   {confidence.data, left.cols, left.rows},
                                   {fraction.data, left.cols, left.rows}};
  if (!stereo::make_matcher(left.cols, left.rows, left.channels(), p)->match(view(left), view(right), map))
    throw std::logic_error("the matcher refused a pair of its own size");
  cloud::Cloud all, out;
  all.points.resize(left.total());
  all.colours.resize(left.total());
  const size_t count = stereo::triangulate(map, view(left), camera, kStep, all.points, all.colours);
  for (size_t i = 0; i < count; ++i) {
    if (all.points[i].z < kNearest_m || all.points[i].z > kFarthest_m) continue;
    out.points.push_back(all.points[i]);
    out.colours.push_back(all.colours[i]);
  }
  return out;
}

/// x ahead, y left.
std::vector<Point> laser_points(const std::filesystem::path& folder) {
  const std::filesystem::path file = folder / "velodyne.bin";
  std::ifstream in(file, std::ios::binary);
  if (!in) throw std::invalid_argument(file.string() + ": cannot be read");
  std::vector<Point> out;
  for (float r[4]; in.read(reinterpret_cast<char*>(r), sizeof r);)
    out.push_back({r[0], r[1], r[2]});  // and reflectance
  return out;
}

cloud::Cloud laser_cloud(const std::filesystem::path& folder) {
  cloud::Cloud out;
  for (const Point& p : laser_points(folder)) {
    if (p.x < kNearest_m || p.x > kFarthest_m) continue;
    if (std::abs(p.y) > kAside * p.x || std::abs(p.z) > kUpwards * p.x) continue;
    out.points.push_back(p);
  }
  return out;
}

/// Of the rectified colour cameras, from the projections of both.
CameraModel camera_model(const std::filesystem::path& folder, const Eigen::MatrixXd& left,
                         const Eigen::MatrixXd& right) {
  const CameraModel camera{left(0, 0), left(0, 2), left(1, 2), (left(0, 3) - right(0, 3)) / left(0, 0)};
  if (!(camera.focal_px > 0) || !(camera.baseline_m > 0))
    throw std::invalid_argument(folder.string() + ": calib_cam_to_cam.txt has no baseline to the right");
  return camera;
}

}  // namespace

LaserStereo read_laser_stereo(const std::filesystem::path& folder) {
  const CalibrationFile cameras(folder / "calib_cam_to_cam.txt");
  const Eigen::MatrixXd left = cameras.matrix("P_rect_02", 3, 4);
  const CameraModel camera = camera_model(folder, left, cameras.matrix("P_rect_03", 3, 4));
  return {{laser_cloud(folder), stereo_cloud(folder, camera), laser_in_camera(folder, left).inverse()}, camera};
}

LaserTruth read_laser_truth(const std::filesystem::path& folder) {
  const CalibrationFile cameras(folder / "calib_cam_to_cam.txt");
  const Eigen::MatrixXd left = cameras.matrix("P_rect_02", 3, 4);
  const CameraModel camera = camera_model(folder, left, cameras.matrix("P_rect_03", 3, 4));
  const Rigid into_camera = laser_in_camera(folder, left);
  LaserTruth out;
  std::tie(out.left, out.right) = read_images(folder);
  out.disparity = {out.left.cols, out.left.rows, std::vector<float>(out.left.total())};
  for (const Point& point : laser_points(folder)) {
    const Vector3d p = into_camera * Vector3d(point.x, point.y, point.z);
    if (p.z() <= 0) continue;
    const double u = camera.focal_px * p.x() / p.z() + camera.cu_px, v = camera.focal_px * p.y() / p.z() + camera.cv_px;
    if (u < -0.5 || v < -0.5 || u >= out.left.cols - 0.5 || v >= out.left.rows - 0.5) continue;
    float& pixel = out.disparity.at(static_cast<int>(std::lround(u)), static_cast<int>(std::lround(v)));
    pixel = std::max(pixel, static_cast<float>(camera.focal_px * camera.baseline_m / p.z()));
  }
  return out;
}

std::optional<double> disparity_bias_px(const LaserStereo& scene, double from_m, double to_m) {
  const CameraModel& c = scene.camera;
  const double px_m = c.focal_px * c.baseline_m;
  const auto pixel = [&](const Vector3d& p) {
    return std::pair(std::lround((c.focal_px * p.x() / p.z() + c.cu_px) / kStep),
                     std::lround((c.focal_px * p.y() / p.z() + c.cv_px) / kStep));
  };
  std::map<std::pair<long, long>, double> disparity_px;
  for (const Point& p : scene.pair.vision.points)
    disparity_px[pixel({p.x, p.y, p.z})] = px_m / static_cast<double>(p.z);
  const Rigid into_camera = scene.pair.vision_in_laser.inverse();
  std::vector<double> excess_px;
  for (const Point& p : scene.pair.laser.points) {
    const Vector3d at = into_camera * Vector3d(p.x, p.y, p.z);
    if (at.z() < from_m || at.z() > to_m) continue;
    const auto seen = disparity_px.find(pixel(at));
    if (seen == disparity_px.end()) continue;
    if (const double excess = seen->second - px_m / at.z(); std::abs(excess) <= kSameSurface_px)
      excess_px.push_back(excess);
  }
  if (excess_px.size() < kLeastOfMedian) return std::nullopt;
  return quantile(std::move(excess_px), 0.5);
}

cloud::Cloud with_less_disparity(const cloud::Cloud& vision, const CameraModel& camera, double px) {
  cloud::Cloud out = vision;
  for (Point& p : out.points) {  // along its ray
    const double disparity_px = camera.focal_px * camera.baseline_m / static_cast<double>(p.z);
    const auto farther = static_cast<float>(disparity_px / (disparity_px - px));
    p = {farther * p.x, farther * p.y, farther * p.z};
  }
  return out;
}

}  // namespace takt::command
