// SPDX-License-Identifier: Apache-2.0
#include "hal/drivers.hpp"

#include <algorithm>
#include <cmath>
#include <sstream>

#include "hal/actor/actor_node.hpp"
#include "hal/base/base_node.hpp"
#include "hal/base/can_base.hpp"
#include "hal/camera/stereo_camera_node.hpp"
#include "hal/camera/v4l2_camera.hpp"
#include "hal/drivers/doubled.hpp"
#include "hal/drivers/own_folder.hpp"
#include "hal/drivers/semantic_links.hpp"
#include "hal/drivers/sick_lasers.hpp"
#include "hal/gpio/gpio_lines.hpp"
#include "hal/gpio/lines_node.hpp"
#include "hal/gpio/pulse.hpp"
#include "hal/head/can_head.hpp"
#include "hal/head/head_node.hpp"
#include "hal/interaction/console.hpp"
#include "hal/interaction/interaction_node.hpp"
#include "hal/interaction/script.hpp"
#include "hal/laser/laser_node.hpp"
#include "hal/object_sensor/object_sensor_node.hpp"
#include "hal/replay/replay_base.hpp"
#include "hal/replay/replay_camera.hpp"
#include "hal/replay/replay_laser.hpp"
#include "hal/semantic_link/client_node.hpp"
#include "hal/semantic_link/service_node.hpp"
#include "hal/settings/settings.hpp"
#include "hal/sim/failing_devices.hpp"
#include "hal/sim/sim_camera.hpp"
#include "hal/sim/sim_devices.hpp"
#include "hal/sim/sim_objects.hpp"

namespace takt::hal {

Rate rate_of(Settings& settings) {
  Rate rate{15, 1};
  if (!settings.has("rate")) return rate;
  // Back to the fraction that was meant: releases are planned exactly, never with a rounded period.
  const double hz = settings.quantity("rate", Dimension::rate, 15.0);
  for (int64_t denominator = 1; denominator <= 1001; ++denominator) {
    const double numerator = hz * static_cast<double>(denominator);
    if (std::abs(numerator - std::round(numerator)) < 1e-9 * numerator) return {std::llround(numerator), denominator};
  }
  settings.fail("`rate` is no fraction with a divisor up to 1001", "write it as n or n/m");
  return rate;
}

namespace {

using NodeResult = tl::expected<std::unique_ptr<DeviceNode>, DeviceError>;

template <class List>
std::string names(const List& list) {
  std::string all;
  for (const auto& item : list) all.append(all.empty() ? "" : ", ").append(item.name);
  return all;
}

HealthThresholds thresholds_of(Settings& settings) {
  HealthThresholds t;
  t.step_px = static_cast<int>(settings.count("health_step", t.step_px, 1, 64));
  t.saturated_level = static_cast<int>(settings.count("saturated_level", t.saturated_level, 1, 256));
  t.saturated_fraction = settings.quantity("saturated_fraction", Dimension::number, t.saturated_fraction);
  t.dark_mean = settings.quantity("dark_mean", Dimension::number, t.dark_mean);
  t.blurred_gradient = settings.quantity("blurred_gradient", Dimension::number, t.blurred_gradient);
  t.unchanging_difference = settings.quantity("unchanging_difference", Dimension::number, t.unchanging_difference);
  return t;
}

DeviceHealthSettings health_of(const DeviceConfig& config, Settings& settings) {
  DeviceHealthSettings health;
  const auto time = [&](const char* name, int64_t fallback_ns) {
    const double seconds = settings.quantity(name, Dimension::time, static_cast<double>(fallback_ns) * 1e-9);
    if (settings.has(name) && !(seconds > 0 && seconds < 1e6))
      settings.fail("`" + std::string(name) + "` is not in 0s..1000000s", "give the time after which a device counts");
    return std::llround(seconds * 1e9);
  };
  health.silent_after_ns = time("silent_after", 0);
  health.recovers_after_ns = time("recovers_after", health.recovers_after_ns);
  health.judges_frozen = config.driver != "replay";  // one image may be recorded, and is given again and again
  return health;
}

/// The device as it is, or behind one that fails as the setting `failures` says.
template <class Failing, class Interface, class... More>
std::unique_ptr<Interface> with_failures(std::unique_ptr<Interface> device, Settings& settings, More&&... more) {
  auto windows = parse_failures(settings.text("failures", ""));
  if (!windows) settings.fail("`failures`: " + windows.error(), "correct `failures`");
  if (!windows || windows->empty()) return device;
  return std::make_unique<Failing>(std::move(device), FailureSchedule(std::move(*windows)),
                                   std::forward<More>(more)...);
}

/// The node of a device that is still closed.
template <class NodeClass, class Interface, class... More>
NodeResult closed(std::unique_ptr<Interface> device, const Settings& settings, More&&... more) {
  if (settings.error()) return tl::unexpected(*settings.error());
  return std::make_unique<NodeClass>(std::move(device), std::forward<More>(more)...);
}

NodeResult opened(NodeResult node) {
  if (!node) return node;
  if (const auto result = (*node)->device().open(); !result) return tl::unexpected(result.error());
  return node;
}

template <class NodeClass, class Interface, class... More>
NodeResult opened(std::unique_ptr<Interface> device, const Settings& settings, More&&... more) {
  return opened(closed<NodeClass>(std::move(device), settings, std::forward<More>(more)...));
}

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

NodeResult make_replay_camera(const DeviceConfig& config, Settings& settings, const Clock& clock) {
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

NodeResult make_replay_laser(const DeviceConfig& config, Settings& settings) {
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

NodeResult make_replay_base(const DeviceConfig& config, Settings& settings) {
  const replay::ReplayBaseSettings base{settings.path("log", true), pace_of(settings)};
  std::unique_ptr<MobileBase> device = std::make_unique<replay::ReplayBase>(config.id, base);
  return opened<BaseNode>(std::move(device), settings);
}

NodeResult make_replay(const DeviceConfig& config, Settings& settings, const Clock& clock) {
  if (config.kind == "laser_scanner") return make_replay_laser(config, settings);
  if (config.kind == "mobile_base") return make_replay_base(config, settings);
  return make_replay_camera(config, settings, clock);
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
  choose_drive(settings, world);
  std::unique_ptr<MobileBase> device = std::make_unique<sim::SimBase>(config.id, model, world, &clock);
  device = with_failures<sim::FailingBase>(std::move(device), settings);
  return opened<BaseNode>(std::move(device), settings);
}

/// "estop, 5": the parts between the commas.
std::vector<std::string> list_of(Settings& settings, const std::string& name, const std::string& fallback) {
  std::vector<std::string> parts;
  std::stringstream text(settings.text(name, fallback));
  for (std::string part; std::getline(text, part, ',');) {
    const size_t begin = part.find_first_not_of(' '), end = part.find_last_not_of(' ');
    if (begin == std::string::npos)
      settings.fail("`" + name + "` has an empty part", "write names with commas between");
    else parts.push_back(part.substr(begin, end - begin + 1));
  }
  return parts;
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

NodeResult make_script(Settings& settings, sim::Simulation& world) {
  if (settings.has("failures")) settings.fail("a script does not fail", "leave `failures` out");
  auto script = parse_task_script(settings.text("script", ""));
  if (!script) {
    settings.fail("`script`: " + script.error(), "correct `script`");
    return tl::unexpected(*settings.error());
  }
  std::unique_ptr<Interaction> device = std::make_unique<ScriptedPerson>(
      std::move(*script), [&world](int64_t epoch_ns) { return world.begin(epoch_ns); });
  return opened<InteractionNode>(std::move(device), settings);
}

NodeResult make_console(const DeviceConfig& config, Settings& settings) {
  ConsoleSettings console;
  console.input = settings.text("input", console.input);
  console.output = settings.text("output", console.output);
  std::unique_ptr<Interaction> device = std::make_unique<Console>(config.id, std::move(console));
  return closed<InteractionNode>(std::move(device), settings);
}

NodeResult make_sim(const DeviceConfig& config, Settings& settings, Devices& devices, const Clock& clock) {
  auto world = devices.world(config);
  if (!world) return tl::unexpected(world.error());
  if (config.kind == "stereo_camera") return make_sim_camera(config, settings, **world, clock);
  if (config.kind == "laser_scanner") return make_sim_laser(config, settings, **world);
  if (config.kind == "mobile_base") return make_sim_base(config, settings, **world, clock);
  if (config.kind == "interaction") return make_script(settings, **world);
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

std::string interface_of(Settings& settings) {
  const std::string interface = settings.text("interface", "");
  if (interface.empty()) settings.fail("setting `interface` is missing", "add `interface: can0` to the device");
  return interface;
}

NodeResult make_can_head(const DeviceConfig& config, Settings& settings, const Clock& clock) {
  head::CanHeadSettings head{.interface = interface_of(settings), .eyelids = settings.flag("eyelids", true)};
  std::unique_ptr<CameraHead> device = std::make_unique<head::CanHead>(config.id, std::move(head), clock);
  return closed<HeadNode>(std::move(device), settings);
}

NodeResult make_can_base(const DeviceConfig& config, Settings& settings, const Clock& clock) {
  base::CanBaseSettings base{.interface = interface_of(settings)};
  base.wheels.step_m = settings.quantity("wheel_step", Dimension::length, base.wheels.step_m);
  base.wheels.track_m = settings.quantity("track", Dimension::length, base.wheels.track_m);
  if (base.wheels.step_m <= 0 || base.wheels.track_m <= 0)
    settings.fail("`wheel_step` or `track` is not positive", "measure both: they are the base's geometry");
  std::unique_ptr<MobileBase> device = std::make_unique<base::CanBase>(config.id, std::move(base), clock);
  return closed<BaseNode>(std::move(device), settings);
}

/// A time of at most so long, both in s.
int64_t time_ns(Settings& settings, const char* name, double fallback_s, double most_s) {
  const double time_s = settings.quantity(name, Dimension::time, fallback_s);
  if (time_s < 0 || time_s > most_s)
    settings.fail("`" + std::string(name) + "` is out of range", "at most " + std::to_string(most_s) + "s");
  return static_cast<int64_t>(std::clamp(time_s, 0.0, most_s) * 1e9);
}

int64_t pulse_ns(Settings& settings, const char* name) {
  return time_ns(settings, name, 0.0001, static_cast<double>(gpio::kLongestPulse_ns) * 1e-9);
}

std::unique_ptr<gpio::LineChip> chip_or(std::unique_ptr<gpio::LineChip> seam) {
  return seam ? std::move(seam) : std::make_unique<gpio::KernelLineChip>();
}

/// None without a `trigger_line`.
std::unique_ptr<v4l2::FrameTrigger> trigger_of(Settings& settings, const Clock& clock,
                                               std::unique_ptr<gpio::LineChip> seam) {
  v4l2::FrameTriggerSettings trigger;
  trigger.line = settings.text("trigger_line", "");
  trigger.chip = settings.text("trigger_chip", "/dev/gpiochip0");
  trigger.pulse_ns = pulse_ns(settings, "trigger_pulse");
  if (trigger.line.empty() && (settings.has("trigger_chip") || settings.has("trigger_pulse")))
    settings.fail("the trigger has no line", "add `trigger_line`, or leave `trigger_chip` and `trigger_pulse` out");
  if (trigger.line.empty()) return nullptr;
  return std::make_unique<v4l2::FrameTrigger>(std::move(trigger), chip_or(std::move(seam)), clock);
}

NodeResult make_v4l2_camera(const DeviceConfig& config, Settings& settings, const Clock& clock, Seams seams) {
  v4l2::V4l2CameraSettings camera;
  camera.path = settings.path("path", true).string();
  const auto file = settings.path("rig", true);
  if (settings.error()) return tl::unexpected(*settings.error());
  auto rig = load_rig(config.id, file);
  if (!rig) return tl::unexpected(rig.error());
  camera.rig = *rig;
  const std::string format = settings.text("format", "y16"), bayer = settings.text("bayer", "none");
  if (const auto known = v4l2::frame_format(format)) camera.layout.format = *known;
  else settings.fail("`format` is `" + format + "`", "use y16, y8i, rgb3, yuyv or grey");
  if (const auto known = v4l2::mosaic(bayer)) camera.layout.mosaic = *known;
  else settings.fail("`bayer` is `" + bayer + "`", "use none, rggb, grbg, gbrg or bggr");
  const bool beside = camera.layout.side_by_side();
  camera.layout.left = static_cast<int>(settings.count("left", beside ? 0 : 1, 0, 2));
  camera.layout.right = static_cast<int>(settings.count("right", beside ? 1 : 0, 0, 2));
  camera.rate = rate_of(settings);
  camera.buffers = static_cast<uint32_t>(settings.count("buffers", camera.buffers, 2, v4l2::V4l2Camera::kMostBuffers));
  camera.exposure_s = settings.quantity("exposure", Dimension::time, camera.exposure_s);
  camera.longest_exposure_s = settings.quantity("longest_exposure", Dimension::time, camera.longest_exposure_s);
  camera.transfer_s = settings.quantity("transfer", Dimension::time, camera.transfer_s);
  camera.gain = settings.quantity("gain", Dimension::number, camera.gain);
  camera.stamp_delay_s = settings.quantity("stamp_delay", Dimension::time, camera.stamp_delay_s);
  camera.dmabuf = settings.flag("dmabuf", camera.dmabuf);
  auto trigger = trigger_of(settings, clock, std::move(seams.chip));
  auto device = std::make_unique<v4l2::V4l2Camera>(
      config.id, std::move(camera), seams.video ? std::move(seams.video) : std::make_unique<v4l2::KernelVideoDevice>(),
      clock, std::move(trigger));
  if (const auto sound = device->check_settings(); !sound) return tl::unexpected(sound.error());
  return closed<StereoCameraNode>(std::move(device), settings, thresholds_of(settings));
}

NodeResult make_gpio_lines(const DeviceConfig& config, Settings& settings, const Clock& clock, Seams seams) {
  gpio::GpioLinesSettings lines;
  lines.chip = settings.path("chip", true).string();
  lines.inputs = list_of(settings, "inputs", "0");
  lines.outputs = list_of(settings, "outputs", "");
  lines.powered = list_of(settings, "powered", "");
  lines.trigger = settings.text("trigger", "");
  lines.debounce_ns = time_ns(settings, "debounce", 0.005, 1.0);
  lines.pulse_ns = pulse_ns(settings, "pulse");
  std::unique_ptr<DigitalLines> device =
      std::make_unique<gpio::GpioLines>(config.id, std::move(lines), chip_or(std::move(seams.chip)), clock);
  return closed<LinesNode>(std::move(device), settings);
}

/// A driver of real hardware, still closed.
NodeResult make_driver(const DeviceConfig& config, Settings& settings, const Clock& clock, Seams seams) {
  if (config.driver == "lms200") return closed<LaserNode>(make_lms200(config, settings, clock), settings);
  if (config.driver == "lms400") return closed<LaserNode>(make_lms400(config, settings, clock), settings);
  if (config.kind == "stereo_camera") return make_v4l2_camera(config, settings, clock, std::move(seams));
  if (config.kind == "camera_head") return make_can_head(config, settings, clock);
  if (config.kind == "digital_lines") return make_gpio_lines(config, settings, clock, std::move(seams));
  if (config.kind == "interaction") return make_console(config, settings);
  return make_can_base(config, settings, clock);
}

NodeResult make_hardware(const DeviceConfig& config, Settings& settings, const Clock& clock, Seams seams = {}) {
  NodeResult node = make_driver(config, settings, clock, std::move(seams));
  if (!node) return node;
  (*node)->declare();
  if (!config.plugged) (*node)->leave_closed();
  if (!config.plugged || !(node = opened(std::move(node)))) return node;
  if (const std::string broken = (*node)->broken_declaration(); !broken.empty())
    return device_failure(config.id, broken,
                          "make the settings say what the device does: rate, exposure, transfer, baud");
  return node;
}

/// The driver of real hardware, and a double at the other end of its line.
NodeResult make_doubled(const DeviceConfig& config, Settings& settings, Devices& devices, const Clock& clock) {
  const auto world = devices.world(config);
  if (!world) return tl::unexpected(world.error());
  auto doubled = make_double(config, settings, **world, devices.folder(), clock);
  if (!doubled) return tl::unexpected(doubled.error());
  Settings of_driver(config.id, doubled->config.settings, config.directory);
  NodeResult node = make_hardware(doubled->config, of_driver, clock, std::move(doubled->seams));
  if (node) (*node)->live_with(std::move(doubled->thread));
  return node;
}

/// Keys that no driver of the kind knows.
DeviceResult check_keys(const DeviceConfig& config, const DeviceKind& kind) {
  if (!config.settings.is_object() && !config.settings.is_null())
    return device_error(config.id, "the settings are no map", "write key: value");
  for (const auto& item : config.settings.items()) {
    const std::string& key = item.key();
    const bool known = key == "kind" || key == "driver" ||
                       std::any_of(kind.settings.begin(), kind.settings.end(),
                                   [&](const SettingInfo& s) { return s.name == key && takes(config.driver, s); });
    if (known) continue;
    std::string all;
    for (const SettingInfo& s : kind.settings) {
      if (takes(config.driver, s)) all.append(all.empty() ? "" : ", ").append(s.name);
    }
    return device_error(config.id, "unknown setting `" + key + "`", "driver `" + config.driver + "` knows: " + all);
  }
  return {};
}

}  // namespace

Devices::Devices() : servers_(std::make_unique<SemanticServers>()) {}

Devices::~Devices() = default;

const std::filesystem::path& Devices::folder() {
  std::error_code error;
  if (!folder_) folder_ = std::make_unique<OwnFolder>(std::filesystem::temp_directory_path(error), "takt-doubles-");
  return folder_->path();
}

tl::expected<sim::Simulation*, DeviceError> Devices::world(const DeviceConfig& config) {
  Settings settings(config.id, config.settings, config.directory);
  const auto file = settings.path("world", true);
  const std::string client = settings.text("client", "");
  if (settings.error()) return tl::unexpected(*settings.error());
  const std::string key = std::filesystem::weakly_canonical(file).string() + "\n" + std::to_string(config.seed);
  auto stage = stages_.find(key);
  if (stage == stages_.end()) {
    auto loaded = sim::Stage::load(config.id, file, config.seed);
    if (!loaded) return tl::unexpected(loaded.error());
    stage = stages_.emplace(key, std::move(*loaded)).first;
  }
  const auto index = sim::Simulation::find_client(*stage->second, config.id, file, client);
  if (!index) return tl::unexpected(index.error());
  auto& robot = robots_[{key, *index}];
  if (!robot) robot = std::make_unique<sim::Simulation>(stage->second, *index);
  return robot.get();
}

sim::Simulation* Devices::first_world() { return robots_.empty() ? nullptr : robots_.begin()->second.get(); }

std::unique_ptr<DeviceNode> make_shell(std::string_view kind) {
  if (kind == "stereo_camera") return std::make_unique<StereoCameraNode>(nullptr);
  if (kind == "laser_scanner") return std::make_unique<LaserNode>(nullptr);
  if (kind == "camera_head") return std::make_unique<HeadNode>(nullptr);
  if (kind == "mobile_base") return std::make_unique<BaseNode>(nullptr);
  if (kind == "digital_lines") return std::make_unique<LinesNode>(nullptr);
  if (kind == "object_sensor") return std::make_unique<ObjectSensorNode>(nullptr);
  if (kind == "actor") return std::make_unique<ActorNode>(nullptr);
  if (kind == "semantic_service") return std::make_unique<semantic_link::ServiceNode>(nullptr, 0);
  if (kind == "semantic_link") return std::make_unique<semantic_link::ClientNode>(nullptr, 0);
  if (kind == "interaction") return std::make_unique<InteractionNode>(nullptr);
  throw std::logic_error("device kind " + std::string(kind) + " has no node in hal/drivers/drivers.cpp");
}

NodeResult make_device(const DeviceTypes& types, const DeviceConfig& config, Devices& devices, const Clock& clock) {
  const DeviceKind* const kind = types.find(config.kind);
  if (kind == nullptr)
    return device_error(config.id, "unknown device kind `" + config.kind + "`", "known kinds: " + names(types.all()));
  const auto driver = std::find_if(kind->drivers.begin(), kind->drivers.end(),
                                   [&](const DriverInfo& d) { return d.name == config.driver; });
  if (driver == kind->drivers.end())
    return device_error(config.id, config.kind + " has no driver `" + config.driver + "`",
                        "known drivers: " + names(kind->drivers));
  if (const auto keys = check_keys(config, *kind); !keys) return tl::unexpected(keys.error());
  Settings settings(config.id, config.settings, config.directory);
  const DeviceHealthSettings health = health_of(config, settings);
  NodeResult node = config.kind == "semantic_service" ? devices.semantic_servers().make_service(config, settings, clock)
                    : config.kind == "semantic_link"  ? make_semantic_link(config, settings, clock)
                    : config.driver == "sim"          ? make_sim(config, settings, devices, clock)
                    : config.driver == "replay"       ? make_replay(config, settings, clock)
                    : config.driver == "double"       ? make_doubled(config, settings, devices, clock)
                                                      : make_hardware(config, settings, clock);
  if (node) (*node)->set_health(health);
  return node;
}

SimulatorUse simulator_use() {
  const sim::SimulatorCost cost = sim::simulator_cost();
  return {cost.total_ns(), cost.in_read_ns};
}

}  // namespace takt::hal
