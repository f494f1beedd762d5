// SPDX-License-Identifier: Apache-2.0
#include "nodes/mapping_3d/pose.hpp"

#include <cmath>

namespace takt::mapping_3d {
namespace {

struct Quaternion {
  double w, x, y, z;
};

Quaternion rotation_of(const Transform& t) {
  const double n = std::sqrt(t.qw * t.qw + t.qx * t.qx + t.qy * t.qy + t.qz * t.qz);
  return n > 0 ? Quaternion{t.qw / n, t.qx / n, t.qy / n, t.qz / n} : Quaternion{1, 0, 0, 0};
}

Quaternion product(const Quaternion& a, const Quaternion& b) {
  return {a.w * b.w - a.x * b.x - a.y * b.y - a.z * b.z, a.w * b.x + a.x * b.w + a.y * b.z - a.z * b.y,
          a.w * b.y - a.x * b.z + a.y * b.w + a.z * b.x, a.w * b.z + a.x * b.y - a.y * b.x + a.z * b.w};
}

Transform make(double x, double y, double z, const Quaternion& q) { return {x, y, z, q.w, q.x, q.y, q.z}; }

}  // namespace

Affine to_affine(const Transform& t) {
  const auto [w, x, y, z] = rotation_of(t);
  return {
      {1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y), 2 * (x * y + w * z), 1 - 2 * (x * x + z * z),
       2 * (y * z - w * x), 2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)},
      {t.x, t.y, t.z}};
}

Transform compose(const Transform& a, const Transform& b) {
  const Affine m = to_affine(a);
  return make(m.r[0] * b.x + m.r[1] * b.y + m.r[2] * b.z + a.x, m.r[3] * b.x + m.r[4] * b.y + m.r[5] * b.z + a.y,
              m.r[6] * b.x + m.r[7] * b.y + m.r[8] * b.z + a.z, product(rotation_of(a), rotation_of(b)));
}

Transform inverse(const Transform& t) {
  const auto [w, x, y, z] = rotation_of(t);
  const Transform turn = make(0, 0, 0, {w, -x, -y, -z});
  return compose(turn, make(-t.x, -t.y, -t.z, {1, 0, 0, 0}));
}

Transform interpolate(const Transform& a, const Transform& b, double share) {
  const Quaternion p = rotation_of(a);
  Quaternion q = rotation_of(b);
  double cosine = p.w * q.w + p.x * q.x + p.y * q.y + p.z * q.z;
  if (cosine < 0) q = {-q.w, -q.x, -q.y, -q.z}, cosine = -cosine;
  double from = 1 - share, to = share;
  if (cosine < 0.99999) {
    const double angle = std::acos(cosine), sine = std::sin(angle);
    from = std::sin((1 - share) * angle) / sine;
    to = std::sin(share * angle) / sine;
  }
  Transform out = make(a.x + share * (b.x - a.x), a.y + share * (b.y - a.y), a.z + share * (b.z - a.z),
                       {from * p.w + to * q.w, from * p.x + to * q.x, from * p.y + to * q.y, from * p.z + to * q.z});
  const Quaternion unit = rotation_of(out);
  return make(out.x, out.y, out.z, unit);
}

Transform camera_mount(double x_m, double y_m, double height_m, double pan_rad, double tilt_rad) {
  const Quaternion pan{std::cos(pan_rad / 2), 0, 0, std::sin(pan_rad / 2)};
  const Quaternion tilt{std::cos(tilt_rad / 2), std::sin(tilt_rad / 2), 0, 0};
  const double h = std::sqrt(0.5);
  const Quaternion axes{h, -h, 0, 0};  // camera y (down) to robot -z, camera z (forward) to robot y: -90 deg about x
  return make(x_m, y_m, height_m, product(product(pan, tilt), axes));
}

Transform pose_at(std::span<const StampedPose> poses, int64_t stamp_ns) {
  if (poses.empty()) return {};
  if (stamp_ns <= poses.front().stamp_ns) return poses.front().pose;
  for (size_t i = 1; i < poses.size(); ++i) {
    const StampedPose &a = poses[i - 1], &b = poses[i];
    if (stamp_ns > b.stamp_ns) continue;
    return interpolate(a.pose, b.pose,
                       static_cast<double>(stamp_ns - a.stamp_ns) / static_cast<double>(b.stamp_ns - a.stamp_ns));
  }
  return poses.back().pose;
}

}  // namespace takt::mapping_3d
