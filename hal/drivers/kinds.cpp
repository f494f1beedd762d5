// SPDX-License-Identifier: Apache-2.0
#include <algorithm>

#include "hal/drivers.hpp"

namespace takt::hal {
namespace {

using enum SettingKind;

constexpr DriverInfo kCameraDrivers[] = {{"sim", "the simulated world"},
                                         {"replay", "recorded images"},
                                         {"v4l2", "a stereo camera behind Video4Linux"},
                                         {"double", "the driver of the hardware at a double in the simulated world"}};
constexpr DriverInfo kLaserDrivers[] = {{"sim", "the simulated world"},
                                        {"replay", "the scans of a CARMEN log"},
                                        {"lms200", "a SICK LMS 200 on a serial line"},
                                        {"lms400", "a SICK LMS 400 on a network or a serial line"},
                                        {"double", "the driver of the hardware at a double in the simulated world"}};
constexpr DriverInfo kHeadDrivers[] = {{"sim", "the simulated world"},
                                       {"can", "the camera head on a CAN bus"},
                                       {"double", "the driver of the hardware at a double in the simulated world"}};
constexpr DriverInfo kBaseDrivers[] = {{"sim", "the simulated world"},
                                       {"replay", "the odometry of a CARMEN log"},
                                       {"can", "the mobile base on a CAN bus"},
                                       {"double", "the driver of the hardware at a double in the simulated world"}};
constexpr DriverInfo kLinesDrivers[] = {{"sim", "the simulated world"},
                                        {"gpio", "lines of a GPIO chip"},
                                        {"double", "the driver of the hardware at a double in the simulated world"}};
constexpr DriverInfo kInteractionDrivers[] = {{"sim", "a script"}, {"console", "a terminal, a FIFO or a file"}};
constexpr DriverInfo kLinkDrivers[] = {{"udp", "UDP, on this machine or beyond"}, {"dbus", "a D-Bus, on this machine"}};

constexpr DriverInfo kSimulated[] = {{"sim", "the simulated world"}};

#define COMMON_SETTINGS                                                                                                \
  {"rate", "", rate, false, "releases per second of the device's node"},                                               \
      {"model", "", text, false, "name of the hardware model; of a laser's double lms200 or lms400"},                  \
      {"silent_after", "", time, false, "without good data for so long it counts as lost; 3 periods, at least 300ms"}, \
      {"recovers_after", "", time, false, "good data for so long bring a lost device back; 500ms"},                    \
      {"failures", "sim", text, false,                                                                                 \
       "when it fails: silent, unplugged, garbage or frozen, such as unplugged 2s..4s, frozen 6s..7s"},                \
      {"world", "sim", path, true, "XML file of the simulated world"}, {                                               \
    "client", "sim", text, false, "which <client> of the world is the robot; the first"                                \
  }

#define DOUBLE_SETTINGS                                                                                              \
  {"world", "double", path, true, "XML file of the simulated world that the double is in"},                          \
      {"client", "double", text, false, "which <client> of the world is the robot; the first"}, {                    \
    "failures", "double", text, false, "how the double misbehaves and when, such as wrong_crc 2s..4s, frozen 6s..7s" \
  }

#define CARMEN_SETTINGS                                                                      \
  {"log", "replay", path, true, "CARMEN log"},                                               \
      {"speed", "replay", number, false, "seconds of the log that pass in one second; 1"}, { \
    "start", "replay", time, false, "time of the log at the beginning of the run; 0s"        \
  }

constexpr SettingInfo kCamera[] = {
    COMMON_SETTINGS,
    DOUBLE_SETTINGS,
    {"rig", "sim", path, true, "YAML file with lens, size, baseline and mount"},
    {"background", "sim", flag, false, "render ahead in a thread of its own; true"},
    {"read_noise", "sim", number, false, "standard deviation of the noise in darkness, levels; 1"},
    {"photon_noise", "sim", number, false, "noise variance per level of brightness; 0.01"},
    {"rig", "replay", path, false, "ignored: the recording brings its calibration"},
    {"directory", "replay", path, false,
     "KITTI layout (image_l/, image_r/, calib.txt, times.txt), or a Middlebury pair (im2, im6 ...)"},
    {"left", "replay", path, false, "left image of a single pair"},
    {"right", "replay", path, false, "right image of a single pair"},
    {"focal", "replay", number, false, "focal length of the single pair, px"},
    {"cu", "replay", number, false, "principal point of the single pair, px; the image centre"},
    {"cv", "replay", number, false, "principal point of the single pair, px; the image centre"},
    {"baseline", "replay", length, false, "baseline of the single pair"},
    {"frames", "replay", count, false, "how often the single pair is delivered; 1"},
    {"shrink", "replay", count, false, "images are made smaller by this whole factor when they are loaded; 1"},
    {"path", "v4l2", path, true, "device file, for instance /dev/video0", true},
    {"rig", "v4l2", path, true, "YAML file with lens, size, baseline and mount"},
    {"format", "v4l2", text, false, "y16 (a Bumblebee), y8i, rgb3 (three sensors), yuyv or grey (side by side); y16"},
    {"left", "v4l2", count, false, "byte of a pixel, or half of a row, of the left eye; 1, 0 side by side"},
    {"right", "v4l2", count, false, "byte of a pixel, or half of a row, of the right eye; 0, 1 side by side"},
    {"bayer", "v4l2", text, false, "rggb, grbg, gbrg or bggr: debayered to BGR; none (stereo debayers better)"},
    {"buffers", "v4l2", count, false, "frames that wait in the kernel's driver; 4"},
    {"exposure", "v4l2", time, false, "exposure time; as the camera is set"},
    {"longest_exposure", "v4l2", time, false, "of an automatic exposure; a whole period of its rate"},
    {"transfer", "v4l2", time, false, "from the end of the exposure until the frame is here; a whole period"},
    {"gain", "v4l2", number, false, "gain in the camera's own steps; as the camera is set"},
    {"stamp_delay", "v4l2", time, false, "from the begin of the exposure to the device's stamp; 0s"},
    {"trigger_line", "v4l2", text, false,
     "output of a GPIO chip that makes it expose, one pulse a job; none: its rate"},
    {"trigger_chip", "v4l2", path, false, "the chip of that line; /dev/gpiochip0", true},
    {"trigger_pulse", "v4l2", time, false, "so long the line is high, at most 1ms; 0.1ms"},
    {"dmabuf", "v4l2", flag, false, "buffers are exported as DMABUFs for import; false"},
    {"lead", "double", time, false, "it exposes so long before the whole periods from the epoch; 25ms"},
    {"channels", "replay", count, false, "1 grey, 3 BGR; as the files"},
    {"health_step", "", count, false, "the health check looks at one pixel in n x n; 8"},
    {"saturated_level", "", count, false, "level from which a pixel is saturated; 250"},
    {"saturated_fraction", "", number, false, "share of saturated pixels that flags a frame; 0.05"},
    {"dark_mean", "", number, false, "mean level below which a frame is dark; 20"},
    {"blurred_gradient", "", number, false, "mean gradient below which a frame is blurred, levels per px; 1.5"},
    {"unchanging_difference", "", number, false, "mean difference to the frame before, below which it repeats; 0.25"},
};
constexpr SettingInfo kLaser[] = {
    COMMON_SETTINGS,
    DOUBLE_SETTINGS,
    {"mount", "", map, false, "sensor in the robot frame: {x, y, z, yaw, pitch, roll}"},
    {"beams", "sim", count, false, "beams of a sweep; 181"},
    {"fov", "sim", angle, false, "angle from the first to the last beam; 180deg"},
    {"range", "sim", length, false, "largest distance; 8m"},
    {"noise", "sim", length, false, "standard deviation of a range; 1cm"},
    CARMEN_SETTINGS,
    {"range", "replay", length, false, "larger ranges are no return; as the log says, else 80m"},
    {"port", "lms200", path, true, "serial line, for instance /dev/ttyS1", true},
    {"baud", "lms200", count, false, "9600, 19200, 38400 or 500000; 38400"},
    {"fov", "lms200", angle, false, "100deg or 180deg; 180deg"},
    {"resolution", "lms200", angle, false, "1deg, 0.5deg or 0.25deg; 0.5deg"},
    {"range", "lms200", length, false, "8m, 16m, 32m or 80m; 8m"},
    {"blinded_max", "lms200", number, false, "share of blinded beams above which a scan is refused; 0.1"},
    {"address", "lms400", text, false, "numbers and port of its network interface, for instance 192.168.0.1:2111",
     true},
    {"port", "lms400", path, false, "serial line instead of `address`", true},
    {"baud", "lms400", count, false, "of the serial line; 115200", true},
    {"scan_rate", "lms400", rate, false, "200..500 Hz; 360"},
    {"fov", "lms400", angle, false, "up to 70deg, in the middle of what it can see; 70deg"},
    {"resolution", "lms400", angle, false, "0.1deg..1deg; 0.25deg"},
    {"range", "lms400", length, false, "larger distances are no return; 3m"},
};
constexpr SettingInfo kHead[] = {
    COMMON_SETTINGS,
    DOUBLE_SETTINGS,
    {"interface", "can", text, true, "network interface, for instance can0; unix:PATH for a double", true},
    {"eyelids", "can", flag, false, "open unless `lids` closes them, closed at the stop; true"},
};
constexpr SettingInfo kBase[] = {
    COMMON_SETTINGS,
    DOUBLE_SETTINGS,
    CARMEN_SETTINGS,
    {"interface", "can", text, true, "network interface, for instance can0; unix:PATH for a double", true},
    {"wheel_step", "can", length, false, "way of a wheel per encoder count; 0.05mm"},
    {"track", "can", length, false, "distance of the two wheels; 0.5m"},
    {"drive", "sim", text, false, "path (the world's) or command (velocity commands); path if the world has one"},
    {"drive", "double", text, false, "path (the world's) or command; path if the world has one"},
    {"scale_error", "sim", number, false, "systematic error of the odometer's distance; 0.01"},
    {"turn_scale_error", "sim", number, false, "systematic error of the odometer's turns; 0.01"},
    {"turn_bias", "sim", turn_rate, false, "standard deviation of the yaw-rate bias at start; 0.0005rad/s"},
    {"turn_bias_walk", "sim", number, false, "random walk of that bias, rad/s per square root of a second; 0.0002"},
};
constexpr SettingInfo kLines[] = {
    COMMON_SETTINGS,
    DOUBLE_SETTINGS,
    {"chip", "gpio", path, true, "device file of the chip, for instance /dev/gpiochip0", true},
    {"inputs", "gpio", text, false, "names or offsets of the inputs, the emergency stop first: estop, 5; 0"},
    {"outputs", "gpio", text, false, "names or offsets of outputs, low until they are written; none"},
    {"powered", "gpio", text, false, "outputs that are high from the start to the stop, such as eyelid_power; none"},
    {"trigger", "gpio", text, false, "output with a pulse at each release; none"},
    {"debounce", "gpio", time, false, "a rise of an input counts after so long, a fall at once; 5ms"},
    {"pulse", "gpio", time, false, "how long the trigger is high, at most 1ms; 0.1ms"},
};

constexpr SettingInfo kObjectSensor[] = {
    COMMON_SETTINGS,
    {"fov", "sim", angle, false, "angle of its view; 66deg"},
    {"range", "sim", length, false, "largest distance; 5m"},
    {"noise", "sim", length, false, "standard deviation of a place along each axis; 0m"},
    {"miss", "sim", number, false, "probability that an object in view is not reported; 0"},
    {"unknown", "sim", number, false, "probability that an attribute of a reported object is not; 0"},
    {"score", "sim", number, false, "how sure of an object's type it says to be, 0..1; 1"},
    {"names", "sim", flag, false, "tells what objects are called; true"},
    {"types", "sim", text, false, "types that it knows: cup, bottle; all of the world"},
};
constexpr SettingInfo kActor[] = {
    COMMON_SETTINGS,
    {"spread", "sim", number, false,
     "actions take longer or shorter than their cost by this share at most, by seed; 0"},
};

#define LINK_SETTINGS                                                                                                \
  {"robot", "", text, true, "name of the robot, at both ends the same"},                                             \
      {"address", "udp", text, false, "numbers and port of the server; 127.0.0.1:4700"},                             \
      {"key", "udp", path, false, "file with 32 hexadecimal digits, at both ends the same; needed beyond loopback"}, \
      {"bus", "dbus", text, false, "session, system, or an address such as unix:path=/run/bus; session"}, {          \
    "service", "dbus", text, false, "name of the server on the bus; io.takt.semantic"                                \
  }

constexpr SettingInfo kService[] = {
    COMMON_SETTINGS,
    LINK_SETTINGS,
    {"watchdog", "", time, false, "without a velocity of the client for so long it is zero; 300ms"},
};
constexpr SettingInfo kLink[] = {
    COMMON_SETTINGS,
    LINK_SETTINGS,
    {"lag", "", time, false, "objects, scans and odometry that are older are not sent; 200ms"},
};
constexpr SettingInfo kInteraction[] = {
    COMMON_SETTINGS,
    {"script", "sim", text, false, "who says what when, such as 2s goal cup_1.level=full; 30s stop"},
    {"input", "console", text, false, "terminal, FIFO or file with one task a line; /dev/stdin"},
    {"output", "console", text, false, "where it prints what is said; /dev/stdout"},
};

constexpr DeviceKind kKinds[] = {
    {"stereo_camera", "gives `pair`", kCameraDrivers, kCamera},
    {"laser_scanner", "gives `scan`", kLaserDrivers, kLaser},
    {"camera_head", "gives `state`, takes `command` and `lids`", kHeadDrivers, kHead},
    {"mobile_base", "gives `odometry`, takes `velocity` and `stop`", kBaseDrivers, kBase},
    {"digital_lines", "gives `state`", kLinesDrivers, kLines},
    {"object_sensor", "gives `objects`", kSimulated, kObjectSensor},
    {"actor", "gives `outcome`, takes `command`", kSimulated, kActor},
    {"semantic_service", "a robot for a client elsewhere: takes what it sees, gives what it is to do", kLinkDrivers,
     kService},
    {"semantic_link", "a robot elsewhere: gives what it sees, takes what it is to do", kLinkDrivers, kLink},
    {"interaction", "gives `task`, takes `speech`", kInteractionDrivers, kInteraction},
};

}  // namespace

void register_devices(DeviceTypes& types) {
  for (const DeviceKind& kind : kKinds) types.add(kind);
}

const DeviceKind* DeviceTypes::find(std::string_view kind) const {
  const auto found = std::find_if(kinds_.begin(), kinds_.end(), [&](const DeviceKind& k) { return k.name == kind; });
  return found == kinds_.end() ? nullptr : &*found;
}

bool takes(std::string_view driver, const SettingInfo& setting) {
  if (setting.driver.empty() || setting.driver == driver) return true;
  return driver == "double" && setting.driver != "sim" && setting.driver != "replay" && !setting.place;
}

std::string_view to_text(SettingKind kind) {
  switch (kind) {
    case path: return "path";
    case length: return "length (m, cm, mm)";
    case angle: return "angle (deg, rad)";
    case speed: return "speed (m/s)";
    case turn_rate: return "turn rate (deg/s, rad/s)";
    case time: return "time (s, ms)";
    case rate: return "rate (Hz)";
    case count: return "count";
    case number: return "number";
    case flag: return "true or false";
    case text: return "text";
    case map: return "map";
  }
  return "";
}

}  // namespace takt::hal
