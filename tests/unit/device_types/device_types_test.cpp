// SPDX-License-Identifier: Apache-2.0
#include <doctest/doctest.h>

#include <stdexcept>

#include "hal/devices.hpp"

using namespace takt;
using namespace takt::hal;

namespace {

NodeResult none(const DeviceConfig& config, Settings&, Devices&, const Clock&) {
  return device_error(config.id, "not made", "");
}

DeviceKind lamp() { return {"lamp", "shines", {}, {}, {{"colour", "", SettingKind::text, false, "of its light"}}}; }

void add_drivers(DeviceTypes& types) {
  types.add("lamp", {"double", "", none, DriverSort::doubled}, {{"world", "double", SettingKind::path, true, ""}});
  types.add("lamp", {"serial", "", none},
            {{"port", "serial", SettingKind::path, true, "", true}, {"baud", "serial", SettingKind::count, false, ""}});
  types.add("lamp", {"radio", "", none, DriverSort::neighbour}, {{"station", "radio", SettingKind::text, true, ""}});
  types.add("lamp", {"sim", "", none, DriverSort::simulated}, {{"noise", "sim", SettingKind::number, false, ""}});
}

std::string order(const DeviceKind& kind) {
  std::string text;
  for (const DriverInfo& driver : kind.drivers) text.append(driver.name).append(" ");
  for (const SettingInfo& setting : kind.settings) text.append(setting.name).append(" ");
  return text;
}

}  // namespace

TEST_CASE("drivers and their kind may register in any order, and are listed the same") {
  DeviceTypes before, after;
  add_drivers(before);
  CHECK(before.find("lamp") == nullptr);
  before.add(lamp());
  after.add(lamp());
  add_drivers(after);
  CHECK(order(*after.find("lamp")) ==
        "sim serial radio double rate model silent_after recovers_after colour noise port baud station world ");
  CHECK(order(*before.find("lamp")) == order(*after.find("lamp")));
}

TEST_CASE("a double takes what the hardware's driver takes, but for its place") {
  DeviceTypes types;
  add_drivers(types);
  types.add(lamp());
  const DeviceKind& kind = *types.find("lamp");
  for (const char* setting : {"rate", "colour", "baud", "world"}) CHECK(kind.takes("double", setting));
  for (const char* setting : {"port", "noise", "station", "weight"}) CHECK_FALSE(kind.takes("double", setting));
  CHECK(kind.takes("serial", "port"));
  CHECK_FALSE(kind.takes("serial", "world"));
}

TEST_CASE("a kind or driver registers once") {
  DeviceTypes types;
  types.add(lamp());
  CHECK_THROWS_AS(types.add(lamp()), std::logic_error);
  types.add("lamp", {"serial", "", none}, {});
  CHECK_THROWS_AS(types.add("lamp", {"serial", "", none}, {}), std::logic_error);
}
