// SPDX-License-Identifier: Apache-2.0
// Each fast form against a slow obvious one on random input.
#include <doctest/doctest.h>

#include <Eigen/Geometry>
#include <cmath>
#include <map>
#include <random>
#include <vector>

#include "nodes/ground_map/cell_kernel.hpp"
#include "nodes/ground_map/confidence.hpp"
#include "nodes/ground_map/ground_grid.hpp"
#include "nodes/ground_map/mask_cleaner.hpp"
#include "nodes/ground_map/saturation_value.hpp"
#include "nodes/ground_map/texture.hpp"
#include "nodes/mapping_3d/pose.hpp"
#include "rt/msg/geometry.hpp"
#include "tests/on_each_target.hpp"
#include "tests/property_scale.hpp"

using namespace takt;
using namespace takt::ground_map;
using takt::test::on_each_target;

namespace {

struct Random {
  std::mt19937 engine;
  explicit Random(uint64_t seed) : engine(seed) {}
  int pick(int low, int high) { return std::uniform_int_distribution<int>(low, high)(engine); }
  double uniform(double low, double high) { return std::uniform_real_distribution<>(low, high)(engine); }
};

/// Ground with holes and islands of a few pixels.
std::vector<uint8_t> blotches(Random& random, int width, int height) {
  std::vector<uint8_t> mask(static_cast<size_t>(width * height), static_cast<uint8_t>(random.pick(0, 1)));
  for (int n = random.pick(0, 60); n > 0; --n) {
    const int x0 = random.pick(0, width - 1), y0 = random.pick(0, height - 1);
    const int w = random.pick(1, 1 + width / 3), h = random.pick(1, 1 + height / 3), value = random.pick(0, 1);
    for (int y = y0; y < std::min(height, y0 + h); ++y)
      for (int x = x0; x < std::min(width, x0 + w); ++x)
        mask[static_cast<size_t>(y * width + x)] = static_cast<uint8_t>(value);
  }
  for (auto& m : mask)
    if (random.pick(0, 11) == 0) m ^= 1;
  return mask;
}

/// The mean of every window, then growth from the area until nothing changes.
std::vector<uint8_t> clean_reference(const std::vector<uint8_t>& raw, int width, int height, int mean_size,
                                     const ReferenceArea& area) {
  const auto at = [&](int x, int y) { return static_cast<size_t>(y * width + x); };
  std::vector<uint8_t> smooth(raw.size()), out(raw.size());
  for (int y = 0; y < height; ++y)
    for (int x = 0; x < width; ++x) {
      int sum = 0, count = 0;
      for (int v = y - mean_size / 2; v <= y + mean_size / 2; ++v)
        for (int u = x - mean_size / 2; u <= x + mean_size / 2; ++u)
          if (u >= 0 && v >= 0 && u < width && v < height) sum += raw[at(u, v)], ++count;
      smooth[at(x, y)] = sum > 0.5 * count;
    }
  for (const RowSpan& span : area.spans())
    for (int x = span.first; x < span.last; ++x)
      if (smooth[at(x, span.y)]) out[at(x, span.y)] = 255;
  for (bool changed = true; changed;) {
    changed = false;
    for (int y = 0; y < height; ++y)
      for (int x = 0; x < width; ++x) {
        if (!smooth[at(x, y)] || out[at(x, y)]) continue;
        const bool beside = (x > 0 && out[at(x - 1, y)]) || (x + 1 < width && out[at(x + 1, y)]) ||
                            (y > 0 && out[at(x, y - 1)]) || (y + 1 < height && out[at(x, y + 1)]);
        if (beside) out[at(x, y)] = 255, changed = true;
      }
  }
  return out;
}

}  // namespace

TEST_CASE("saturation and value equal the rounded quotient on every SIMD target and touch nothing beyond") {
  for (int high = 1; high < 256; ++high)
    for (int low = 0; low <= high; ++low) {
      const auto p = saturation_value(static_cast<uint8_t>(low), static_cast<uint8_t>(high), static_cast<uint8_t>(low));
      REQUIRE(p.saturation == std::floor(255.0 * (high - low) / high + 0.5));
      REQUIRE(p.value == high);
    }
  // Every pair of largest and smallest channel, in changing places; lengths that are no multiple of a vector.
  std::vector<uint8_t> bgr;
  for (int high = 0; high < 256; ++high)
    for (int low = 0; low <= high; ++low) {
      const int middle = low + (high - low) * ((high + low) % 5) / 5, order = (high * 7 + low) % 6;
      const int channel[6][3] = {{0, 1, 2}, {0, 2, 1}, {1, 0, 2}, {1, 2, 0}, {2, 0, 1}, {2, 1, 0}};
      const int value[3] = {low, middle, high};
      for (const int c : channel[order]) bgr.push_back(static_cast<uint8_t>(value[c]));
    }
  on_each_target([&] {
    const int pixels = static_cast<int>(bgr.size() / 3);
    for (int first = 0, count = 1; first < pixels; first += count, count = count % 97 + 1) {
      count = std::min(count, pixels - first);
      const std::vector<uint8_t> part(bgr.begin() + 3 * first, bgr.begin() + 3 * (first + count));
      std::vector<uint8_t> s(static_cast<size_t>(count) + 1, 0xA5), v(s);
      saturation_value_row(part.data(), count, s.data(), v.data());
      for (int i = 0; i < count; ++i) {
        const auto k = static_cast<size_t>(i);
        const SaturationValue p = saturation_value(part[3 * k], part[3 * k + 1], part[3 * k + 2]);
        REQUIRE(s[k] == p.saturation);
        REQUIRE(v[k] == p.value);
      }
      REQUIRE(s.back() == 0xA5);
      REQUIRE(v.back() == 0xA5);
    }
  });
}

TEST_CASE("oracle 14: the table equals the sum over all entries, and the weights of Eq. 4.3 with E-19") {
  Random random(test::seed(1));
  for (int round = 0; round < test::rounds(40); ++round) {
    const int capacity = random.pick(1, 40);
    const double t_w = random.uniform(0.05, 3);
    TextureMemory memory(capacity, t_w);
    std::vector<Descriptor> history;
    for (int n = random.pick(0, 90); n > 0; --n) {
      const int s[2] = {random.pick(0, 255), random.pick(0, 255)}, v[2] = {random.pick(0, 255), random.pick(0, 255)};
      history.push_back({static_cast<uint8_t>(std::min(s[0], s[1])), static_cast<uint8_t>(std::max(s[0], s[1])),
                         static_cast<uint8_t>(std::min(v[0], v[1])), static_cast<uint8_t>(std::max(v[0], v[1]))});
      memory.add(history.back());
    }
    REQUIRE(memory.size() == std::min<int>(capacity, static_cast<int>(history.size())));
    bool equal = true;
    for (int v = 0; v < 256; ++v)
      for (int s = 0; s < 256; ++s) {
        int32_t sum = 0;
        for (int age = 0; age < memory.size(); ++age) {
          const Descriptor& d = history[history.size() - 1 - static_cast<size_t>(age)];
          if (d.contains(static_cast<uint8_t>(s), static_cast<uint8_t>(v))) sum += capacity - age;
        }
        equal &= memory.sum(static_cast<uint8_t>(s), static_cast<uint8_t>(v)) == sum;
        equal &= (memory.table()[256 * v + s] != 0) == (sum > t_w * capacity);
      }
    CHECK(equal);
  }
}

TEST_CASE("the cleaned mask equals window means and growth until nothing changes") {
  Random random(test::seed(2));
  for (int round = 0; round < test::rounds(150); ++round) {
    const int w = random.pick(1, 90), h = random.pick(1, 60), mean_size = 2 * random.pick(0, 4) + 1;
    const ReferenceArea area(w, h, {random.uniform(0.1, 1), random.uniform(0.1, 1), random.uniform(0.05, 1), 0.02});
    MaskCleaner cleaner(w, h, mean_size);
    for (int image = 0; image < 3; ++image) {  // nothing may be left over from an image
      const std::vector<uint8_t> raw = blotches(random, w, h);
      std::vector<uint8_t> mask(raw.size(), 0x5A);
      cleaner.clean({raw.data(), w, h}, area, {mask.data(), w, h});
      REQUIRE(mask == clean_reference(raw, w, h, mean_size, area));
    }
  }
}

TEST_CASE("doubtful is what is flooded, or ground in another light: equal to a search of every value and saturation") {
  Random random(test::seed(6));
  for (int round = 0; round < test::rounds(6); ++round) {
    DoubtParameters p;
    p.bloom_value = random.pick(200, 256);
    p.shade_deepest = random.uniform(0.1, 0.6);
    p.shade_faintest = random.uniform(p.shade_deepest, 1.0);
    p.shade_saturation = random.pick(0, 40);
    std::vector<uint8_t> ground(256 * 256);
    for (int n = random.pick(0, 3); n > 0; --n) {
      const int s0 = random.pick(0, 240), v0 = random.pick(0, 240), side = random.pick(1, 15);
      for (int v = v0; v < v0 + side; ++v) std::fill_n(&ground[static_cast<size_t>(256 * v + s0)], side, uint8_t{1});
    }
    ConfidenceTable table(p);
    table.rebuild(ground.data());
    const auto other_light = [&](int v, int s) {
      for (int w = 0; w < 256; ++w) {
        const bool darker = w * p.shade_deepest <= v && v <= w * p.shade_faintest,
                   lighter = v * p.shade_deepest <= w && w <= v * p.shade_faintest;
        if (!darker && !lighter) continue;
        for (int t = std::max(0, s - p.shade_saturation); t <= std::min(255, s + p.shade_saturation); ++t)
          if (ground[static_cast<size_t>(256 * w + t)]) return true;
      }
      return false;
    };
    int differences = 0;
    for (int i = 0; i < 4000; ++i) {
      const int v = random.pick(0, 255), s = random.pick(0, 255);
      const auto at = static_cast<size_t>(256 * v + s);
      const bool doubtful = v >= p.bloom_value || (!ground[at] && other_light(v, s));
      differences += table.table()[at] != (doubtful ? p.doubtful : kSure);
    }
    CHECK(differences == 0);
  }
}

TEST_CASE("the part of a row that sees the floor is that of its pixels, for any pose of the camera") {
  Random random(test::seed(7));
  for (int round = 0; round < test::rounds(400); ++round) {
    const int width = random.pick(1, 120);
    const Eigen::Quaterniond q(Eigen::AngleAxisd(random.uniform(-3, 3), Eigen::Vector3d::UnitZ()) *
                               Eigen::AngleAxisd(random.uniform(-2.4, -1.0), Eigen::Vector3d::UnitX()) *
                               Eigen::AngleAxisd(random.uniform(-3, 3), Eigen::Vector3d::UnitZ()));
    const FloorProjection projection =
        floor_projection({random.uniform(20, 90), width / 2.0, 40, 0}, {0, 0, 1.2, q.w(), q.x(), q.y(), q.z()});
    for (int y = 0; y < 80; ++y) {
      const RowSpan floor = projection.floor_of_row(y, width);
      for (int x = 0; x < width; ++x)
        REQUIRE(projection.floor_at(x, y).has_value() == (x >= floor.first && x < floor.last));
    }
  }
}

TEST_CASE("the floor of a pixel is where its ray meets the plane, for any pose of the camera") {
  Random random(test::seed(3));
  for (int round = 0; round < test::rounds(300); ++round) {
    const CameraModel camera{random.uniform(100, 1000), random.uniform(200, 400), random.uniform(150, 300), 0};
    const Eigen::Quaterniond q(Eigen::AngleAxisd(random.uniform(-3, 3), Eigen::Vector3d::UnitZ()) *
                               Eigen::AngleAxisd(random.uniform(-2.6, -1.4), Eigen::Vector3d::UnitX()) *
                               Eigen::AngleAxisd(random.uniform(-0.3, 0.3), Eigen::Vector3d::UnitZ()));
    const Transform pose{
        random.uniform(-1, 1), random.uniform(-1, 1), random.uniform(0.3, 2), q.w(), q.x(), q.y(), q.z()};
    const FloorProjection projection = floor_projection(camera, pose);
    const auto plane = Eigen::Hyperplane<double, 3>(Eigen::Vector3d::UnitZ(), 0.0);
    for (int n = 0; n < 50; ++n) {
      const double x = random.uniform(0, 639), y = random.uniform(0, 479);
      const Eigen::Vector3d direction =
          q * Eigen::Vector3d((x - camera.cu_px) / camera.focal_px, (y - camera.cv_px) / camera.focal_px, 1);
      const auto p = projection.floor_at(x, y);
      REQUIRE(p.has_value() == (direction.z() < -FloorProjection::kHorizon));
      if (!p || direction.z() > -0.01) continue;
      const Eigen::ParametrizedLine<double, 3> ray({pose.x, pose.y, pose.z}, direction);
      const Eigen::Vector3d hit = ray.intersectionPoint(plane);
      CHECK(p->x_m == doctest::Approx(hit.x()));
      CHECK(p->y_m == doctest::Approx(hit.y()));
      const auto back = projection.pixel_at(*p);
      REQUIRE(back.has_value());
      CHECK(back->x_px == doctest::Approx(x).epsilon(1e-6));
      CHECK(back->y_px == doctest::Approx(y).epsilon(1e-6));
    }
  }
}

namespace {

using Cells = std::map<std::pair<int64_t, int64_t>, int>;

struct Tallied {
  int free = 0, blocked = 0, confidence = 0;
};

/// Cells of the whole plane: what one image shows them to be, and by how much it changes them.
struct Observed {
  Cells cells, changes;
};

/// Observation of one image the slow way, column by column.
Observed observe_reference(ImageView<const uint8_t> mask, const FloorProjection& projection, const FloorPoint& robot,
                           const GridParameters& p, const Confidence& confidence) {
  std::map<std::pair<int64_t, int64_t>, Tallied> tallies;
  for (int x = 0; x < mask.width; ++x) {
    std::vector<std::pair<int64_t, int64_t>> passed;
    const auto leave = [&] {
      if (!passed.empty() && p.votes == Votes::columns) ++tallies[passed.back()].free;
    };
    for (int y = mask.height - 1; y >= 0; --y) {
      const auto floor = projection.floor_at(x, y);
      const bool seen = floor && std::hypot(floor->x_m - robot.x_m, floor->y_m - robot.y_m) <= p.range_max_m;
      const std::pair<int64_t, int64_t> cell = seen ? std::pair{static_cast<int64_t>(std::floor(floor->x_m / p.cell_m)),
                                                                static_cast<int64_t>(std::floor(floor->y_m / p.cell_m))}
                                                    : std::pair<int64_t, int64_t>{};
      const bool same = seen && !passed.empty() && passed.back() == cell;
      if (!same) leave(), passed.clear();
      if (!mask.at(x, y)) {
        if (seen) ++tallies[cell].blocked, tallies[cell].confidence += confidence.at(x, std::max(0, y - p.beyond_px));
        passed.clear();
        break;
      }
      if (seen) {
        passed.assign(1, cell);
        if (p.votes == Votes::pixels) ++tallies[cell].free;
      }
    }
    leave();
  }
  Observed out;
  for (const auto& [cell, votes] : tallies) {
    if (votes.free + votes.blocked < p.votes_min) continue;
    const bool free = votes.free >= votes.blocked;
    out.cells[cell] = free ? kFree : kOccupied;
    out.changes[cell] =
        free ? -p.down : static_cast<int>(std::floor(p.up * (votes.confidence / 255.0) / votes.blocked + 1e-9));
  }
  return out;
}

bool in_window(const Window& w, const std::pair<int64_t, int64_t>& cell) {
  return cell.first >= w.column && cell.first < w.column + w.cells && cell.second >= w.row &&
         cell.second < w.row + w.cells;
}

int differences(const Window& w, ImageView<const int16_t> cells, const Cells& expected) {
  int different = 0;
  for (int r = 0; r < w.cells; ++r)
    for (int c = 0; c < w.cells; ++c) {
      const auto found = expected.find({w.column + c, w.row + r});
      different += cells.at(c, r) != (found == expected.end() ? kUnknown : found->second);
    }
  return different;
}

}  // namespace

TEST_CASE("a drive: every observation, and the map it adds up to, equal a map of cells without a window") {
  Random random(test::seed(4));
  const int w = 80, h = 60;
  for (int drive = 0; drive < test::rounds(12); ++drive) {
    GridParameters p;
    p.cell_m = random.uniform(0.15, 0.5);
    p.window_m = random.uniform(3, 14);
    p.range_max_m = random.uniform(2, 9);
    p.votes = drive % 2 == 0 ? Votes::columns : Votes::pixels;
    p.votes_min = random.pick(1, 6);
    p.beyond_px = random.pick(0, 4);
    std::vector<uint8_t> table(256 * 256);
    for (auto& c : table) c = static_cast<uint8_t>(random.pick(0, 255));
    GroundGrid grid(w, p);
    const CameraModel camera{40, 39.5, 29.5, 0};
    const FloorProjection in_robot =
        floor_projection(camera, mapping_3d::camera_mount(0.1, 0.2, 1.2, random.uniform(-0.5, 0.5), -0.4));
    Cells map;
    PlanarPose robot{random.uniform(-5, 5), random.uniform(-5, 5), random.uniform(-3, 3)};
    grid.centre({robot.x_m, robot.y_m});
    for (int frame = 0; frame < 25; ++frame) {
      robot.x_m += random.uniform(-0.6, 0.6);
      robot.y_m += random.uniform(-0.6, 0.6);
      robot.theta_rad += random.uniform(-0.4, 0.4);
      std::vector<uint8_t> mask = blotches(random, w, h);
      for (int i = 30 * w; i < h * w; ++i)
        if (random.pick(0, 30) != 0) mask[static_cast<size_t>(i)] |= 1;  // mostly free below
      const ImageView<const uint8_t> view(mask.data(), w, h);
      grid.centre({robot.x_m, robot.y_m});
      const FloorProjection in_map = in_robot.moved(robot);
      std::vector<uint8_t> saturation(mask.size()), value(mask.size());
      for (size_t i = 0; i < mask.size(); ++i) {
        saturation[i] = static_cast<uint8_t>(random.pick(0, 255));
        value[i] = static_cast<uint8_t>(random.pick(0, 255));
      }
      const Confidence confidence{
          drive % 3 == 0 ? nullptr : table.data(), {saturation.data(), w, h}, {value.data(), w, h}};
      grid.observe(view, in_map, {robot.x_m, robot.y_m}, confidence);
      grid.accumulate();

      const Observed seen = observe_reference(view, in_map, {robot.x_m, robot.y_m}, p, confidence);
      REQUIRE(differences(grid.window(), grid.observation(), seen.cells) == 0);
      for (const auto& [cell, change] : seen.changes) {
        if (!in_window(grid.window(), cell)) continue;
        const auto found = map.find(cell);
        const int before = found == map.end() ? 500 : found->second;
        map[cell] = std::clamp(before + change, 0, 1000);
      }
      for (auto it = map.begin(); it != map.end();)
        it = in_window(grid.window(), it->first) ? std::next(it) : map.erase(it);
      REQUIRE(differences(grid.window(), grid.map(), map) == 0);
    }
  }
}

TEST_CASE("the cells of a row equal the projection of each pixel on every SIMD target") {
  on_each_target([&] {
    Random random(test::seed(5));
    for (int round = 0; round < test::rounds(60); ++round) {
      const int width = random.pick(1, 70), side = random.pick(2, 90);
      const double range = random.uniform(3, 40);
      const FloorProjection to_cells =
          floor_projection({random.uniform(20, 60), 0.5 * width, 30, 0},
                           mapping_3d::camera_mount(0, 0, 1.2, random.uniform(-3, 3), random.uniform(-1, 0.5)))
              .scaled({random.uniform(-9, 0), random.uniform(-9, 0)}, random.uniform(0.1, 0.5));
      const CellRow row{to_cells.h, random.uniform(0, side), random.uniform(0, side), range * range, side};
      for (int y = 0; y < 60; ++y) {
        std::vector<int32_t> out(static_cast<size_t>(width) + 1, 77);
        cells_of_row(row, y, width, out.data());
        REQUIRE(out.back() == 77);
        for (int x = 0; x < width; ++x) {
          const auto p = to_cells.floor_at(x, y);
          const bool seen = p && p->x_m >= 0 && p->y_m >= 0 && p->x_m < side && p->y_m < side &&
                            std::hypot(p->x_m - row.robot_column, p->y_m - row.robot_row) <= range;
          const int expected = seen ? static_cast<int>(p->y_m) * side + static_cast<int>(p->x_m) : kNoCell;
          REQUIRE(out[static_cast<size_t>(x)] == expected);
        }
      }
    }
  });
}
