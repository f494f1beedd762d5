// SPDX-License-Identifier: Apache-2.0
#include "hal/camera/rig.hpp"

#include <yaml-cpp/yaml.h>

#include <cmath>
#include <cstdlib>
#include <set>

#include "hal/settings/units.hpp"
#include "rt/file/input_file.hpp"

namespace takt {
namespace {

/// Reads the keys of one YAML map and remembers the first thing that is wrong.
struct Keys {
  std::string file, id;
  YAML::Node map;
  DeviceError error;

  void fail(const YAML::Node& at, const std::string& what, const std::string& fix) {
    if (error.what.empty()) error = {id, file + ":" + std::to_string(at.Mark().line + 1) + ": " + what, fix};
  }
  void quantity(const char* name, Dimension dimension, double& value, bool required = false) {
    const YAML::Node node = map[name];
    if (!node) {
      if (required) fail(map, std::string("`") + name + "` is missing", std::string("add `") + name + "`");
      return;
    }
    const auto parsed = node.IsScalar() ? parse_quantity(node.Scalar(), dimension) : std::nullopt;
    if (parsed) value = *parsed;
    else
      fail(node, std::string("`") + name + "` must be a value in " + std::string(unit_names(dimension)),
           "correct the value");
  }
  void integer(const char* name, int& value, int low, int high) {
    double number = value;
    quantity(name, Dimension::number, number);
    if (number != std::floor(number) || number < low || number > high) {
      fail(map[name],
           std::string("`") + name + "` must be an integer in " + std::to_string(low) + ".." + std::to_string(high),
           "correct the value");
    } else {
      value = static_cast<int>(number);
    }
  }
  void flag(const char* name, bool& value) {
    const YAML::Node node = map[name];
    if (!node) return;
    if (node.IsScalar() && (node.Scalar() == "true" || node.Scalar() == "false")) value = node.Scalar() == "true";
    else fail(node, std::string("`") + name + "` must be true or false", "correct the value");
  }
  template <size_t N>
  void list(const char* name, Dimension dimension, std::array<double, N>& values) {
    const YAML::Node node = map[name];
    if (!node) return;
    bool good = node.IsSequence() && node.size() == N;
    for (size_t i = 0; good && i < N; ++i) {
      const auto parsed = node[i].IsScalar() ? parse_quantity(node[i].Scalar(), dimension) : std::nullopt;
      good = parsed.has_value();
      if (good) values[i] = *parsed;
    }
    if (!good)
      fail(node, std::string("`") + name + "` must be a list of " + std::to_string(N) + " values", "correct the list");
  }
  void only(const std::set<std::string>& known) {
    for (const auto& entry : map) {
      const std::string key = entry.first.as<std::string>();
      if (known.count(key) != 0) continue;
      std::string all;
      for (const std::string& name : known) all += (all.empty() ? "" : ", ") + name;
      fail(entry.first, "unknown key `" + key + "`", "known keys: " + all);
    }
  }
};

void read_mount(Keys& outer, StereoRig& rig) {
  const YAML::Node mount = outer.map["mount"];
  if (!mount) return;
  if (!mount.IsMap())
    return outer.fail(mount, "`mount` must be a map", "write mount: {x: 0m, y: 0.1m, z: 1.3m, tilt: -15deg}");
  Keys keys{outer.file, outer.id, mount, {}};
  keys.only({"x", "y", "z", "pan", "tilt", "roll", "on_head"});
  keys.quantity("x", Dimension::length, rig.x_m);
  keys.quantity("y", Dimension::length, rig.y_m);
  keys.quantity("z", Dimension::length, rig.z_m);
  keys.quantity("pan", Dimension::angle, rig.pan_rad);
  keys.quantity("tilt", Dimension::angle, rig.tilt_rad);
  keys.quantity("roll", Dimension::angle, rig.roll_rad);
  keys.flag("on_head", rig.on_head);
  if (outer.error.what.empty()) outer.error = keys.error;
}

StereoRig read_rig(Keys& keys) {
  StereoRig rig;
  keys.only({"takt_rig", "model", "width", "height", "channels", "hfov", "baseline", "rectified", "distortion",
             "right_rotation", "mount"});
  if (keys.map["model"]) rig.model = keys.map["model"].Scalar();
  keys.integer("width", rig.width, 16, 4096);
  keys.integer("height", rig.height, 16, 4096);
  keys.integer("channels", rig.channels, 1, 3);
  if (rig.channels == 2) keys.fail(keys.map["channels"], "`channels` is 2", "use 1 (grey) or 3 (BGR)");
  keys.quantity("hfov", Dimension::angle, rig.hfov_rad, true);
  keys.quantity("baseline", Dimension::length, rig.baseline_m, true);
  keys.flag("rectified", rig.rectified);
  keys.list("distortion", Dimension::number, rig.distortion);
  keys.list("right_rotation", Dimension::angle, rig.right_rotation_rad);
  read_mount(keys, rig);
  if (keys.error.what.empty() && (rig.hfov_rad < 0.1 || rig.hfov_rad > 2.5)) {
    keys.fail(keys.map["hfov"], "`hfov` must lie in 6..143deg", "correct the value");
  }
  if (keys.error.what.empty() && rig.baseline_m <= 0)
    keys.fail(keys.map["baseline"], "`baseline` must be positive", "correct the value");
  rig.focal_px = rig.width / 2.0 / std::tan(rig.hfov_rad / 2.0);
  rig.cu_px = (rig.width - 1) / 2.0;
  rig.cv_px = (rig.height - 1) / 2.0;
  return rig;
}

}  // namespace

tl::expected<StereoRig, DeviceError> load_rig(const std::string& device_id, const std::filesystem::path& file) {
  Keys keys{file.string(), device_id, {}, {}};
  if (const std::string why = why_unreadable(file, kLargestText); !why.empty())
    return device_error(device_id, file.string() + ": the rig file " + why, "correct `rig:` of the device");
  try {
    keys.map = YAML::LoadFile(file.string());
  } catch (const YAML::Exception& e) {
    return device_error(device_id, file.string() + ":" + std::to_string(e.mark.line + 1) + ": " + e.msg,
                        "correct the YAML");
  }
  if (!keys.map.IsMap()) return device_error(device_id, file.string() + ":1: not a map of keys", "see rigs/xb3.yaml");
  StereoRig rig;
  try {
    rig = read_rig(keys);
  } catch (const YAML::Exception& e) {
    return device_error(device_id, file.string() + ":" + std::to_string(e.mark.line + 1) + ": " + e.msg,
                        "correct the YAML");
  }
  if (!keys.error.what.empty()) return tl::unexpected(keys.error);
  return rig;
}

Transform camera_in_robot(const StereoRig& rig, double head_pan, double head_tilt) {
  const double pan = (rig.pan_rad + (rig.on_head ? head_pan : 0)) / 2,
               tilt = (rig.tilt_rad + (rig.on_head ? head_tilt : 0)) / 2;
  const double roll = rig.roll_rad / 2;
  const double cz = std::cos(pan), sz = std::sin(pan), cx = std::cos(tilt), sx = std::sin(tilt), cy = std::cos(roll),
               sy = std::sin(roll);
  // Rz(pan) Rx(tilt) Ry(roll), then the quarter turn from robot axes (x right, y forward, z up) to camera axes.
  const double w = cz * cx * cy - sz * sx * sy, x = cz * sx * cy - sz * cx * sy, y = cz * cx * sy + sz * sx * cy,
               z = sz * cx * cy + cz * sx * sy;
  const double h = std::sqrt(0.5);  // camera axes in the robot frame: Rx(-90 deg), quaternion (h, -h, 0, 0)
  Transform t;
  t.x = rig.x_m, t.y = rig.y_m, t.z = rig.z_m;
  t.qw = h * (w + x), t.qx = h * (x - w), t.qy = h * (y - z), t.qz = h * (z + y);
  return t;
}

}  // namespace takt
