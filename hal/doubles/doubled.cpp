// SPDX-License-Identifier: Apache-2.0
#include "hal/doubles/doubled.hpp"

#include <cmath>
#include <utility>

#include "hal/base/can_base_driver.hpp"
#include "hal/camera/v4l2_driver.hpp"
#include "hal/doubles/in_world.hpp"
#include "hal/driver_parts.hpp"
#include "hal/gpio/gpio_driver.hpp"
#include "hal/head/can_head_driver.hpp"
#include "hal/interaction/make_web.hpp"
#include "hal/interaction/web_double.hpp"
#include "hal/laser/lms200/driver.hpp"
#include "hal/laser/lms200/lms200_double.hpp"
#include "hal/laser/lms400/driver.hpp"
#include "hal/laser/lms400/lms400_double.hpp"
#include "hal/sim/worlds.hpp"
#include "hal/stream/pseudo_terminal.hpp"
#include "hal/stream/tcp_listener.hpp"
#include "rt/msg/geometry.hpp"

namespace takt::hal {
namespace {

using OnStart = std::function<void(int64_t epoch_ns)>;

/// A double that is not plugged in yet.
struct Made {
  std::unique_ptr<DeviceDouble> device;
  OnStart on_start;
};

/// What the makers below have in common.
struct Order {
  Settings& settings;
  sim::Simulation& world;
  const std::filesystem::path& folder;
  const Clock& clock;
  Doubled& doubled;

  std::filesystem::path file() const { return folder / doubled.config.id; }
  template <class Value>
  void tell(const char* name, Value&& value) {
    doubled.config.settings[name] = std::forward<Value>(value);
  }
};

template <auto make>
NodeResult without_seams(const DeviceConfig& config, Settings& settings, Devices& devices, const Clock& clock, Seams) {
  return make(config, settings, devices, clock);
}

Made make_laser(Order& order) {
  Transform mount = order.settings.mount("mount");
  if (!order.settings.has("mount")) mount.z = 0.25;
  const RangeSource source = doubles::ranges_in(order.world, mount);
  const std::string model = order.settings.text("model", "");
  const int64_t now_ns = order.clock.now_ns();
  order.doubled.config.driver = model;
  if (model == "lms200") {
    order.doubled.driver = without_seams<make_lms200>;
    order.tell("port", order.file().string());
    return {std::make_unique<lms200::Lms200Double>(std::make_unique<PseudoTerminal>(order.file()), source, now_ns), {}};
  }
  if (model == "lms400") {
    order.doubled.driver = without_seams<make_lms400>;
    auto listener = std::make_unique<TcpListener>(uint16_t{0});
    const TcpListener& line = *listener;
    auto device = std::make_unique<lms400::Lms400Double>(std::move(listener), source, 0, now_ns);
    if (const auto plugged = device->plug_in(); !plugged)
      order.settings.fail(plugged.error().what, plugged.error().fix);
    order.tell("address", "127.0.0.1:" + std::to_string(line.port()));
    return {std::move(device), {}};
  }
  order.settings.fail("there is no double of the `model` `" + model + "`", "use lms200 or lms400");
  return {};
}

Made make_head(Order& order) {
  order.doubled.config.driver = "can";
  order.doubled.driver = without_seams<make_can_head>;
  const std::string interface = "unix:" + order.file().string();
  order.tell("interface", interface);
  return {std::make_unique<head::HeadDouble>(interface, order.clock, doubles::neck_in(order.world)), {}};
}

Made make_base(Order& order) {
  sim::choose_drive(order.settings, order.world);
  order.doubled.config.driver = "can";
  order.doubled.driver = without_seams<make_can_base>;
  const std::string interface = "unix:" + order.file().string();
  order.tell("interface", interface);
  return {std::make_unique<base::BaseDouble>(interface, order.clock, doubles::body_in(order.world)), {}};
}

Made make_lines(Order& order) {
  order.doubled.config.driver = "gpio";
  order.doubled.driver = [](const DeviceConfig& config, Settings& settings, Devices&, const Clock& clock, Seams seams) {
    return make_gpio_lines(config, settings, clock, std::move(seams.chip));
  };
  order.tell("chip", "the double's");
  std::vector<std::string> names;
  for (size_t i = 0; i < gpio::kMostLines; ++i) names.push_back("line" + std::to_string(i));
  if (!order.settings.has("inputs")) {
    std::string all = "0";
    for (uint32_t i = 1; i < order.world.line_count(); ++i) all += ", " + std::to_string(i);
    order.tell("inputs", all);
  }
  auto chip = std::make_unique<gpio::ChipDouble>(std::move(names), order.clock, doubles::levels_in(order.world));
  order.doubled.seams.chip = chip->chip();
  return {std::move(chip), {}};
}

Made make_camera(Order& order) {
  Settings& settings = order.settings;
  order.doubled.config.driver = "v4l2";
  order.doubled.driver = [](const DeviceConfig& config, Settings& settings, Devices&, const Clock& clock, Seams seams) {
    return make_v4l2_camera(config, settings, clock, std::move(seams.video), std::move(seams.chip));
  };
  order.tell("path", "the double's");
  const auto file = settings.path("rig", true);
  if (settings.error()) return {};
  const auto rig = load_rig(order.doubled.config.id, file);
  if (!rig) {
    settings.fail(rig.error().what, rig.error().fix);
    return {};
  }
  // Colours come as from a Bumblebee: through a mosaic, which the driver resolves.
  if (!settings.has("bayer") && rig->channels == 3) order.tell("bayer", "rggb");
  const std::string bayer = order.doubled.config.settings.value("bayer", "none");
  v4l2::FrameLayout layout;
  layout.format = v4l2::frame_format(settings.text("format", "y16")).value_or(v4l2::FrameFormat::yuyv);
  layout.mosaic = v4l2::mosaic(bayer).value_or(v4l2::Mosaic::none);
  layout.width = rig->width;
  layout.height = rig->height;
  layout.bytes_per_line = layout.row_bytes();
  layout.left = static_cast<int>(settings.count("left", layout.side_by_side() ? 0 : 1, 0, 2));
  layout.right = static_cast<int>(settings.count("right", layout.side_by_side() ? 1 : 0, 0, 2));
  if (layout.format == v4l2::FrameFormat::yuyv)
    settings.fail("there is no double of that `format`", "use y16, y8i, rgb3 or grey");
  const double lead_s = settings.quantity("lead", Dimension::time, 0.025);
  v4l2::VideoDouble::Settings camera;
  camera.width = static_cast<uint32_t>(layout.frame_width());
  camera.height = static_cast<uint32_t>(layout.height);
  camera.code = v4l2::four_characters(layout.format);
  camera.bytes_per_line = static_cast<uint32_t>(layout.bytes_per_line);
  camera.frame_bytes = static_cast<uint32_t>(layout.image_bytes());
  camera.rate = rate_of(settings);
  camera.trigger_line = settings.text("trigger_line", "");
  auto device = std::make_unique<v4l2::VideoDouble>(camera, doubles::frames_in(order.world, *rig, layout), order.clock);
  order.doubled.seams.video = device->device();
  order.doubled.seams.chip = device->wire().chip();
  auto expose = [&video = *device, lead_ns = std::llround(lead_s * 1e9)](int64_t epoch_ns) {
    video.expose_at(epoch_ns - lead_ns);
  };
  return {std::move(device), expose};
}

Made make_screen(Order& order) {
  order.doubled.config.driver = "web";
  order.doubled.driver = [](const DeviceConfig& config, Settings& settings, Devices&, const Clock& clock, Seams seams) {
    return make_web_screen(config, settings, clock, std::move(seams.fingers));
  };
  auto script = parse_task_script(order.settings.text("script", ""));
  if (!script) {
    order.settings.fail("`script`: " + script.error(), "correct `script`");
    return {};
  }
  order.doubled.seams.fingers = std::make_shared<AnswerLine>();
  auto device = std::make_unique<WebDouble>(std::move(*script), order.doubled.seams.fingers);
  auto begin = [&screen = *device](int64_t epoch_ns) { screen.begin(epoch_ns); };
  return {std::move(device), begin};
}

Made make_of_kind(Order& order) {
  const std::string& kind = order.doubled.config.kind;
  if (kind == "laser_scanner") return make_laser(order);
  if (kind == "camera_head") return make_head(order);
  if (kind == "mobile_base") return make_base(order);
  if (kind == "digital_lines") return make_lines(order);
  if (kind == "interaction") return make_screen(order);
  return make_camera(order);
}

}  // namespace

tl::expected<Doubled, DeviceError> make_double(const DeviceConfig& config, Settings& settings, sim::Simulation& world,
                                               const std::filesystem::path& folder, const Clock& clock) {
  if (clock.is_virtual())
    return device_error(config.id, "a double lives in real time only", "use --clock real, or the driver `sim`");
  Doubled doubled{config, nullptr, {}, nullptr};
  Order order{settings, world, folder, clock, doubled};
  Made made = make_of_kind(order);
  if (settings.error()) return tl::unexpected(*settings.error());
  const auto known = made.device->known();
  auto failures = parse_failures(settings.text("failures", ""), known);
  if (!failures) settings.fail("`failures`: " + failures.error(), "correct `failures`");
  if (settings.error()) return tl::unexpected(*settings.error());
  if (const auto plugged = made.device->plug_in(); !plugged) return tl::unexpected(plugged.error());
  const auto on_start = [&world, own = std::move(made.on_start)](int64_t epoch_ns) {
    world.begin(epoch_ns);
    if (own) own(epoch_ns);
  };
  doubled.thread = std::make_unique<DoubleThread>(config.id, std::move(made.device),
                                                  FailureSchedule(std::move(*failures), known), clock, on_start);
  return doubled;
}

}  // namespace takt::hal
