// SPDX-License-Identifier: Apache-2.0
// The ground map at 640 x 480 along a generated pavement, with a full memory of textures: saturation and value against
// one pixel after the other, the table of the memory against a test of every entry for every pixel, both with equal
// results; the clean-up against OpenCV's blur and components; a whole image, and the kind of terrain.
#include <algorithm>
#include <cstdio>
#include <opencv2/imgproc.hpp>
#include <stdexcept>

#include "bench/interleaved.hpp"
#include "bench/suite.hpp"
#include "nodes/ground_map/ground_detector.hpp"
#include "nodes/ground_map/ground_grid.hpp"
#include "nodes/ground_map/pavement_scene.hpp"
#include "nodes/ground_map/saturation_value.hpp"
#include "nodes/ground_map/terrain.hpp"

namespace takt::bench {

std::vector<Row> run_ground(const Options& options);

namespace {

using namespace ground_map;

constexpr int kWidth = 640, kHeight = 480, kFrames = 12;
constexpr size_t kPixels = size_t{kWidth} * kHeight;

using Plane = std::vector<uint8_t>;

ImageView<uint8_t> view(Plane& plane, int channels = 1) { return {plane.data(), kWidth, kHeight, channels}; }

Row row(const char* name) {
  std::fprintf(stderr, "%s\n", name);
  return {name, "ms", 0, {}, {}, {}, {}, "one thread, CPU time"};
}

template <class Theirs, class Ours>
void add(std::vector<Row>& rows, const char* name, const char* reference, int rounds, const Theirs& theirs,
         const Ours& ours) {
  Row figures = row(name);
  Compared compared = compare(
      static_cast<size_t>(rounds), [&] { return cpu_ms(theirs); }, [&] { return cpu_ms(ours); });
  figures.samples = std::move(compared.changed);
  add_pair(rows, std::move(figures), reference, compared.pairs);
}

void must_agree(bool agree) {
  if (!agree) throw std::runtime_error("ground: the fast result is not that of the reference");
}

/// A detector whose memory is full: the textures of the drive's images, again and again.
void fill(GroundDetector& detector, const PavementScene& scene, std::vector<Plane>& images, Plane& truth) {
  for (int frame = 0; frame < kFrames; ++frame) {
    images.emplace_back(3 * kPixels);
    scene.render(frame, view(images.back(), 3), view(truth));
    detector.analyse(view(images.back(), 3));
    detector.learn();
  }
  for (int i = 0; detector.memory().size() < DetectorParameters{}.memory_entries; ++i)
    detector.recall(detector.memory().by_age(i));
}

void stages(std::vector<Row>& rows, const TextureMemory& full, Plane& bgr, int rounds) {
  Plane s(kPixels), v(kPixels), s_slow(kPixels), v_slow(kPixels), raw(kPixels), raw_slow(kPixels), mask(kPixels);
  const auto each_pixel = [&] {
    for (size_t i = 0; i < kPixels; ++i) {
      const SaturationValue p = saturation_value(bgr[3 * i], bgr[3 * i + 1], bgr[3 * i + 2]);
      s_slow[i] = p.saturation, v_slow[i] = p.value;
    }
  };
  add(rows, "ground/saturation_value", "pixel by pixel", rounds, each_pixel,
      [&] { saturation_value_row(bgr.data(), static_cast<int>(kPixels), s.data(), v.data()); });
  must_agree(s == s_slow && v == v_slow);

  TextureMemory memory = full;
  const auto each_entry = [&] {
    for (size_t i = 0; i < kPixels; ++i) {
      int32_t sum = 0;
      for (int k = 0; k < memory.size(); ++k) sum += memory.entry(k).contains(s[i], v[i]) ? memory.weight(k) : 0;
      raw_slow[i] = sum > memory.limit();
    }
  };
  const auto look_up = [&] {
    memory.add(memory.by_age(0));  // as each image does
    for (size_t i = 0; i < kPixels; ++i) raw[i] = memory.table()[size_t{v[i]} * 256 + s[i]];
  };
  add(rows, "ground/texture_memory", "each entry, each pixel", std::min(rounds, 3), each_entry, look_up);
  look_up();
  each_entry();
  must_agree(raw == raw_slow);

  const ReferenceArea area(kWidth, kHeight, {});
  MaskCleaner cleaner(kWidth, kHeight, 9);
  cv::Mat blurred, labels;
  const auto opencv = [&] {
    const cv::Mat input(kHeight, kWidth, CV_8U, raw.data());
    cv::blur(input * 255, blurred, {9, 9});
    cv::connectedComponents(blurred > 127, labels, 4, CV_32S);
  };
  add(rows, "ground/clean", "OpenCV's blur and components", rounds, opencv,
      [&] { cleaner.clean(view(raw), area, view(mask)); });
}

}  // namespace

std::vector<Row> run_ground(const Options& options) {
  cv::setNumThreads(1);
  PavementOptions make;
  make.frames = kFrames;
  const PavementScene scene(make);
  GroundDetector detector(kWidth, kHeight, {});
  std::vector<Plane> images;
  Plane mask(kPixels);
  fill(detector, scene, images, mask);
  std::vector<Row> rows;
  const int rounds = options.rounds_or(10);
  stages(rows, detector.memory(), images.front(), rounds);

  Row image = row("ground/image"), terrain = row("ground/terrain");
  const FloorProjection in_robot = floor_projection(scene.camera(), scene.camera_in_robot());
  GroundGrid grid(kWidth, {});
  const TerrainShape shape;
  std::vector<int16_t> around(shape.cells());
  TerrainMaps maps{shape, {}};
  for (auto& cells : maps.cells) cells.assign(shape.cells(), kFree);
  TerrainClassifier classifier(maps, {});
  for (int round = 0; round < rounds; ++round)
    for (int frame = 0; frame < kFrames; ++frame) {
      const PlanarPose robot = scene.robot_in_map(frame);
      image.samples.add(cpu_ms([&] {
        map_image(view(images[static_cast<size_t>(frame)], 3), in_robot, robot, detector, grid, view(mask));
      }));
      terrain.samples.add(cpu_ms([&] {
        cells_around(grid.map(), grid.window(), robot, shape, around);
        classifier.step(around);
      }));
    }
  for (Row* figures : {&image, &terrain}) {
    figures->value = figures->samples.quantile(0.5).value_or(0);
    rows.push_back(std::move(*figures));
  }
  return rows;
}

}  // namespace takt::bench
