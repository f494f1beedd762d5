// SPDX-License-Identifier: Apache-2.0
#include "hal/sim/scene.hpp"

#include <cmath>

namespace takt::sim {

Quad make_quad(const std::array<Vec3, 4>& corners, Material material, double offset) {
  Quad quad;
  quad.corner = corners;
  quad.normal = (corners[1] - corners[0]).cross(corners[3] - corners[0]).normalized();
  quad.u_axis = (corners[1] - corners[0]).normalized();
  quad.v_axis = quad.normal.cross(quad.u_axis);
  quad.u_offset = offset;
  quad.v_offset = offset * 0.618;
  quad.material = material;
  // One distant lamp plus ambient light: faces of a box differ, which gives its edges contrast.
  static const Vec3 towards_light = Vec3(0.35, -0.5, 0.79).normalized();
  quad.gain = 0.72 + 0.28 * std::abs(quad.normal.dot(towards_light));
  return quad;
}

void add_box(Scene& scene, const Vec3& ground, const Vec3& size, double yaw, Material material, double offset) {
  const double c = std::cos(yaw), s = std::sin(yaw);
  const auto corner = [&](double x, double y, double z) {
    const double px = x * size.x() / 2, py = y * size.y() / 2;
    return Vec3(ground.x() + c * px - s * py, ground.y() + s * px + c * py, ground.z() + z * size.z());
  };
  const std::array<std::array<double, 2>, 4> ring{{{-1, -1}, {1, -1}, {1, 1}, {-1, 1}}};
  for (size_t i = 0; i < 4; ++i) {
    const auto& p = ring[i];
    const auto& q = ring[(i + 1) % 4];
    scene.quads.push_back(
        make_quad({corner(p[0], p[1], 0), corner(q[0], q[1], 0), corner(q[0], q[1], 1), corner(p[0], p[1], 1)},
                  material, offset + 0.71 * static_cast<double>(i)));
  }
  scene.quads.push_back(
      make_quad({corner(-1, -1, 1), corner(1, -1, 1), corner(1, 1, 1), corner(-1, 1, 1)}, material, offset + 3));
}

void add_board(Scene& scene, const Vec3& foot, double edge, double yaw, std::shared_ptr<const Texture> picture) {
  const Vec3 half(-std::sin(yaw) * edge / 2, std::cos(yaw) * edge / 2, 0), up(0, 0, edge);  // to the viewer's right
  Quad quad = make_quad({foot - half, foot + half, foot + half + up, foot - half + up}, Material::plaster);
  quad.u_offset = -quad.u_axis.dot(quad.corner[0]);
  quad.v_offset = -quad.v_axis.dot(quad.corner[0]);
  quad.picture = std::move(picture);
  scene.quads.push_back(std::move(quad));
}

void add_person(Scene& scene, const Vec2& position, double yaw, double height, bool points, double pointing) {
  const double k = height / 1.75;
  const double c = std::cos(yaw), s = std::sin(yaw);
  // Person frame: x to the left hand, y backwards, z up; faces yaw.
  const auto at = [&](double left, double forward, double up) {
    return Vec3(position.x() + k * (c * forward - s * left), position.y() + k * (s * forward + c * left), k * up);
  };
  const auto limb = [&](const Vec3& a, const Vec3& b, double radius, Material material) {
    scene.capsules.push_back({a, b, k * radius, material});
  };
  limb(at(0, 0, 1.00), at(0, 0, 1.30), 0.150, Material::cloth);
  limb(at(0, 0, 1.45), at(0, 0, 1.52), 0.055, Material::skin);
  limb(at(0, 0, 1.60), at(0, 0, 1.66), 0.095, Material::skin);
  for (const double side : {1.0, -1.0}) {
    limb(at(side * 0.09, 0, 0.92), at(side * 0.10, 0.01, 0.50), 0.080, Material::cloth);
    limb(at(side * 0.10, 0.01, 0.50), at(side * 0.10, 0, 0.08), 0.055, Material::cloth);
    limb(at(side * 0.10, 0, 0.05), at(side * 0.11, 0.16, 0.05), 0.045, Material::wood);
    const Vec3 shoulder = at(side * 0.20, 0, 1.38);
    if (side < 0 && points) {
      const Vec3 direction(std::cos(pointing), std::sin(pointing), -0.05);
      limb(shoulder, shoulder + k * 0.30 * direction, 0.050, Material::cloth);
      limb(shoulder + k * 0.30 * direction, shoulder + k * 0.60 * direction, 0.042, Material::skin);
    } else {
      limb(shoulder, at(side * 0.25, 0, 1.10), 0.050, Material::cloth);
      limb(at(side * 0.25, 0, 1.10), at(side * 0.26, 0.05, 0.84), 0.042, Material::skin);
    }
  }
}

}  // namespace takt::sim
