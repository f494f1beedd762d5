// SPDX-License-Identifier: Apache-2.0
#include "hal/settings/settings.hpp"

#include <cmath>

namespace takt {

void Settings::fail(std::string what, std::string fix) {
  if (!error_) error_ = DeviceError{id_, std::move(what), std::move(fix)};
}

double Settings::quantity(const std::string& name, Dimension dimension, double fallback) {
  if (!has(name)) return fallback;
  const nlohmann::json& value = values_[name];
  if (value.is_number()) {
    const double number = value.get<double>();
    if (std::isfinite(number)) return number;
  } else if (value.is_string()) {
    if (const auto parsed = parse_quantity(value.get_ref<const std::string&>(), dimension)) return *parsed;
  }
  fail("setting `" + name + "` is " + value.dump() + ", which is no value in " + std::string(unit_names(dimension)),
       "give a number and its unit (" + std::string(unit_names(dimension)) + ")");
  return fallback;
}

double Settings::quantity(const std::string& name, Dimension dimension) {
  if (!has(name)) fail("setting `" + name + "` is missing", "add `" + name + "` to the device");
  return quantity(name, dimension, 0.0);
}

int64_t Settings::count(const std::string& name, int64_t fallback, int64_t low, int64_t high) {
  if (!has(name)) return fallback;
  const nlohmann::json& value = values_[name];
  const auto number = value.is_string()   ? parse_quantity(value.get_ref<const std::string&>(), Dimension::number)
                      : value.is_number() ? std::optional<double>(value.get<double>())
                                          : std::nullopt;
  if (number && *number == std::floor(*number) && *number >= static_cast<double>(low) &&
      *number <= static_cast<double>(high)) {
    return static_cast<int64_t>(*number);
  }
  fail("setting `" + name + "` is " + value.dump() + ", must be an integer in " + std::to_string(low) + ".." +
           std::to_string(high),
       "correct `" + name + "`");
  return fallback;
}

bool Settings::flag(const std::string& name, bool fallback) {
  if (!has(name)) return fallback;
  const nlohmann::json& value = values_[name];
  if (value.is_boolean()) return value.get<bool>();
  if (value == "true") return true;
  if (value == "false") return false;
  fail("setting `" + name + "` is " + value.dump() + ", must be true or false", "correct `" + name + "`");
  return fallback;
}

std::string Settings::text(const std::string& name, const std::string& fallback) {
  if (!has(name)) return fallback;
  if (values_[name].is_string()) return values_[name].get<std::string>();
  fail("setting `" + name + "` is " + values_[name].dump() + ", must be a text", "put it in quotes");
  return fallback;
}

std::filesystem::path Settings::path(const std::string& name, bool required) {
  const std::string value = text(name, "");
  if (value.empty()) {
    if (required) fail("setting `" + name + "` is missing", "add `" + name + ": PATH` to the device");
    return {};
  }
  const std::filesystem::path given(value);
  return given.is_absolute() ? given : directory_ / given;
}

Transform Settings::mount(const std::string& name) {
  Transform transform;
  if (!has(name)) return transform;
  Settings inner(id_, values_[name], directory_);
  transform.x = inner.quantity("x", Dimension::length, 0);
  transform.y = inner.quantity("y", Dimension::length, 0);
  transform.z = inner.quantity("z", Dimension::length, 0);
  // R = Rz(yaw) Rx(pitch) Ry(roll), R-0.2.
  const double yaw = inner.quantity("yaw", Dimension::angle, 0) / 2,
               pitch = inner.quantity("pitch", Dimension::angle, 0) / 2,
               roll = inner.quantity("roll", Dimension::angle, 0) / 2;
  const double cz = std::cos(yaw), sz = std::sin(yaw), cx = std::cos(pitch), sx = std::sin(pitch), cy = std::cos(roll),
               sy = std::sin(roll);
  transform.qw = cz * cx * cy - sz * sx * sy;
  transform.qx = cz * sx * cy - sz * cx * sy;
  transform.qy = cz * cx * sy + sz * sx * cy;
  transform.qz = sz * cx * cy + cz * sx * sy;
  if (inner.error()) fail("in `" + name + "`: " + inner.error()->what, inner.error()->fix);
  return transform;
}

}  // namespace takt
