// SPDX-License-Identifier: Apache-2.0
#include "hal/actor/actor_node.hpp"
#include "hal/base/base_node.hpp"
#include "hal/camera/rig.hpp"
#include "hal/camera/stereo_camera_node.hpp"
#include "hal/camera/v4l2_driver.hpp"
#include "hal/driver_parts.hpp"
#include "hal/gpio/lines_node.hpp"
#include "hal/head/head_node.hpp"
#include "hal/interaction/interaction_node.hpp"
#include "hal/interaction/script.hpp"
#include "hal/interaction/speaking.hpp"
#include "hal/laser/laser_node.hpp"
#include "hal/object_sensor/object_sensor_node.hpp"
#include "hal/sim/failing_devices.hpp"
#include "hal/sim/sim_camera.hpp"
#include "hal/sim/sim_devices.hpp"
#include "hal/sim/sim_objects.hpp"
#include "hal/sim/worlds.hpp"

namespace takt {
namespace {

using namespace hal;

NodeResult make_sim_camera(const DeviceConfig& config, Settings& settings, sim::Simulation& world, const Clock& clock) {
  sim::SimCameraSettings camera;
  const auto file = settings.path("rig", true);
  if (settings.error()) return tl::unexpected(*settings.error());
  auto rig = load_rig(config.id, file);
  if (!rig) return tl::unexpected(rig.error());
  camera.rig = *rig;
  camera.rate = rate_of(settings);
  camera.background = settings.flag("background", true);
  camera.is_read = config.plugged;
  camera.noise.read_sigma = settings.quantity("read_noise", Dimension::number, camera.noise.read_sigma);
  camera.noise.photon_variance = settings.quantity("photon_noise", Dimension::number, camera.noise.photon_variance);
  if (camera.noise.read_sigma < 0 || camera.noise.photon_variance < 0)
    settings.fail("noise must not be negative", "correct read_noise and photon_noise");
  std::unique_ptr<StereoCamera> device = std::make_unique<sim::SimCamera>(config.id, camera, world, clock);
  device = with_failures<sim::FailingCamera>(std::move(device), settings, clock);
  return opened<StereoCameraNode>(std::move(device), settings, thresholds_of(settings));
}

NodeResult make_sim_laser(const DeviceConfig& config, Settings& settings, sim::Simulation& world) {
  sim::LaserModel model;
  model.beams = static_cast<uint32_t>(settings.count("beams", model.beams, 2, 4096));
  model.fov_rad = settings.quantity("fov", Dimension::angle, model.fov_rad);
  model.max_range_m = settings.quantity("range", Dimension::length, model.max_range_m);
  model.sigma_m = settings.quantity("noise", Dimension::length, model.sigma_m);
  model.sensor_in_robot = settings.mount("mount");
  if (!settings.has("mount")) model.sensor_in_robot.z = 0.25;
  if (model.fov_rad <= 0 || model.fov_rad > 6.2832 || model.max_range_m <= 0 || model.sigma_m < 0) {
    settings.fail("`fov`, `range` or `noise` is out of range",
                  "fov in (0, 360deg], range positive, noise not negative");
  }
  std::unique_ptr<LaserScanner> device = std::make_unique<sim::SimLaser>(config.id, model, world);
  device = with_failures<sim::FailingLaser>(std::move(device), settings);
  return opened<LaserNode>(std::move(device), settings);
}

NodeResult make_sim_base(const DeviceConfig& config, Settings& settings, sim::Simulation& world, const Clock& clock) {
  sim::OdometryModel model;
  model.scale_error = settings.quantity("scale_error", Dimension::number, model.scale_error);
  model.turn_scale_error = settings.quantity("turn_scale_error", Dimension::number, model.turn_scale_error);
  model.turn_bias_rad_s = settings.quantity("turn_bias", Dimension::turn_rate, model.turn_bias_rad_s);
  model.turn_bias_walk = settings.quantity("turn_bias_walk", Dimension::number, model.turn_bias_walk);
  sim::choose_drive(settings, world);
  std::unique_ptr<MobileBase> device = std::make_unique<sim::SimBase>(config.id, model, world, &clock);
  device = with_failures<sim::FailingBase>(std::move(device), settings);
  return opened<BaseNode>(std::move(device), settings);
}

NodeResult make_sim_object_sensor(const DeviceConfig& config, Settings& settings, sim::Simulation& world) {
  sim::PerceptionModel model;
  model.fov_rad = settings.quantity("fov", Dimension::angle, model.fov_rad);
  model.range_m = settings.quantity("range", Dimension::length, model.range_m);
  model.sigma_m = settings.quantity("noise", Dimension::length, model.sigma_m);
  model.miss = settings.quantity("miss", Dimension::number, model.miss);
  model.unknown = settings.quantity("unknown", Dimension::number, model.unknown);
  model.score = settings.quantity("score", Dimension::number, model.score);
  model.names = settings.flag("names", model.names);
  model.types = list_of(settings, "types", "");
  std::unique_ptr<ObjectSensor> device = std::make_unique<sim::SimObjectSensor>(config.id, std::move(model), world);
  device = with_failures<sim::FailingObjectSensor>(std::move(device), settings);
  return opened<ObjectSensorNode>(std::move(device), settings);
}

NodeResult make_script(const DeviceConfig& config, Settings& settings, sim::Simulation& world, const Clock& clock) {
  if (settings.has("failures")) settings.fail("a script does not fail", "leave `failures` out");
  auto script = parse_task_script(settings.text("script", ""));
  if (!script) {
    settings.fail("`script`: " + script.error(), "correct `script`");
    return tl::unexpected(*settings.error());
  }
  std::unique_ptr<Interaction> device = std::make_unique<ScriptedPerson>(
      std::move(*script), [&world](int64_t epoch_ns) { return world.begin(epoch_ns); });
  device = with_speech(std::move(device), config, settings, clock);
  return opened<InteractionNode>(std::move(device), settings);
}

NodeResult make_sim(const DeviceConfig& config, Settings& settings, Devices& devices, const Clock& clock) {
  auto world = sim::world_of(config, devices);
  if (!world) return tl::unexpected(world.error());
  if (config.kind == "stereo_camera") return make_sim_camera(config, settings, **world, clock);
  if (config.kind == "laser_scanner") return make_sim_laser(config, settings, **world);
  if (config.kind == "mobile_base") return make_sim_base(config, settings, **world, clock);
  if (config.kind == "interaction") return make_script(config, settings, **world, clock);
  if (config.kind == "camera_head") {
    std::unique_ptr<CameraHead> device = std::make_unique<sim::SimHead>(config.id, **world);
    device = with_failures<sim::FailingHead>(std::move(device), settings);
    return opened<HeadNode>(std::move(device), settings);
  }
  if (config.kind == "object_sensor") return make_sim_object_sensor(config, settings, **world);
  if (config.kind == "actor") {
    std::unique_ptr<Actor> device =
        std::make_unique<sim::SimActor>(config.id, **world, settings.quantity("spread", Dimension::number, 0.0));
    device = with_failures<sim::FailingActor>(std::move(device), settings);
    return opened<ActorNode>(std::move(device), settings);
  }
  std::unique_ptr<DigitalLines> device = std::make_unique<sim::SimLines>(config.id, **world);
  device = with_failures<sim::FailingLines>(std::move(device), settings);
  return opened<LinesNode>(std::move(device), settings);
}

}  // namespace

void register_sim(DeviceTypes& types) {
  using enum SettingKind;
  const auto add = [&](std::string_view kind, std::string_view doc, const std::vector<SettingInfo>& own) {
    std::vector<SettingInfo> settings = {
        {"failures", "sim", text, false,
         "when it fails: silent, unplugged, garbage or frozen, such as unplugged 2s..4s, frozen 6s..7s"},
        {"world", "sim", path, true, "XML file of the simulated world"},
        {"client", "sim", text, false, "which <client> of the world is the robot; the first"},
    };
    settings.insert(settings.end(), own.begin(), own.end());
    types.add(kind, {"sim", doc, make_sim, DriverSort::simulated}, std::move(settings));
  };
  add("stereo_camera", "the simulated world",
      {
          {"rig", "sim", path, true, "YAML file with lens, size, baseline and mount"},
          {"background", "sim", flag, false, "render ahead in a thread of its own; true"},
          {"read_noise", "sim", number, false, "standard deviation of the noise in darkness, levels; 1"},
          {"photon_noise", "sim", number, false, "noise variance per level of brightness; 0.01"},
      });
  add("laser_scanner", "the simulated world",
      {
          {"beams", "sim", count, false, "beams of a sweep; 181"},
          {"fov", "sim", angle, false, "angle from the first to the last beam; 180deg"},
          {"range", "sim", length, false, "largest distance; 8m"},
          {"noise", "sim", length, false, "standard deviation of a range; 1cm"},
      });
  add("camera_head", "the simulated world", {});
  add("mobile_base", "the simulated world",
      {
          {"drive", "sim", text, false, "path (the world's) or command (velocity commands); path if the world has one"},
          {"scale_error", "sim", number, false, "systematic error of the odometer's distance; 0.01"},
          {"turn_scale_error", "sim", number, false, "systematic error of the odometer's turns; 0.01"},
          {"turn_bias", "sim", turn_rate, false, "standard deviation of the yaw-rate bias at start; 0.0005rad/s"},
          {"turn_bias_walk", "sim", number, false,
           "random walk of that bias, rad/s per square root of a second; 0.0002"},
      });
  add("digital_lines", "the simulated world", {});
  add("object_sensor", "the simulated world",
      {
          {"fov", "sim", angle, false, "angle of its view; 66deg"},
          {"range", "sim", length, false, "largest distance; 5m"},
          {"noise", "sim", length, false, "standard deviation of a place along each axis; 0m"},
          {"miss", "sim", number, false, "probability that an object in view is not reported; 0"},
          {"unknown", "sim", number, false, "probability that an attribute of a reported object is not; 0"},
          {"score", "sim", number, false, "how sure of an object's type it says to be, 0..1; 1"},
          {"names", "sim", flag, false, "tells what objects are called; true"},
          {"types", "sim", text, false, "types that it knows: cup, bottle; all of the world"},
      });
  add("actor", "the simulated world",
      {
          {"spread", "sim", number, false,
           "actions take longer or shorter than their cost by this share at most, by seed; 0"},
      });
  add("interaction", "a script",
      {
          {"script", "sim", text, false, "who says what when, such as 2s goal cup_1.level=full; 30s stop"},
      });
}

}  // namespace takt
