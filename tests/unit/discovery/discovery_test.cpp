// SPDX-License-Identifier: Apache-2.0
#include "hal/discovery/discovery.hpp"

#include <doctest/doctest.h>

#include "tests/temporary_folder.hpp"

using namespace takt;

TEST_CASE("discovery: what sysfs names, in the order of the names, with a line for the graph") {
  const test::TemporaryFolder root;
  const auto file = [&](const char* name, const std::string& text) {
    std::filesystem::create_directories((root.path / name).parent_path());
    root.write(name, text + "\n");
  };
  file("sys/class/video4linux/video10/name", "vivid");
  file("sys/class/video4linux/video2/name", "Bumblebee bridge");
  file("sys/bus/firewire/devices/fw0/guid", "0x0011060000006b7a");
  file("sys/bus/firewire/devices/fw0/is_local", "1");
  file("sys/bus/firewire/devices/fw1/guid", "0x00b09d0100a1b2c3");
  file("sys/bus/firewire/devices/fw1/vendor_name", "Point Grey Research");
  file("sys/bus/firewire/devices/fw1/model_name", "Bumblebee2 BB2-08S2C");
  file("sys/bus/firewire/devices/fw1.0/units", "0x00a02d:0x000102");
  file("sys/class/net/lo/type", "772");
  file("sys/class/net/can0/type", "280");
  file("sys/class/net/can0/operstate", "up");
  std::filesystem::create_directories(root.path / "sys/class/net/can0/device");
  std::filesystem::create_directory_symlink("../../drivers/kvaser_pci", root.path / "sys/class/net/can0/device/driver");
  std::filesystem::create_directories(root.path / "sys/bus/gpio/devices/gpiochip0");
  std::filesystem::create_directories(root.path / "sys/class/tty/ttyUSB0");
  std::filesystem::create_directories(root.path / "sys/class/tty/tty1");
  for (const char* folder : {"dev/serial/by-id", "dev/v4l/by-id"})
    std::filesystem::create_directories(root.path / folder);
  std::filesystem::create_symlink("../../ttyUSB0", root.path / "dev/serial/by-id/usb-FTDI_USB-RS422_A1-if00-port0");
  std::filesystem::create_symlink("../../video10", root.path / "dev/v4l/by-id/usb-Vivid-video-index0");
  const auto found = discovery::discover(root.path);
  REQUIRE(found.size() == 6);
  CHECK(found[0].where == "/dev/video2");
  CHECK(found[0].description == "Bumblebee bridge");
  CHECK(found[0].line.find("driver: v4l2, path: /dev/video2,") != std::string::npos);
  CHECK(found[1].where == "/dev/video10");
  CHECK(found[1].line.find("path: /dev/v4l/by-id/usb-Vivid-video-index0,") != std::string::npos);
  CHECK(found[2].where == "/dev/fw1");
  CHECK(found[2].description == "FireWire, Point Grey Research Bumblebee2 BB2-08S2C");
  CHECK(found[2].line.find("driver: iidc, guid: \"00b09d0100a1b2c3\",") != std::string::npos);
  CHECK(found[3].where == "can0");
  CHECK(found[3].description == "CAN, kvaser_pci, up");
  CHECK(found[3].line.find("driver: can, interface: can0") != std::string::npos);
  CHECK(found[4].where == "/dev/gpiochip0");
  CHECK(found[5].where == "/dev/ttyUSB0");
  CHECK(found[5].line.find("port: /dev/serial/by-id/usb-FTDI_USB-RS422_A1-if00-port0}") != std::string::npos);
  CHECK(discovery::discover(root.path / "nothing").empty());
}
