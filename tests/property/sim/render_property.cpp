// SPDX-License-Identifier: Apache-2.0
// The scan-converting renderer against the obvious one: a ray per pixel, tested against everything.
#include <doctest/doctest.h>
#include <hwy/targets.h>

#include <cmath>
#include <limits>

#include "hal/sim/random.hpp"
#include "tests/on_each_target.hpp"
#include "tests/property_scale.hpp"
#include "tests/unit/sim/acting_world.hpp"
#include "tests/unit/sim/small_world.hpp"

using namespace takt;
using namespace takt::sim;

namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();

double quad_depth(const Quad& quad, const Vec3& origin, const Vec3& ray) {
  const double towards = quad.normal.dot(ray);
  if (towards >= 0) return kInfinity;
  const double t = quad.normal.dot(quad.corner[0] - origin) / towards;
  if (t <= 0.05) return kInfinity;
  const Vec3 p = origin + t * ray;
  for (size_t i = 0; i < 4; ++i) {
    if (quad.normal.dot((quad.corner[(i + 1) % 4] - quad.corner[i]).cross(p - quad.corner[i])) < 0) return kInfinity;
  }
  return t;
}

/// Smallest t at which the distance to the capsule's axis falls to its radius, by sphere tracing.
double capsule_depth(const Capsule& c, const Vec3& origin, const Vec3& ray) {
  const double length = ray.norm();
  double t = 0;
  for (int i = 0; i < 600; ++i) {
    const Vec3 p = origin + t * ray, axis = c.b - c.a;
    const double h = std::clamp((p - c.a).dot(axis) / axis.squaredNorm(), 0.0, 1.0);
    const double distance = (p - c.a - h * axis).norm() - c.radius;
    if (distance < 1e-6) return t;
    t += distance / length;
    if (t > 30) break;
  }
  return kInfinity;
}

double reference_depth(const Scene& scene, const Vec3& origin, const Vec3& ray) {
  double nearest = kInfinity;
  for (const Quad& quad : scene.quads) nearest = std::min(nearest, quad_depth(quad, origin, ray));
  for (const Capsule& capsule : scene.capsules) nearest = std::min(nearest, capsule_depth(capsule, origin, ray));
  return nearest;
}

double random_in(uint64_t k, uint64_t what, double low, double high) {
  return low + (high - low) * uniform(mix(test::seed(77), k, what));
}

}  // namespace

TEST_CASE("depth agrees with a ray caster from random poses") {
  const auto s = test::small_simulation();
  const Pinhole camera{64, 48, 50.0, 31.5, 23.5};
  Renderer renderer(camera);
  std::vector<uint8_t> image(64 * 48);
  std::vector<float> depth(64 * 48);
  int compared = 0, wrong = 0;
  for (uint64_t k = 0; k < test::rounds(40u); ++k) {
    StereoRig rig = test::small_rig();
    rig.tilt_rad = random_in(k, 1, -0.9, 0.5);
    rig.roll_rad = random_in(k, 2, -0.5, 0.5);
    rig.z_m = random_in(k, 3, 0.3, 2.4);
    RobotState robot{random_in(k, 4, 0.4, 5.6), random_in(k, 5, 0.4, 4.6), random_in(k, 6, -3.2, 3.2), 0, 0};
    if (collides(s->world(), Vec2(robot.x_m, robot.y_m), 0.35)) continue;
    const CameraPose pose = Simulation::camera_pose(rig, 0, robot, 0, 0);
    renderer.render(s->scene(), pose, {}, k, {image.data(), 64, 48, 1}, depth.data());
    for (int y = 0; y < 48; ++y) {
      for (int x = 0; x < 64; ++x) {
        const Vec3 ray =
            pose.rotation * Vec3((x - camera.cu_px) / camera.focal_px, (y - camera.cv_px) / camera.focal_px, 1);
        const double expected = reference_depth(s->scene(), pose.position, ray),
                     got = static_cast<double>(depth[static_cast<size_t>(y * 64 + x)]);
        ++compared;
        if (std::abs(got - expected) > 1e-3 * expected + 1e-3) ++wrong;
      }
    }
  }
  CHECK(compared >= test::at_scale(50'000));
  // A pixel may differ where a ray grazes an edge: rounding decides.
  CHECK(wrong <= test::at_most(compared, 1.0 / 2000));
}

TEST_CASE("what moves is drawn where it stands, in each state, with the same bytes by every SIMD target") {
  Simulation s(test::acting_stage(R"(<client name="eye" x="5.2m" y="3.2m" theta="180deg"/>
      <event at="1s" object="cup" attr="level" value="full"/><event at="2s" object="cup" x="2.6m" y="3.3m" yaw="40deg"/>
      <event at="3s" object="door" x="2m" y="4.5m" yaw="60deg"/><event at="3s" object="door" attr="closed" value="true"/>)"),
               2);
  s.begin(0);
  const StereoRig rig = test::small_rig();
  const CameraPose pose = s.camera_pose(rig, 0, 0);
  Renderer renderer({rig.width, rig.height, rig.focal_px, rig.cu_px, rig.cv_px});
  std::vector<uint8_t> image(static_cast<size_t>(rig.width * rig.height * 3));
  std::vector<float> depth(static_cast<size_t>(rig.width * rig.height));
  std::vector<std::vector<uint8_t>> states;
  Snapshot snapshot = s.make_snapshot();
  int compared = 0, wrong = 0;
  for (int64_t k = 0; k < 4; ++k) {
    s.look(k * test::kSecond, snapshot);
    std::vector<std::vector<uint8_t>> by_target;
    test::on_each_target([&] {
      renderer.render(snapshot.scene, pose, {}, 4, {image.data(), rig.width, rig.height, 3}, depth.data());
      by_target.push_back(image);
      CHECK(image == by_target.front());
    });
    states.push_back(image);
    for (int64_t before = 0; before < k; ++before) CHECK(states[static_cast<size_t>(before)] != image);
    Scene all = *snapshot.scene.fixed;
    all.quads.insert(all.quads.end(), snapshot.scene.quads.begin(), snapshot.scene.quads.end());
    for (int y = 0; y < rig.height; y += 2) {
      for (int x = 0; x < rig.width; x += 2) {
        const Vec3 ray = pose.rotation * Vec3((x - rig.cu_px) / rig.focal_px, (y - rig.cv_px) / rig.focal_px, 1);
        const double expected = reference_depth(all, pose.position, ray),
                     got = static_cast<double>(depth[static_cast<size_t>(y * rig.width + x)]);
        ++compared;
        if (std::abs(got - expected) > 1e-3 * expected) ++wrong;
      }
    }
  }
  MESSAGE(wrong, " of ", compared, " pixels differ");
  CHECK(wrong <= test::at_most(compared, 1.0 / 2000));
}

TEST_CASE("laser ranges, level and tilted, agree with small steps through the bitmap, boxes and people") {
  const auto s = test::small_simulation();
  const World& world = s->world();
  const WorldObject& box = world.objects[0];
  int compared = 0, on_floor = 0;
  for (uint64_t k = 0; k < test::rounds(800u); ++k) {
    const Vec3 origin(random_in(k, 11, 0.2, 5.8), random_in(k, 12, 0.2, 4.8), random_in(k, 14, 0.1, 1.9));
    if (collides(world, origin.head<2>(), 0.05)) continue;
    const double angle = random_in(k, 13, -3.2, 3.2), tilt = k % 2 == 0 ? 0 : random_in(k, 15, -1.2, 0.6), step = 1e-3;
    const Vec3 direction(std::cos(tilt) * std::cos(angle), std::cos(tilt) * std::sin(angle), std::sin(tilt));
    double expected = 8.0;
    for (double t = 0; t < 8.0; t += step) {
      const Vec3 p = origin + t * direction;
      bool hit = world.map.at(static_cast<int>(std::floor(p.x() / 0.1)), static_cast<int>(std::floor(p.y() / 0.1)));
      hit |= p.z() <= 0 || p.z() >= world.wall_height_m;
      const double c = std::cos(box.yaw_rad), n = std::sin(box.yaw_rad);
      const Vec2 r = p.head<2>() - box.position;
      hit |= std::abs(c * r.x() + n * r.y()) <= 0.3 && std::abs(-n * r.x() + c * r.y()) <= 0.25 && p.z() <= 0.9;
      for (const Capsule& capsule : s->scene().capsules) {
        const Vec3 axis = capsule.b - capsule.a;
        const double h = std::clamp((p - capsule.a).dot(axis) / axis.squaredNorm(), 0.0, 1.0);
        hit |= (p - capsule.a - h * axis).norm() <= capsule.radius;
      }
      if (hit) {
        expected = t;
        on_floor += p.z() <= 0;
        break;
      }
    }
    const double got = cast_ray(world, s->scene(), origin, direction, 8.0);
    // A grazing hit shorter than a step may escape the reference, never the other way round by more than a step.
    CHECK(got <= expected + 1e-9);
    if (got > expected - 2 * step) ++compared;
  }
  CHECK(compared >= test::at_scale(500));
  CHECK(on_floor >= test::at_scale(100));
}

TEST_CASE("equal seeds give equal bytes, also for a renderer that has drawn other things before") {
  const auto a = test::small_simulation(9), b = test::small_simulation(9);
  const StereoRig rig = test::small_rig();
  Renderer fresh({rig.width, rig.height, rig.focal_px, rig.cu_px, rig.cv_px}), used = fresh;
  std::vector<uint8_t> one(static_cast<size_t>(rig.width * rig.height * 3)), two(one.size());
  for (uint64_t k = 0; k < 10; ++k) {
    const RobotState robot{1.5, 2.5, random_in(k, 21, -3, 3), 0, 0};
    used.render(a->scene(), Simulation::camera_pose(rig, 0, robot, 0, 0), {}, k,
                {one.data(), rig.width, rig.height, 3});
  }
  const CameraPose pose = Simulation::camera_pose(rig, 0, {1.5, 2.5, 0.2, 0, 0}, 0, 0);
  used.render(a->scene(), pose, {}, 4, {one.data(), rig.width, rig.height, 3});
  fresh.render(b->scene(), pose, {}, 4, {two.data(), rig.width, rig.height, 3});
  CHECK(one == two);
}

TEST_CASE("every SIMD target of this machine gives the same bytes") {
  const auto s = test::small_simulation();
  const StereoRig rig = test::small_rig();
  Renderer renderer({rig.width, rig.height, rig.focal_px, rig.cu_px, rig.cv_px});
  std::vector<uint8_t> bytes(static_cast<size_t>(rig.width * rig.height * 3)), first;
  std::vector<float> depth(static_cast<size_t>(rig.width * rig.height)), first_depth;
  int targets = 0;
  for (const int64_t target : hwy::SupportedAndGeneratedTargets()) {
    hwy::SetSupportedTargetsForTest(target);
    hwy::GetChosenTarget().Update(hwy::SupportedTargets());
    renderer.render(s->scene(), Simulation::camera_pose(rig, 0, {1.5, 2.5, 0.1, 0, 0}, 0, 0), {}, 4,
                    {bytes.data(), rig.width, rig.height, 3}, depth.data());
    if (targets++ == 0) {
      first = bytes;
      first_depth = depth;
    }
    CHECK(bytes == first);
    CHECK(depth == first_depth);
  }
  hwy::SetSupportedTargetsForTest(0);
  hwy::GetChosenTarget().Update(hwy::SupportedTargets());
  CHECK(targets >= 1);
}
