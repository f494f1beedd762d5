// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <Eigen/Core>
#include <Eigen/Geometry>
#include <array>
#include <vector>

#include "hal/sim/texture.hpp"

namespace takt::sim {

using Vec2 = Eigen::Vector2d;
using Vec3 = Eigen::Vector3d;
using Mat3 = Eigen::Matrix3d;

/// Flat textured quadrilateral in the map frame, seen from the side its normal points to.
/// Texture coordinates in metres: u = u_axis . P + u_offset, v likewise.
struct Quad {
  std::array<Vec3, 4> corner;  ///< counter-clockwise as seen from the front
  Vec3 normal;
  Vec3 u_axis, v_axis;
  double u_offset = 0, v_offset = 0;
  Material material = Material::plaster;
  double gain = 1;                                   ///< illumination of the face
  std::shared_ptr<const Texture> picture = nullptr;  ///< instead of the material's texture, where there is one
};

/// Cylinder with half-sphere ends, in the map frame.
struct Capsule {
  Vec3 a, b;
  double radius = 0;
  Material material = Material::cloth;
};

/// What the renderer draws.
struct Scene {
  std::vector<Quad> quads;
  std::vector<Capsule> capsules;
  std::shared_ptr<const TextureSet> textures;
  const Scene* fixed = nullptr;  ///< drawn as well, if there is one: what never changes
};

/// Quad with its normal and texture axes (metres along the horizontal edge and along the other edge).
Quad make_quad(const std::array<Vec3, 4>& corners, Material material, double offset = 0);
/// Where the next box of a scene starts in its texture, m: each elsewhere, so that equal boxes do not look equal.
inline double texture_offset(const Scene& scene) { return 0.37 * static_cast<double>(scene.quads.size()); }
/// The five visible faces of a box standing on height z; `offset` as texture_offset() says.
void add_box(Scene& scene, const Vec3& centre_on_ground, const Vec3& size, double yaw_rad, Material material,
             double offset);
inline void add_box(Scene& scene, const Vec3& centre_on_ground, const Vec3& size, double yaw_rad, Material material) {
  add_box(scene, centre_on_ground, size, yaw_rad, material, texture_offset(scene));
}
/// A square with a picture that faces yaw, upright, its lower edge at `foot` in the middle.
void add_board(Scene& scene, const Vec3& foot, double edge_m, double yaw_rad, std::shared_ptr<const Texture> picture);
/// A standing person of `height` metres made of capsules; the right arm points to `pointing_rad` (map azimuth) if
/// asked.
void add_person(Scene& scene, const Vec2& position, double yaw_rad, double height, bool points, double pointing_rad);

}  // namespace takt::sim
