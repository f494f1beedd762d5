// SPDX-License-Identifier: Apache-2.0
#include "hal/discovery/discovery.hpp"

#include <algorithm>
#include <fstream>
#include <string_view>

namespace takt::discovery {
namespace {

namespace fs = std::filesystem;

constexpr int kCanLink = 280;  // ARPHRD_CAN

/// The names in a folder that begin so, in their order; none if there is no such folder.
std::vector<std::string> names_in(const fs::path& folder, std::string_view prefix) {
  std::vector<std::string> names;
  std::error_code ignored;
  for (const auto& entry : fs::directory_iterator(folder, ignored)) {
    std::string name = entry.path().filename().string();
    if (name.starts_with(prefix)) names.push_back(std::move(name));
  }
  // video2 before video10
  std::sort(names.begin(), names.end(), [](const std::string& a, const std::string& b) {
    return a.size() != b.size() ? a.size() < b.size() : a < b;
  });
  return names;
}

std::string line_of(const fs::path& file) {
  std::ifstream stream(file);
  std::string line;
  std::getline(stream, line);
  return line;
}

/// The link below `folder` of /dev that leads to the device file of that name and survives a replug; else the file.
std::string lasting_name(const fs::path& root, const char* folder, const std::string& name) {
  std::error_code ignored;
  for (const std::string& link : names_in(root / "dev" / folder, ""))
    if (fs::read_symlink(root / "dev" / folder / link, ignored).filename() == name)
      return std::string("/dev/") + folder + "/" + link;
  return "/dev/" + name;
}

/// The name of the kernel driver behind a device of sysfs.
std::string driver_of(const fs::path& device) {
  std::error_code error;
  const fs::path driver = fs::read_symlink(device / "driver", error);
  return error ? "virtual" : driver.filename().string();
}

void find_cameras(const fs::path& root, std::vector<Found>& all) {
  const fs::path folder = root / "sys/class/video4linux";
  for (const std::string& name : names_in(folder, "video")) {
    all.push_back({"/dev/" + name, line_of(folder / name / "name"),
                   "camera: {driver: v4l2, path: " + lasting_name(root, "v4l/by-id", name) +
                       ", rig: rigs/NAME.yaml, format: y16}"});
  }
}

/// On FireWire, which has no video4linux; the maker's stereo cameras call themselves Bumblebee.
void find_firewire(const fs::path& root, std::vector<Found>& all) {
  const fs::path folder = root / "sys/bus/firewire/devices";
  for (const std::string& name : names_in(folder, "fw")) {
    const std::string model = line_of(folder / name / "model_name"), guid = line_of(folder / name / "guid");
    if (guid.size() != 18 || line_of(folder / name / "is_local") == "1") continue;
    all.push_back({"/dev/" + name, "FireWire, " + line_of(folder / name / "vendor_name") + " " + model,
                   "camera: {driver: iidc, guid: \"" + guid.substr(2) + "\", rig: rigs/NAME.yaml, format: y16}"});
  }
}

void find_buses(const fs::path& root, std::vector<Found>& all) {
  const fs::path folder = root / "sys/class/net";
  for (const std::string& name : names_in(folder, "")) {
    if (line_of(folder / name / "type") != std::to_string(kCanLink)) continue;
    const std::string state = line_of(folder / name / "operstate");
    all.push_back({name, "CAN, " + driver_of(folder / name / "device") + ", " + state,
                   "head: {driver: can, interface: " + name + "}   # or base:"});
  }
}

void find_chips(const fs::path& root, std::vector<Found>& all) {
  const fs::path folder = root / "sys/bus/gpio/devices";
  for (const std::string& name : names_in(folder, "gpiochip")) {
    all.push_back({"/dev/" + name, "GPIO, " + driver_of(folder / name / ".."),
                   "lines: {driver: gpio, chip: /dev/" + name + ", inputs: estop}"});
  }
}

void find_serial_lines(const fs::path& root, std::vector<Found>& all) {
  const fs::path folder = root / "sys/class/tty";
  for (const char* prefix : {"ttyUSB", "ttyACM"}) {
    for (const std::string& name : names_in(folder, prefix)) {
      all.push_back({"/dev/" + name, "serial line, " + driver_of(folder / name / "device"),
                     "laser: {driver: lms200, port: " + lasting_name(root, "serial/by-id", name) + "}"});
    }
  }
}

}  // namespace

std::vector<Found> discover(const fs::path& root) {
  std::vector<Found> all;
  find_cameras(root, all);
  find_firewire(root, all);
  find_buses(root, all);
  find_chips(root, all);
  find_serial_lines(root, all);
  return all;
}

}  // namespace takt::discovery
