// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <array>
#include <cmath>
#include <memory>
#include <numbers>
#include <opencv2/imgproc.hpp>

#include "graph/evaluate/ego_motion_drive.hpp"
#include "hal/sim/random.hpp"
#include "hal/sim/renderer.hpp"

namespace takt::command {
namespace {

using ego_motion::Rigid;
using sim::Vec3;

constexpr double kDegree = std::numbers::pi / 180;
constexpr double kRate_Hz = 10;
constexpr double kBaseline_m = 0.24;
constexpr double kWidth_m = 8, kDepth_m = 6, kHeight_m = 2.8;
constexpr sim::Pinhole kCamera{640, 480, 492.8, 319.5, 239.5};  // 66 degrees

/// What stands in the room. Faces of the walls look inwards.
sim::Scene room(uint64_t seed) {
  sim::Scene scene;
  scene.textures = sim::textures_of(seed);
  const std::array<Vec3, 4> floor{Vec3(0, 0, 0), Vec3(kWidth_m, 0, 0), Vec3(kWidth_m, kDepth_m, 0),
                                  Vec3(0, kDepth_m, 0)};
  const Vec3 up(0, 0, kHeight_m);
  scene.quads.push_back(sim::make_quad(floor, sim::Material::floor));
  scene.quads.push_back(
      sim::make_quad({floor[0] + up, floor[3] + up, floor[2] + up, floor[1] + up}, sim::Material::ceiling));
  for (size_t i = 0; i < 4; ++i) {
    const Vec3 &a = floor[(i + 1) % 4], &b = floor[i];
    scene.quads.push_back(sim::make_quad({a, b, b + up, a + up}, sim::Material::plaster, static_cast<double>(i)));
  }
  using M = sim::Material;
  sim::add_box(scene, {6.2, 1.2, 0}, {0.8, 0.6, 0.8}, 0.3, M::cardboard);
  sim::add_box(scene, {5.4, 4.6, 0}, {0.9, 1.4, 0.75}, -0.2, M::wood);
  sim::add_box(scene, {7.7, 3.0, 0}, {0.5, 2.0, 1.9}, 0, M::wood);
  sim::add_box(scene, {4.6, 2.0, 0}, {0.4, 0.4, 0.5}, 0.7, M::cardboard);
  sim::add_box(scene, {7.98, 1.1, 0.9}, {0.03, 1.2, 0.9}, 0, M::poster);
  sim::add_box(scene, {7.98, 5.0, 0.9}, {0.03, 1.0, 0.9}, 0, M::poster);
  sim::add_box(scene, {5.0, 5.98, 0.9}, {1.2, 0.03, 0.9}, 0, M::poster);
  sim::add_box(scene, {5.0, 0.02, 0.9}, {1.2, 0.03, 0.9}, 0, M::poster);
  sim::add_person(scene, {6.6, 4.9}, 2.5, 1.75, false, 0);
  return scene;
}

/// Boxes that swing across the view and a person who walks there; a texture moves with its box.
void add_movers(sim::Scene& scene, double t_s) {
  const auto box = [&](const Vec3& centre, double swing_m, double period_s, double phase) {
    const size_t first = scene.quads.size();
    sim::add_box(scene, centre, {0.5, 0.7, 1.5}, 0, sim::Material::poster);
    const Vec3 shift(0, swing_m * std::sin(2 * std::numbers::pi * t_s / period_s + phase), 0);
    for (size_t i = first; i < scene.quads.size(); ++i) {
      sim::Quad& quad = scene.quads[i];
      for (Vec3& corner : quad.corner) corner += shift;
      quad.u_offset -= quad.u_axis.dot(shift);
      quad.v_offset -= quad.v_axis.dot(shift);
    }
  };
  box({4.2, 2.4, 0}, 0.9, 6, 0);
  box({4.8, 3.9, 0}, 0.7, 5, 1);
  sim::add_person(scene, {3.9, 3.2 + 0.9 * std::sin(0.9 * t_s)}, 1.6, 1.8, false, 0);
}

/// Swinging with a given largest speed: the value at t.
double swing(double largest_speed, double period_s, double t_s, double phase) {
  const double w = 2 * std::numbers::pi / period_s;
  return largest_speed / w * std::sin(w * t_s + 2 * std::numbers::pi * phase);
}

/// Camera in the map frame (z up). It looks along x, 15 degrees downwards; the floor shakes it a little.
Rigid pose_at(const DriveCondition& c, uint64_t seed, double t_s) {
  const auto phase = [&](uint64_t i) { return sim::uniform(sim::mix(seed, 77, i)); };
  const double yaw = swing(c.turn_deg_s * kDegree, 2.5, t_s, phase(0));
  const double pitch = -15 * kDegree + swing(4 * kDegree, 0.8, t_s, phase(1));
  const double roll = swing(3 * kDegree, 1.1, t_s, phase(2));
  const Vec3 forward(std::cos(yaw) * std::cos(pitch), std::sin(yaw) * std::cos(pitch), std::sin(pitch));
  const Vec3 right(std::sin(yaw), -std::cos(yaw), 0);
  Rigid pose;
  pose.R << right, forward.cross(right), forward;
  pose.R = pose.R * Eigen::AngleAxisd(roll, Vec3::UnitZ());
  // The camera's axis of turning lies behind it and to its right, as on ACE's head.
  const Vec3 arm = Eigen::AngleAxisd(yaw, Vec3::UnitZ()) * Vec3(0.15, 0.12, 0);
  pose.t = arm + Vec3(1.6 + swing(c.speed_m_s, 3, t_s, phase(3)), 3 + swing(0.4 * c.speed_m_s, 2.2, t_s, phase(4)),
                      1.4 + swing(0.02 * c.speed_m_s, 0.7, t_s, phase(5)));
  return pose;
}

/// Makes the images of a drive, exposure after exposure.
class Photographer {
 public:
  Photographer(const DriveCondition& condition, uint64_t seed)
      : c_(condition), seed_(seed), still_(room(seed)), renderer_(kCamera) {}

  DriveFrame frame(int index) {
    const double t_s = index / kRate_Hz;
    DriveFrame out{image(t_s, false), image(t_s, true), {}, mean_pose(t_s), std::llround(t_s * 1e9)};
    const double gain = std::pow(c_.frame_gain, random(index, 0)), offset = c_.frame_offset * random(index, 1);
    if (c_.covered_every > 0 && index % c_.covered_every == c_.covered_every - 1)
      for (cv::Mat* dark : {&out.left, &out.right}) dark->convertTo(*dark, CV_8U, 0, 12);
    out.left.convertTo(out.left, CV_8U, gain, offset);
    out.right.convertTo(out.right, CV_8U, gain * c_.right_gain, offset + c_.right_offset);
    return out;
  }

 private:
  /// In -1..1.
  double random(int index, uint64_t what) const {
    return 2 * sim::uniform(sim::mix(seed_, 1000 + what, static_cast<uint64_t>(index))) - 1;
  }

  /// Parts of an exposure during which no point moves by more than about a pixel.
  int parts() const {
    return 1 + static_cast<int>(c_.exposure_s * (c_.turn_deg_s * kDegree * kCamera.focal_px + 100 * c_.speed_m_s));
  }
  double middle_of_part(int i, double t_s) const { return t_s + c_.exposure_s * ((i + 0.5) / parts() - 0.5); }

  /// Over the exposure: while the speed changes it is not the one at its middle.
  Rigid mean_pose(double t_s) const {
    const Rigid middle = pose_at(c_, seed_, t_s);
    Vec3 shift = Vec3::Zero(), turn = Vec3::Zero();
    for (int i = 0; i < parts(); ++i) {
      const Rigid moved = middle.inverse() * pose_at(c_, seed_, middle_of_part(i, t_s));
      shift += moved.t / parts();
      turn += ego_motion::rotation_vector(moved.R) / parts();
    }
    return middle * Rigid{ego_motion::rotation(turn), shift};
  }

  cv::Mat image(double t_s, bool right) {
    cv::Mat sum(kCamera.height, kCamera.width, CV_32F, cv::Scalar(0)), part(sum.size(), CV_8U);
    for (int i = 0; i < parts(); ++i) {
      const double at_s = middle_of_part(i, t_s);
      const Rigid pose = pose_at(c_, seed_, at_s);
      const sim::CameraPose camera{pose.R, pose * Vec3(right ? kBaseline_m : 0, 0, 0)};
      sim::Scene scene = still_;
      if (c_.movers) add_movers(scene, at_s);
      sim::SensorNoise noise;  // of the whole exposure; the mean of its parts has less
      noise.read_sigma *= std::sqrt(parts());
      noise.photon_variance *= parts();
      renderer_.render(scene, camera, noise, sim::mix(seed_, 55, ++exposures_),
                       {part.data, kCamera.width, kCamera.height, 1});
      cv::accumulate(part, sum);
    }
    sum.convertTo(part, CV_8U, 1.0 / parts());
    return part;
  }

  DriveCondition c_;
  uint64_t seed_, exposures_ = 0;
  sim::Scene still_;
  sim::Renderer renderer_;
};

}  // namespace

std::span<const DriveCondition> drive_conditions() {
  static constexpr auto list = std::to_array<DriveCondition>({
      {.name = "drive", .speed_m_s = 0.8},
      {.name = "turn 60 deg/s", .turn_deg_s = 60},
      {.name = "drive and turn", .speed_m_s = 0.8, .turn_deg_s = 60},
      {.name = "exposure 10 ms", .speed_m_s = 0.8, .turn_deg_s = 60, .exposure_s = 0.010},
      {.name = "exposure 30 ms", .speed_m_s = 0.8, .turn_deg_s = 60, .exposure_s = 0.030},
      {.name = "brightness of frames", .speed_m_s = 0.8, .turn_deg_s = 60, .frame_gain = 1.3, .frame_offset = 15},
      {.name = "brightness of cameras", .speed_m_s = 0.8, .turn_deg_s = 60, .right_gain = 0.8, .right_offset = 12},
      {.name = "moving objects", .speed_m_s = 0.8, .turn_deg_s = 60, .movers = true},
      {.name = "lens covered", .speed_m_s = 0.8, .turn_deg_s = 60, .covered_every = 10},
  });
  return list;
}

Drive generate_drive(const DriveCondition& condition, uint64_t seed, int frames, int disparities) {
  Drive drive;
  drive.camera = {kCamera.focal_px, kCamera.cu_px, kCamera.cv_px, kBaseline_m};
  Photographer photographer(condition, seed);
  for (int i = 0; i < frames; ++i) drive.frames.push_back(photographer.frame(i));
  add_disparity(drive, disparities);
  return drive;
}

}  // namespace takt::command
