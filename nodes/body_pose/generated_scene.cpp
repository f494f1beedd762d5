// SPDX-License-Identifier: Apache-2.0
#include "nodes/body_pose/generated_scene.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

#include "nodes/body_pose/ray_casting.hpp"
#include "nodes/mapping_3d/pose.hpp"

namespace takt::body_pose {
namespace {

using Eigen::AngleAxisd, Eigen::Matrix3d, Eigen::Vector3d;

constexpr double kDegree = std::numbers::pi / 180;

struct World {
  std::vector<Capsule> capsules;
  std::vector<Box> boxes;
};

/// Where a link of that length would end; the body's flesh is around the lines between joints.
void place_joints(const Skeleton& skeleton, const std::vector<Vector3d>& directions, Lot& lot, const Matrix3d& body,
                  std::vector<Vector3d>& joints) {
  std::vector<double> scale(skeleton.links.size(), 1);
  for (size_t i = 1; i < skeleton.links.size(); ++i) {
    const Link& link = skeleton.links[i];
    scale[i] = lot.in(0.85, 1.15);
    // Left and right are of the same length.
    const size_t cut = link.name.rfind("_right");
    if (cut != std::string::npos) scale[i] = scale[skeleton.link(link.name.substr(0, cut) + "_left")];
    joints[i] = joints[link.parent] + body * directions[i] * (link.length_m * scale[i]);
  }
}

/// A direction turned by up to so much about any axis across it.
Vector3d turned(const Vector3d& direction, double angle_rad, Lot& lot) {
  return AngleAxisd(angle_rad, direction.cross(lot.unit()).normalized()) * direction;
}

/// An arm that points: ahead is 0 degrees, outwards 90; then up or down.
void point(const Skeleton& skeleton, const std::string& side, Lot& lot, std::vector<Vector3d>& directions) {
  const double azimuth = lot.in(-20, 100) * kDegree, up = lot.in(-50, 30) * kDegree;
  const double outward = side == "left" ? -1 : 1;
  const Vector3d upper(outward * std::sin(azimuth) * std::cos(up), std::cos(azimuth) * std::cos(up), std::sin(up));
  directions[skeleton.link("upper_arm_" + side)] = upper;
  directions[skeleton.link("lower_arm_" + side)] = turned(upper, lot.in(0, 25) * kDegree, lot);
}

void rest_arm(const Skeleton& skeleton, const std::string& side, Lot& lot, std::vector<Vector3d>& directions) {
  const double outward = side == "left" ? -1 : 1;
  const Vector3d upper = Vector3d(outward * lot.in(0.05, 0.5), lot.in(-0.3, 0.4), -1).normalized();
  const double bend = lot.in(0, lot.chance(0.3) ? 120 : 30) * kDegree;
  directions[skeleton.link("upper_arm_" + side)] = upper;
  directions[skeleton.link("lower_arm_" + side)] = AngleAxisd(bend, Vector3d::UnitX()) * upper;
}

std::vector<Vector3d> standing_directions(const Skeleton& skeleton, const std::string& pointing,
                                          const std::string& other, Lot& lot) {
  std::vector<Vector3d> directions;
  for (const Link& link : skeleton.links) directions.push_back(link.rest);
  const auto turn = [&](const char* name, double degrees) {
    Vector3d& d = directions[skeleton.link(name)];
    d = turned(d, lot.in(0, degrees) * kDegree, lot);
  };
  turn("neck", 10);
  turn("upper_back", 8);
  turn("lower_back", 8);
  turn("shoulder_left", 10);
  turn("hip_left", 8);
  directions[skeleton.link("shoulder_right")] = -directions[skeleton.link("shoulder_left")];
  directions[skeleton.link("hip_right")] = -directions[skeleton.link("hip_left")];
  point(skeleton, pointing, lot, directions);
  if (lot.chance(0.25)) point(skeleton, other, lot, directions);
  else rest_arm(skeleton, other, lot, directions);
  for (const std::string side : {"left", "right"}) {
    const double outward = side == "left" ? -1 : 1, ahead = lot.in(-15, 25) * kDegree;
    const Vector3d upper = Vector3d(outward * lot.in(0, 0.2), std::sin(ahead), -std::cos(ahead)).normalized();
    directions[skeleton.link("upper_leg_" + side)] = upper;
    directions[skeleton.link("lower_leg_" + side)] = AngleAxisd(-lot.in(0, 25) * kDegree, Vector3d::UnitX()) * upper;
  }
  return directions;
}

/// Capsules around the bones of a person: head, trunk, limbs, feet.
void dress(const Skeleton& skeleton, const TrueBody& body, const Matrix3d& turn, World& world) {
  const auto joint = [&](const char* name) { return body.joints[skeleton.link(name)]; };
  constexpr Bgr kSkin{120, 150, 200}, kShirt{160, 90, 40}, kTrousers{60, 60, 70};
  const Vector3d up = Vector3d::UnitZ();
  world.capsules.push_back({body.joints[0] - 0.03 * up, body.joints[0] + 0.03 * up, 0.095, kSkin});
  world.capsules.push_back({body.joints[0], joint("neck"), 0.06, kSkin});
  const Vector3d neck = joint("neck"), waist = joint("lower_back");
  for (const double side : {0.7, 0.25, -0.25, -0.7}) {
    const Vector3d shoulder =
        neck + std::abs(side) * ((side < 0 ? joint("shoulder_left") : joint("shoulder_right")) - neck);
    const Vector3d hip = waist + 0.9 * std::abs(side) * ((side < 0 ? joint("hip_left") : joint("hip_right")) - waist);
    world.capsules.push_back({shoulder - 0.06 * up, hip, 0.085, kShirt});
  }
  world.capsules.push_back({joint("shoulder_left"), joint("shoulder_right"), 0.06, kShirt});
  for (const std::string side : {"left", "right"}) {
    const auto limb = [&](const std::string& from, const std::string& to, double radius, Bgr colour) {
      world.capsules.push_back({joint((from + "_" + side).c_str()), joint((to + "_" + side).c_str()), radius, colour});
    };
    limb("shoulder", "upper_arm", 0.05, kShirt);
    limb("upper_arm", "lower_arm", 0.04, kSkin);
    limb("hip", "upper_leg", 0.075, kTrousers);
    limb("upper_leg", "lower_leg", 0.055, kTrousers);
    const Vector3d ankle = joint(("lower_leg_" + side).c_str());
    world.capsules.push_back({ankle - 0.03 * up, ankle - 0.03 * up + turn * Vector3d(0, 0.15, 0), 0.045, kTrousers});
  }
}

/// A wall behind, furniture around, a post; nothing but low things stands between person and camera.
void furnish(const Vector3d& person, Lot& lot, World& world) {
  const double wall = person.y() + lot.in(0.9, 2.5);
  world.boxes.push_back({{-8, wall, 0}, {8, wall + 0.2, 4}, {190, 195, 200}});
  for (int i = 0; i < 4; ++i) {
    const double x = person.x() + (lot.chance(0.5) ? 1 : -1) * lot.in(0.7, 2.2), y = person.y() + lot.in(-0.8, 0.8);
    const double half = lot.in(0.15, 0.35), height = lot.in(0.4, 1.9);
    if (std::abs(x - person.x()) < half + 0.55) continue;
    world.boxes.push_back({{x - half, y - half, 0}, {x + half, y + half, height}, {90, 120, 150}});
  }
  if (lot.chance(0.4)) {
    const double x = person.x() + lot.in(-0.5, 0.5), y = person.y() - lot.in(0.6, 0.9);
    world.boxes.push_back({{x - 0.25, y - 0.15, 0}, {x + 0.25, y + 0.15, lot.in(0.3, 0.6)}, {60, 140, 90}});
  }
  const Vector3d foot(person.x() + (lot.chance(0.5) ? 1 : -1) * lot.in(0.9, 1.5), person.y() + lot.in(-0.5, 0.5), 0);
  world.capsules.push_back({foot, foot + Vector3d(0, 0, lot.in(1.0, 2.0)), 0.04, {40, 40, 40}});
}

/// Ray after ray, then what a stereo camera makes of it.
void look(const World& world, const SceneCamera& c, Lot& lot, GeneratedScene& scene) {
  scene.camera = {c.focal_px, (c.width - 1) / 2.0, (c.height - 1) / 2.0, c.baseline_m};
  scene.camera_in_floor = mapping_3d::camera_mount(0, 0, c.height_m, 0, c.tilt_rad);
  const mapping_3d::Affine a = mapping_3d::to_affine(scene.camera_in_floor);
  const Matrix3d rotation = Eigen::Map<const Eigen::Matrix<double, 3, 3, Eigen::RowMajor>>(a.r);
  const Vector3d eye(a.t[0], a.t[1], a.t[2]);
  scene.width = c.width / c.step_px;
  scene.height = c.height / c.step_px;
  std::vector<double> depth(static_cast<size_t>(scene.width) * static_cast<size_t>(scene.height), kNever);
  scene.image.assign(3 * depth.size(), 0);
  const auto ray_of = [&](int column, int row) {
    return Vector3d((column * c.step_px - scene.camera.cu_px) / c.focal_px,
                    (row * c.step_px - scene.camera.cv_px) / c.focal_px, 1);
  };
  for (int row = 0; row < scene.height; ++row)
    for (int column = 0; column < scene.width; ++column) {
      const Vector3d in_camera = ray_of(column, row), ray = (rotation * in_camera).normalized();
      double nearest = ray.z() < 0 ? -eye.z() / ray.z() : kNever;
      Bgr colour{130, 135, 140};
      const auto take = [&](double distance, Bgr of) {
        if (distance < nearest) nearest = distance, colour = of;
      };
      for (const Capsule& capsule : world.capsules) take(meet(eye, ray, capsule), capsule.colour);
      for (const Box& box : world.boxes) take(meet(eye, ray, box), box.colour);
      const auto at = static_cast<size_t>(row * scene.width + column);
      depth[at] = nearest / in_camera.norm();
      const double light = std::isfinite(nearest) ? 0.6 + 0.4 * lot.in(0, 1) : 0;
      scene.image[3 * at] = static_cast<uint8_t>(colour.b * light);
      scene.image[3 * at + 1] = static_cast<uint8_t>(colour.g * light);
      scene.image[3 * at + 2] = static_cast<uint8_t>(colour.r * light);
    }
  for (int row = 0; row < scene.height; ++row)
    for (int column = 0; column < scene.width; ++column) {
      const auto at = static_cast<size_t>(row * scene.width + column);
      double z = depth[at];
      const double beside = column > 0 ? depth[at - 1] : z;
      if (std::isfinite(z) && std::isfinite(beside) && std::abs(z - beside) > 0.2 && lot.chance(c.smeared))
        z += lot.in(0, 1) * (beside - z);
      const double exact = c.focal_px * c.baseline_m / z + c.noise_px * lot.normal();
      const double disparity = std::round(exact / c.disparity_step_px) * c.disparity_step_px;
      if (lot.chance(c.missing) || !std::isfinite(z) || !(disparity > 0.5)) continue;
      const Vector3d p = ray_of(column, row) * (c.focal_px * c.baseline_m / disparity), q = rotation * p + eye;
      scene.points.push_back({static_cast<float>(p.x()), static_cast<float>(p.y()), static_cast<float>(p.z())});
      scene.in_floor.push_back({static_cast<float>(q.x()), static_cast<float>(q.y()), static_cast<float>(q.z())});
    }
}

}  // namespace

Eigen::Vector3d TrueBody::pointing() const { return (joints[to] - joints[from]).normalized(); }

GeneratedScene make_person(const Skeleton& skeleton, const SceneCamera& camera, uint64_t seed, uint64_t index,
                           bool clutter) {
  Lot lot(seed, index);
  GeneratedScene scene;
  TrueBody& body = scene.body;
  body.pointer = lot.chance(0.5) ? 0 : 1;
  body.from = skeleton.pointers.at(body.pointer).from;
  body.to = skeleton.pointers.at(body.pointer).to;
  const std::string sides[2] = {"left", "right"};
  const auto directions = standing_directions(skeleton, sides[body.pointer], sides[1 - body.pointer], lot);
  const Matrix3d turn = AngleAxisd(std::numbers::pi + lot.in(-75, 75) * kDegree, Vector3d::UnitZ()).toRotationMatrix();
  body.joints.assign(skeleton.links.size(), Vector3d::Zero());
  place_joints(skeleton, directions, lot, turn, body.joints);
  // Feet on the floor, 8 cm below the lower ankle.
  const double ankle =
      std::min(body.joints[skeleton.link("lower_leg_left")].z(), body.joints[skeleton.link("lower_leg_right")].z());
  const double y = lot.in(2.2, 3.6);
  const Vector3d place(lot.in(-0.35, 0.35) * y, y, 0.08 - ankle);
  for (Vector3d& joint : body.joints) joint += place;
  World world;
  dress(skeleton, body, turn, world);
  if (clutter) furnish({place.x(), place.y(), 0}, lot, world);
  look(world, camera, lot, scene);
  return scene;
}

GeneratedScene make_any(const Skeleton& skeleton, const SceneCamera& camera, uint64_t seed, uint64_t index) {
  Lot lot(seed, index);
  GeneratedScene scene;
  TrueBody& body = scene.body;
  if (!skeleton.pointers.empty()) body.from = skeleton.pointers[0].from, body.to = skeleton.pointers[0].to;
  auto directions =
      skeleton.poses[static_cast<size_t>(lot.in(0, static_cast<double>(skeleton.poses.size())))].directions;
  for (size_t i = 1; i < skeleton.links.size(); ++i) {
    const Link& link = skeleton.links[i];
    for (const Dof& dof : link.dofs) {
      const double most = 15 * kDegree;
      const double angle = lot.in(std::max(-most, dof.min_rad), std::min(most, dof.max_rad));
      directions[i] = AngleAxisd(angle, Vector3d::Unit(dof.axis)) * directions[i];
    }
    if (link.mirrors != 0) directions[i] = -directions[link.mirrors];
  }
  const Matrix3d turn = AngleAxisd(lot.in(0, 2 * std::numbers::pi), Vector3d::UnitZ()).toRotationMatrix();
  body.joints.assign(skeleton.links.size(), Vector3d::Zero());
  place_joints(skeleton, directions, lot, turn, body.joints);
  double lowest = 0;
  for (const Vector3d& joint : body.joints) lowest = std::min(lowest, joint.z());
  const double x = lot.in(-0.5, 0.5), y = lot.in(2.2, 3.0);
  for (Vector3d& joint : body.joints) joint += Vector3d(x, y, 0.15 - lowest);
  World world;
  for (size_t i = 1; i < skeleton.links.size(); ++i)
    world.capsules.push_back({body.joints[skeleton.links[i].parent], body.joints[i], 0.04, {30, 160, 220}});
  look(world, camera, lot, scene);
  return scene;
}

}  // namespace takt::body_pose
