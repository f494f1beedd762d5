// SPDX-License-Identifier: Apache-2.0
#include "nodes/mapping_3d/median_fusion.hpp"

#include <doctest/doctest.h>

#include <algorithm>
#include <random>
#include <vector>

#include "rt/memory/memory_use.hpp"
#include "rt/msg/geometry.hpp"
#include "rt/msg/point.hpp"

using namespace takt;
using namespace takt::mapping_3d;

namespace {

constexpr DepthCamera kCamera{50, 40, 60, 24.5, 19.5, 0.01};

/// Views from places side by side, `apart_m` from one to the next.
struct Views {
  std::vector<std::vector<float>> depth_m;
  std::vector<std::vector<Colour>> colour;
  std::vector<DepthView> views;

  Views(size_t count, double apart_m, float depth) {
    depth_m.assign(count, std::vector<float>(kCamera.pixels(), depth));
    colour.assign(count, std::vector<Colour>(kCamera.pixels()));
    for (size_t k = 0; k < count; ++k) {
      std::fill(colour[k].begin(), colour[k].end(), Colour{static_cast<uint8_t>(k), 0, 0});
      Transform pose;
      pose.x = apart_m * static_cast<double>(k);
      views.push_back({kCamera, pose, depth_m[k], colour[k]});
    }
  }
  std::vector<float> fuse(size_t reference, const FusionParameters& p) {
    MedianFusion fusion(views.size(), kCamera.pixels());
    std::vector<float> out(kCamera.pixels());
    fusion.fuse(views, reference, p, out);
    return out;
  }
  /// A thing of that many pixels around the middle, before everything else.
  void put(size_t view, float depth, int half = 6) {
    for (int v = 20 - half; v < 20 + half; ++v)
      for (int u = 25 - half; u < 25 + half; ++u) depth_m[view][static_cast<size_t>(v * kCamera.width + u)] = depth;
  }
};

constexpr size_t kMiddle = 20 * 50 + 25;

}  // namespace

TEST_CASE("oracle 17: with equal viewpoints the result is the lower median of each pixel, with one view that view") {
  std::mt19937 random(1);
  for (size_t count = 1; count <= 12; ++count) {
    CAPTURE(count);
    Views views(count, 0, 0);
    for (auto& view : views.depth_m)
      for (float& depth : view) depth = random() % 5 == 0 ? 0 : std::uniform_real_distribution<float>(1, 5)(random);
    for (const bool refine : {false, true}) {
      FusionParameters p{0, 0, refine, 1};
      const std::vector<float> fused = views.fuse(count / 2, p);
      size_t wrong = 0;
      for (size_t i = 0; i < kCamera.pixels(); ++i) {
        std::vector<float> depths;
        for (const auto& view : views.depth_m)
          if (view[i] > 0) depths.push_back(view[i]);
        std::sort(depths.begin(), depths.end());
        wrong += fused[i] != (depths.empty() ? 0 : depths[(depths.size() + 1) / 2 - 1]);
      }
      CHECK(wrong == 0);
    }
  }
}

TEST_CASE("what one view alone has, nearer or farther than the rest, is not in the result") {
  for (const float thing : {1.5f, 4.5f}) {
    CAPTURE(thing);
    for (size_t odd = 0; odd < 5; ++odd) {
      Views views(5, 0.02, 3);
      views.put(odd, thing);
      const std::vector<float> fused = views.fuse(2, {});
      CHECK(fused[kMiddle] == doctest::Approx(3));
      CHECK(std::all_of(fused.begin(), fused.end(),
                        [](float depth) { return depth == 0 || std::abs(depth - 3) < 1e-4; }));
    }
  }
}

TEST_CASE("something that most views have is in the result, also where the reference has nothing") {
  Views views(5, 0, 3);
  for (const size_t k : {0, 1, 3}) views.put(k, 1.5f);
  CHECK(views.fuse(2, {})[kMiddle] == doctest::Approx(1.5));
  views.put(2, 0);
  CHECK(views.fuse(2, {})[kMiddle] == doctest::Approx(1.5));
}

TEST_CASE("a depth needs the support of two views, of one where there is no other") {
  Views views(3, 0, 0);
  views.put(1, 2);
  CHECK(views.fuse(1, {})[kMiddle] == 0);
  FusionParameters alone;
  alone.support = 1;
  CHECK(views.fuse(1, alone)[kMiddle] == 2);
  Views one(1, 0, 2);
  CHECK(one.fuse(0, {})[kMiddle] == 2);
}

TEST_CASE("without the median at the end the result lies too near, with it the bias goes (C-3)") {
  std::mt19937 random(2);
  std::normal_distribution<float> noise(0, 0.03f);
  Views views(7, 0.01, 0);
  for (auto& view : views.depth_m)
    for (float& depth : view) depth = 3 + noise(random);
  const auto mean = [](const std::vector<float>& depths) {
    double sum = 0, count = 0;
    for (const float depth : depths)
      if (depth > 0) sum += depth, count += 1;
    return sum / count;
  };
  FusionParameters nearest;
  nearest.refine = false;
  CHECK(mean(views.fuse(3, nearest)) < 2.97);
  CHECK(std::abs(mean(views.fuse(3, {})) - 3) < 0.01);
}

TEST_CASE("points take the colour of the reference view, else of one that saw them; nothing is allocated") {
  Views views(3, 0, 2);
  views.put(2, 0);
  MedianFusion fusion(3, kCamera.pixels());
  std::vector<float> depth(kCamera.pixels());
  std::vector<Point> points(kCamera.pixels());
  std::vector<Colour> colours(kCamera.pixels());
  const uint64_t before = thread_memory_use().allocations;
  fusion.fuse(views.views, 2, {}, depth);
  cloud::CloudBuffer out(points, colours);
  fusion.push(views.views, depth, 10, out);
  if (counting_allocations()) CHECK(thread_memory_use().allocations == before);
  REQUIRE(out.size() == kCamera.pixels());
  CHECK(int{colours[0].b} == 2);
  CHECK(int{colours[kMiddle].b} == 0);
  CHECK(points[kMiddle].x == doctest::Approx((25 - 24.5) / 60 * 2));
  CHECK(points[kMiddle].z == 2);
  out.clear();
  fusion.push(views.views, depth, 1.9, out);
  CHECK(out.size() == 0);
}

TEST_CASE("a cloud drawn with its own camera gives its depths back, the nearest of each pixel") {
  const CameraModel model{480, 319.5, 239.5, 0.24};
  const DepthCamera camera = depth_camera_of(model, 4, 160 * 120);
  CHECK(camera.width == 160);
  CHECK(camera.height == 120);
  CHECK(camera.step_per_m == doctest::Approx(1 / (480 * 0.24)));
  std::vector<Point> points;
  for (int v = 0; v < 480; v += 4)
    for (int u = 0; u < 640; u += 4)
      for (const float z : {3.0f, 2.0f + 0.001f * static_cast<float>(u)})
        points.push_back({static_cast<float>((u - 319.5) / 480 * z), static_cast<float>((v - 239.5) / 480 * z), z});
  std::vector<float> depth(camera.pixels());
  DepthView view{camera, {}, depth, {}};
  draw(points, {}, view);
  size_t wrong = 0;
  for (size_t i = 0; i < depth.size(); ++i) wrong += depth[i] != 2.0f + 0.001f * static_cast<float>(i % 160 * 4);
  CHECK(wrong == 0);
  CHECK(depth_camera_of(model, 4, 160 * 100).height == 100);  // no more than there is memory for
}
