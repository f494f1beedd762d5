// SPDX-License-Identifier: Apache-2.0
// Makes object databases of simulated worlds: views of their striped boxes, each alone on black. A box whose look never
// changes is an object by its own name; one with looks is an object of its type, an entry for each look, with the
// attribute values that the look stands for.
//
//     render_objects WORLD.xml DIR              writes DIR/objects.txt and the views
//     render_objects WORLD.xml --compare DIR    exit 1 unless DIR holds just these views
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstring>
#include <fstream>
#include <functional>
#include <numbers>
#include <opencv2/core.hpp>
#include <opencv2/imgcodecs.hpp>
#include <set>

#include "hal/sim/placed.hpp"
#include "hal/sim/renderer.hpp"
#include "hal/sim/world.hpp"

namespace {

using namespace takt;
using namespace takt::sim;

constexpr int kSide = 48, kViews = 8;
constexpr uint64_t kSeed = 1;  // of the textures: that of `takt run` without --seed

/// From where views are taken: around the object, at the height of a camera on the robot.
struct Ring {
  double distance_m, height_m;
};
/// Reference and test views of what stands on the floor, and of what stands on a table, which is smaller and seen from
/// nearer.
constexpr Ring kFloor[] = {{3.5, 1.4}, {2.6, 1.2}}, kTable[] = {{1.4, 1.4}, {1.1, 1.4}};

/// What one entry of the database shows.
struct Entry {
  std::string name;    ///< of the object, with attribute values: "bottle level=full"
  std::string folder;  ///< of its views
  Scene scene;
  Vec3 centre;
  double yaw_rad;
  const Ring* rings;
};

/// The surfaces of one object of the world, exactly as they stand in the whole scene.
Scene alone(const World& world, size_t object, const std::shared_ptr<const TextureSet>& textures) {
  World before = world;
  before.objects.resize(object);
  const size_t first = build_scene(before, textures).quads.size();
  before.objects = {world.objects.begin(), world.objects.begin() + static_cast<ptrdiff_t>(object) + 1};
  Scene scene = build_scene(before, textures);
  scene.quads.erase(scene.quads.begin(), scene.quads.begin() + static_cast<ptrdiff_t>(first));
  scene.capsules.clear();
  return scene;
}

CameraPose look(const Vec3& from, const Vec3& to) {
  CameraPose pose;
  pose.position = from;
  const Vec3 forward = (to - from).normalized(), right = forward.cross(Vec3::UnitZ()).normalized();
  pose.rotation.col(0) = right;
  pose.rotation.col(1) = forward.cross(right);
  pose.rotation.col(2) = forward;
  return pose;
}

/// A camera of kSide x kSide pixels that the object fills up to a rim of one pixel.
Pinhole camera_for(const Scene& scene, const CameraPose& pose) {
  Eigen::Array2d low(1e9, 1e9), high(-1e9, -1e9);
  for (const Quad& quad : scene.quads) {
    for (const Vec3& corner : quad.corner) {
      const Vec3 p = pose.rotation.transpose() * (corner - pose.position);
      const Eigen::Array2d at(p.x() / p.z(), p.y() / p.z());
      low = low.min(at);
      high = high.max(at);
    }
  }
  Pinhole camera{kSide, kSide, (kSide - 2) / (high - low).maxCoeff(), 0, 0};
  const Eigen::Array2d middle = (low + high) / 2;
  camera.cu_px = (kSide - 1) / 2.0 - camera.focal_px * middle.x();
  camera.cv_px = (kSide - 1) / 2.0 - camera.focal_px * middle.y();
  return camera;
}

cv::Mat3b render(const Entry& entry, double azimuth_rad, const Ring& ring, uint64_t noise_seed) {
  const double azimuth = azimuth_rad + entry.yaw_rad;
  const Vec3& centre = entry.centre;
  const Vec3 from(centre.x() + ring.distance_m * std::cos(azimuth), centre.y() + ring.distance_m * std::sin(azimuth),
                  ring.height_m);
  const CameraPose pose = look(from, centre);
  cv::Mat3b image(kSide, kSide);
  cv::Mat1f depth(kSide, kSide);
  Renderer(camera_for(entry.scene, pose))
      .render(entry.scene, pose, {}, noise_seed, {image.data, kSide, kSide, 3}, depth.ptr<float>());
  for (int y = 0; y < kSide; ++y) {
    for (int x = 0; x < kSide; ++x) {
      cv::Vec3b& pixel = image(y, x);
      if (depth(y, x) <= 0) pixel = {0, 0, 0};
      else if (pixel == cv::Vec3b(0, 0, 0)) pixel = {1, 1, 1};  // black, but no background
    }
  }
  return image;
}

using Take = std::function<bool(const std::string& name, const cv::Mat3b& image)>;

/// Gives every view of the object to `take`; false as soon as that fails. Test views lie between the reference views
/// and are taken from nearer and lower, with noise of their own.
bool each_view(const Entry& entry, const Take& take) {
  for (int k = 0; k < kViews; ++k) {
    const double step = 2 * std::numbers::pi / kViews, number = k;
    const auto seed = static_cast<uint64_t>(k);
    const std::string stem = entry.folder + "/";
    if (!take(stem + "view_" + std::to_string(k) + ".png", render(entry, number * step, entry.rings[0], seed)) ||
        !take(stem + "test_" + std::to_string(k) + ".png",
              render(entry, (number + 0.5) * step, entry.rings[1], seed + 100)))
      return false;
  }
  return true;
}

bool striped(const Shape& shape) {
  return shape.box && shape.box->material >= Material::red_stripes && shape.box->material != Material::asphalt;
}

Entry entry_of(const WorldObject& object, const Shape& shape, const std::string& name, Scene scene) {
  std::string folder = name;
  std::replace(folder.begin(), folder.end(), ' ', '_');
  const Box& box = *shape.box;
  return {name,
          folder,
          std::move(scene),
          Vec3(object.position.x(), object.position.y(), box.z_m + box.height_m / 2),
          object.yaw_rad,
          box.z_m > 0 ? kTable : kFloor};
}

std::vector<Entry> entries_of(const World& world) {
  const auto textures = textures_of(kSeed);
  std::vector<Entry> entries;
  std::set<std::string> types;
  for (size_t i = 0; i < world.objects.size(); ++i) {
    const WorldObject& object = world.objects[i];
    if (object.looks.empty() && striped(object))
      entries.push_back(entry_of(object, object, object.name, alone(world, i, textures)));
    if (object.looks.empty() || !types.insert(object.type).second) continue;
    for (const Look& look : object.looks) {
      if (!striped(look.shape)) continue;
      std::string name = object.type;
      for (const Condition& condition : look.when) name += " " + condition.attribute + "=" + condition.value;
      Scene scene;
      scene.textures = textures;
      add_moving(scene, {&look.shape, object.position, object.yaw_rad, 0}, texture_start(i));
      entries.push_back(entry_of(object, look.shape, name, std::move(scene)));
    }
  }
  return entries;
}

bool write(const World& world, const std::filesystem::path& folder) {
  std::filesystem::create_directories(folder);
  std::ofstream list(folder / "objects.txt");
  list << "# The striped boxes of the world " << world.name << ", rendered by tests/tools/render_objects.cpp.\n";
  for (const Entry& entry : entries_of(world)) {
    std::filesystem::create_directories(folder / entry.folder);
    list << "\nobject " << entry.name << "\nthreshold auto\n";
    const auto take = [&](const std::string& name, const cv::Mat3b& image) {
      list << (name.find("test_") == std::string::npos ? "view " : "test_view ") << name << "\n";
      return cv::imwrite((folder / name).string(), image);
    };
    if (!each_view(entry, take)) return false;
  }
  return static_cast<bool>(list.flush());
}

bool compare(const World& world, const std::filesystem::path& folder) {
  const std::vector<Entry> entries = entries_of(world);
  return std::all_of(entries.begin(), entries.end(), [&](const Entry& entry) {
    return each_view(entry, [&](const std::string& name, const cv::Mat3b& image) {
      const cv::Mat shipped = cv::imread((folder / name).string(), cv::IMREAD_UNCHANGED);
      const bool equal =
          shipped.type() == CV_8UC3 && shipped.size() == image.size() && cv::norm(shipped, image, cv::NORM_INF) == 0;
      if (!equal) std::fprintf(stderr, "%s differs from what the world looks like\n", (folder / name).c_str());
      return equal;
    });
  });
}

}  // namespace

int main(int argc, char** argv) {
  const bool comparing = argc == 4 && std::strcmp(argv[2], "--compare") == 0;
  if (argc != 3 && !comparing) {
    std::fprintf(stderr, "usage: render_objects WORLD.xml [--compare] DIR\n");
    return 2;
  }
  const auto world = load_world("render_objects", argv[1]);
  if (!world) {
    std::fprintf(stderr, "%s\n", world.error().text().c_str());
    return 2;
  }
  return (comparing ? compare(*world, argv[3]) : write(*world, argv[2])) ? 0 : 1;
}
