// SPDX-License-Identifier: Apache-2.0
#include <cmath>

#include "hal/base/base_node.hpp"
#include "hal/camera/stereo_camera_node.hpp"
#include "hal/camera/v4l2_driver.hpp"
#include "hal/driver_parts.hpp"
#include "hal/laser/laser_node.hpp"
#include "hal/replay/replay_base.hpp"
#include "hal/replay/replay_camera.hpp"
#include "hal/replay/replay_laser.hpp"

namespace takt {
namespace {

using namespace hal;

NodeResult make_replay_camera(const DeviceConfig& config, Settings& settings, Devices&, const Clock& clock) {
  replay::ReplayCameraSettings camera;
  camera.directory = settings.path("directory", false);
  camera.left = settings.path("left", false);
  camera.right = settings.path("right", false);
  camera.camera = {settings.quantity("focal", Dimension::number, 0.0), settings.quantity("cu", Dimension::number, 0.0),
                   settings.quantity("cv", Dimension::number, 0.0),
                   settings.quantity("baseline", Dimension::length, 0.0)};
  camera.frames = settings.count("frames", 1, 1, 1'000'000'000);
  camera.shrink = static_cast<int>(settings.count("shrink", 1, 1, 16));
  camera.channels = static_cast<int>(settings.count("channels", 0, 0, 3));
  if (camera.channels == 2) settings.fail("setting `channels` is 2", "use 1 (grey) or 3 (BGR)");
  camera.bits = static_cast<int>(settings.count("bits", 0, 0, 16));
  if (camera.bits > 0 && camera.bits < 8) settings.fail("setting `bits` is below 8", "give 8 to 16, or leave it out");
  camera.rate = rate_of(settings);
  std::unique_ptr<StereoCamera> device = std::make_unique<replay::ReplayCamera>(config.id, camera, clock);
  return opened<StereoCameraNode>(std::move(device), settings, thresholds_of(settings));
}

replay::LogPace pace_of(Settings& settings) {
  replay::LogPace pace;
  pace.speed = settings.quantity("speed", Dimension::number, pace.speed);
  const double start_s = settings.quantity("start", Dimension::time, 0.0);
  if (std::abs(start_s) <= 4e9) pace.start_ns = std::llround(start_s * 1e9);
  else settings.fail("`start` is beyond 4e9 s", "give a time of the log");
  return pace;
}

NodeResult make_replay_laser(const DeviceConfig& config, Settings& settings, Devices&, const Clock&) {
  replay::ReplayLaserSettings laser;
  laser.log = settings.path("log", true);
  laser.pace = pace_of(settings);
  if (settings.has("mount")) laser.sensor_in_robot = settings.mount("mount");
  if (settings.has("range")) {
    laser.max_range_m = settings.quantity("range", Dimension::length);
    if (laser.max_range_m <= 0) settings.fail("`range` is not positive", "give the largest distance that counts");
  }
  std::unique_ptr<LaserScanner> device = std::make_unique<replay::ReplayLaser>(config.id, laser);
  return opened<LaserNode>(std::move(device), settings);
}

NodeResult make_replay_base(const DeviceConfig& config, Settings& settings, Devices&, const Clock&) {
  const replay::ReplayBaseSettings base{settings.path("log", true), pace_of(settings)};
  std::unique_ptr<MobileBase> device = std::make_unique<replay::ReplayBase>(config.id, base);
  return opened<BaseNode>(std::move(device), settings);
}

}  // namespace

void register_replay(DeviceTypes& types) {
  using enum SettingKind;
  types.add(
      "stereo_camera", {"replay", "recorded images", make_replay_camera, DriverSort::recorded},
      {
          {"rig", "replay", path, false, "ignored: the recording brings its calibration"},
          {"directory", "replay", path, false,
           "image_l/, image_r/, calib.txt, times.txt, or a recording of KITTI odometry, KITTI raw, EuRoC or "
           "Middlebury"},
          {"left", "replay", path, false, "left image of a single pair"},
          {"right", "replay", path, false, "right image of a single pair"},
          {"focal", "replay", number, false, "focal length of the single pair, px"},
          {"cu", "replay", number, false, "principal point of the single pair, px; the image centre"},
          {"cv", "replay", number, false, "principal point of the single pair, px; the image centre"},
          {"baseline", "replay", length, false, "baseline of the single pair"},
          {"frames", "replay", count, false, "how often the single pair is delivered; 1"},
          {"shrink", "replay", count, false, "images are made smaller by this whole factor when they are loaded; 1"},
          {"channels", "replay", count, false, "1 grey, 3 BGR; as the files"},
          {"bits", "replay", count, false, "bits that count in 16-bit images, 8 to 16; as the file says"},
      });
  types.add("laser_scanner", {"replay", "the scans of a CARMEN log", make_replay_laser, DriverSort::recorded},
            {
                {"log", "replay", path, true, "CARMEN log"},
                {"speed", "replay", number, false, "seconds of the log that pass in one second; 1"},
                {"start", "replay", time, false, "time of the log at the beginning of the run; 0s"},
                {"range", "replay", length, false, "larger ranges are no return; as the log says, else 80m"},
            });
  types.add("mobile_base", {"replay", "the odometry of a CARMEN log", make_replay_base, DriverSort::recorded},
            {
                {"log", "replay", path, true, "CARMEN log"},
                {"speed", "replay", number, false, "seconds of the log that pass in one second; 1"},
                {"start", "replay", time, false, "time of the log at the beginning of the run; 0s"},
            });
}

}  // namespace takt
