// SPDX-License-Identifier: Apache-2.0
#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>

#include "hal/sim/lens.hpp"
#include "tests/temporary_folder.hpp"
#include "tests/unit/sim/small_world.hpp"

using namespace takt;
using namespace takt::sim;

namespace {

struct View {
  std::vector<uint8_t> bytes;
  std::vector<float> depth;
  ImageView<uint8_t> image;
};

View render(const Simulation& s, const StereoRig& rig, int which) {
  View v;
  v.bytes.resize(static_cast<size_t>(rig.width * rig.height * 3));
  v.depth.resize(static_cast<size_t>(rig.width * rig.height));
  v.image = {v.bytes.data(), rig.width, rig.height, 3};
  Renderer renderer({rig.width, rig.height, rig.focal_px, rig.cu_px, rig.cv_px});
  renderer.render(s.scene(), s.camera_pose(rig, which, 0), {0, 0}, 1, v.image, v.depth.data());
  return v;
}

}  // namespace

TEST_CASE("camera axes: forward is the driving direction, right is right, down is down") {
  StereoRig rig = test::small_rig();
  rig.tilt_rad = 0;
  const RobotState robot{1, 2, 0.5, 0, 0};
  const CameraPose pose = Simulation::camera_pose(rig, 0, robot, 0, 0);
  const Vec3 forward(std::cos(0.5), std::sin(0.5), 0), right(std::sin(0.5), -std::cos(0.5), 0);
  CHECK((pose.rotation.col(2) - forward).norm() < 1e-12);
  CHECK((pose.rotation.col(0) - right).norm() < 1e-12);
  CHECK((pose.rotation.col(1) + Vec3::UnitZ()).norm() < 1e-12);
  CHECK((pose.position - (Vec3(1, 2, 1.3) + 0.1 * forward)).norm() < 1e-12);
  const CameraPose other = Simulation::camera_pose(rig, 1, robot, 0, 0);
  CHECK((other.position - pose.position - 0.24 * right).norm() < 1e-12);
  // Pan left turns the view to the left, tilt up raises it.
  CHECK(Simulation::camera_pose(rig, 0, robot, 0.3, 0).rotation.col(2).dot(right) == doctest::Approx(-std::sin(0.3)));
  CHECK(Simulation::camera_pose(rig, 0, robot, 0, 0.3).rotation.col(2).z() == doctest::Approx(std::sin(0.3)));
}

TEST_CASE("a point seen at its true depth in the left image lies at x - f B / z in the right image, same row") {
  const auto s = test::small_simulation();
  s->begin(0);
  const StereoRig rig = test::small_rig();
  const View left = render(*s, rig, 0), right = render(*s, rig, 1);
  const CameraPose lp = s->camera_pose(rig, 0, 0), rp = s->camera_pose(rig, 1, 0);
  int inside = 0, visible = 0;
  std::vector<double> difference;
  for (int y = 0; y < rig.height; ++y) {
    for (int x = 0; x < rig.width; ++x) {
      const double z = static_cast<double>(left.depth[static_cast<size_t>(y * rig.width + x)]);
      REQUIRE(z > 0);
      const Vec3 ray((x - rig.cu_px) / rig.focal_px, (y - rig.cv_px) / rig.focal_px, 1);
      const Vec3 point = lp.rotation * (z * ray) + lp.position;
      const Vec3 in_right = rp.rotation.transpose() * (point - rp.position);
      const double u = rig.cu_px + rig.focal_px * in_right.x() / in_right.z(),
                   v = rig.cv_px + rig.focal_px * in_right.y() / in_right.z();
      CHECK(v == doctest::Approx(y).epsilon(1e-9));
      CHECK(x - u == doctest::Approx(rig.focal_px * rig.baseline_m / z).epsilon(1e-6));
      const int u0 = static_cast<int>(std::floor(u));
      if (u0 < 0 || u0 + 1 >= rig.width) continue;
      ++inside;
      const size_t at = static_cast<size_t>(y * rig.width + u0);
      const double z0 = static_cast<double>(right.depth[at]), z1 = static_cast<double>(right.depth[at + 1]);
      if (std::min(z0, z1) < 0.97 * z || std::max(z0, z1) > 1.03 * z) continue;  // occluded, or at an edge
      ++visible;
      const double w = u - u0, seen = (1 - w) * right.image.at(u0, y, 1) + w * right.image.at(u0 + 1, y, 1);
      difference.push_back(std::abs(seen - left.image.at(x, y, 1)));
    }
  }
  CHECK(visible > 0.8 * inside);
  std::sort(difference.begin(), difference.end());
  // The texture is the same; what differs is the resampling.
  CHECK(difference[difference.size() / 2] < 2.5);
  CHECK(difference[difference.size() * 95 / 100] < 25.0);
}

TEST_CASE("a board shows its picture upright and not mirrored to whom it faces, and nothing from behind") {
  const test::TemporaryFolder folder;
  std::string picture = "P6 16 16 255\n";  // top left red, top right green, lower half blue
  for (int y = 0; y < 16; ++y)
    for (int x = 0; x < 16; ++x)
      picture += y >= 8  ? std::string("\x10\x10\xc8")
                 : x < 8 ? std::string("\xc8\x10\x10")
                         : std::string("\x10\xc8\x10");
  auto texture = load_picture(folder.write("board.ppm", picture), 1.0);
  REQUIRE(texture.has_value());
  World world = test::small_world();
  WorldObject board;
  board.name = "board", board.type = "sign", board.position = {3.5, 2.5},
  board.yaw_rad = 3.14159265;  // faces the robot
  board.board = Board{1.0, 0.8, std::make_shared<const Texture>(std::move(*texture))};
  StereoRig rig = test::small_rig();
  rig.tilt_rad = 0;
  for (const bool faces : {true, false}) {
    if (!faces) board.yaw_rad = 0;
    world.objects = {board};
    Simulation s(world, 0, 3);
    s.begin(0);
    const View seen = render(s, rig, 0);
    const auto at = [&](int x, int y) { return seen.image.row(y) + ptrdiff_t{3} * x; };
    const auto is = [&](const uint8_t* pixel, int channel) {
      return pixel[channel] > 100 && pixel[(channel + 1) % 3] < 50 && pixel[(channel + 2) % 3] < 50;
    };
    // 1.9 m straight ahead and 1 m wide: 65 px around the middle of the image.
    CHECK(is(at(63, 43), 2) == faces);
    CHECK(is(at(96, 43), 1) == faces);
    CHECK(is(at(63, 76), 0) == faces);
    CHECK(is(at(96, 76), 0) == faces);
  }
}

TEST_CASE("pictures that are none are refused") {
  const test::TemporaryFolder folder;
  const auto error = [&](const std::string& bytes) {
    const auto texture = load_picture(folder.write("board.ppm", bytes), 1.0);
    return texture ? std::string() : texture.error();
  };
  CHECK(error("P3 16 16 255\n").find("is no PPM") != std::string::npos);
  CHECK(error("P6 16 32 255\n").find("is no PPM") != std::string::npos);
  CHECK(error("P6 20 20 255\n").find("16, 32 ... 1024") != std::string::npos);
  CHECK(error("P6 16 16 255\n123").find("ends early") != std::string::npos);
  CHECK(load_picture(folder.path / "none.ppm", 1.0).error().find("cannot be read") != std::string::npos);
}

TEST_CASE("true disparity is f B / depth") {
  const auto s = test::small_simulation();
  s->begin(0);
  const StereoRig rig = test::small_rig();
  std::vector<float> depth(static_cast<size_t>(rig.width * rig.height)), disparity(depth.size());
  s->true_depth(rig, 0, depth.data());
  s->true_disparity(rig, 0, disparity.data());
  for (size_t i = 0; i < depth.size(); ++i)
    CHECK(disparity[i] * depth[i] == doctest::Approx(rig.focal_px * 0.24).epsilon(1e-5));
}

TEST_CASE("a distorted lens shows a point where the Brown model puts it") {
  const auto s = test::small_simulation();
  s->begin(0);
  StereoRig rig = test::small_rig();
  const View ideal = render(*s, rig, 0);
  rig.rectified = false;
  rig.distortion = {-0.15, 0.03, 0.001, -0.002, 0.0};
  std::vector<uint8_t> bytes(static_cast<size_t>(rig.width * rig.height * 3));
  const ImageView<uint8_t> raw(bytes.data(), rig.width, rig.height, 3);
  Lens(rig).render(s->scene(), s->camera_pose(rig, 0, 0), {0, 0}, 1, raw);
  std::vector<double> with, without;
  for (int y = 10; y < rig.height - 10; ++y) {
    for (int x = 10; x < rig.width - 10; ++x) {
      const double px = (x - rig.cu_px) / rig.focal_px, py = (y - rig.cv_px) / rig.focal_px, r2 = px * px + py * py;
      const double radial = 1 - 0.15 * r2 + 0.03 * r2 * r2;
      const double u = rig.cu_px + rig.focal_px * (px * radial + 2 * 0.001 * px * py - 0.002 * (r2 + 2 * px * px));
      const double v = rig.cv_px + rig.focal_px * (py * radial + 0.001 * (r2 + 2 * py * py) - 2 * 0.002 * px * py);
      const int iu = static_cast<int>(std::floor(u)), iv = static_cast<int>(std::floor(v));
      if (!raw.contains(iu, iv) || !raw.contains(iu + 1, iv + 1)) continue;
      const double wx = u - iu, wy = v - iv;
      const double seen = (1 - wy) * ((1 - wx) * raw.at(iu, iv, 1) + wx * raw.at(iu + 1, iv, 1)) +
                          wy * ((1 - wx) * raw.at(iu, iv + 1, 1) + wx * raw.at(iu + 1, iv + 1, 1));
      with.push_back(std::abs(seen - ideal.image.at(x, y, 1)));
      without.push_back(std::abs(raw.at(x, y, 1) - ideal.image.at(x, y, 1)));
    }
  }
  const auto mean = [](const std::vector<double>& d) {
    double sum = 0;
    for (const double v : d) sum += v;
    return sum / static_cast<double>(d.size());
  };
  CHECK(mean(with) < 0.5 * mean(without));
}

TEST_CASE("noise has the variance that is asked for and differs between exposures") {
  const auto s = test::small_simulation();
  s->begin(0);
  const StereoRig rig = test::small_rig();
  const View clean = render(*s, rig, 0);
  std::vector<uint8_t> bytes(clean.bytes.size()), again(clean.bytes.size());
  Renderer renderer({rig.width, rig.height, rig.focal_px, rig.cu_px, rig.cv_px});
  renderer.render(s->scene(), s->camera_pose(rig, 0, 0), {2.0, 0.0}, 1, {bytes.data(), rig.width, rig.height, 3});
  renderer.render(s->scene(), s->camera_pose(rig, 0, 0), {2.0, 0.0}, 2, {again.data(), rig.width, rig.height, 3});
  CHECK(bytes != again);
  double sum = 0, squares = 0, n = 0;
  for (size_t i = 0; i < bytes.size(); ++i) {
    if (clean.bytes[i] < 20 || clean.bytes[i] > 235) continue;  // clipped
    const double d = static_cast<double>(bytes[i]) - clean.bytes[i];
    sum += d, squares += d * d, n += 1;
  }
  CHECK(std::abs(sum / n) < 0.1);
  CHECK(std::sqrt(squares / n) == doctest::Approx(2.0).epsilon(0.1));
}
