// SPDX-License-Identifier: Apache-2.0
// Devices: what the graph's entry, the profile and --set say together, checked against the driver's settings.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "graph/language/loader.hpp"
#include "graph/language/quantity.hpp"

namespace takt::graph {
namespace {

using nlohmann::json;

const DeviceSetting* find_setting(const std::vector<DeviceSetting>& settings, std::string_view name) {
  const auto it = std::find_if(settings.begin(), settings.end(), [&](const auto& s) { return s.name == name; });
  return it == settings.end() ? nullptr : &*it;
}

const DeviceSetting* find_setting(const DeviceKindEntry& kind, const DeviceDriver& driver, std::string_view name) {
  const DeviceSetting* common = find_setting(kind.settings, name);
  return common != nullptr ? common : find_setting(driver.settings, name);
}

bool any_driver_takes(const DeviceKindEntry& kind, std::string_view name) {
  return std::any_of(kind.drivers.begin(), kind.drivers.end(),
                     [&](const DeviceDriver& driver) { return find_setting(kind, driver, name) != nullptr; });
}

std::vector<std::string> setting_names(const DeviceKindEntry& kind, const DeviceDriver& driver) {
  std::vector<std::string> names{"driver", "rate"};
  for (const auto& setting : kind.settings) names.push_back(setting.name);
  for (const auto& setting : driver.settings) names.push_back(setting.name);
  return names;
}

/// The value in the setting's unit (a path absolute), or what is wrong.
tl::expected<json, std::string> convert(const DeviceSetting& setting, const Given& given) {
  using Kind = DeviceSetting::Kind;
  const auto is_not = [&](const char* wanted) {
    return tl::make_unexpected(fmt::format("is `{}`, {} is wanted", given.raw, wanted));
  };
  if (setting.kind == Kind::flag)
    return given.value.is_boolean() ? tl::expected<json, std::string>(given.value) : is_not("true or false");
  if (setting.kind == Kind::number || setting.kind == Kind::integer) {
    if (given.value.is_boolean()) return is_not("a number");
    const auto number = parse_in_unit(given.raw, setting.unit);
    if (!number) return tl::make_unexpected(number.error());
    if (setting.kind == Kind::integer && (*number != std::round(*number) || std::abs(*number) > 9e15))
      return is_not("an integer");
    if ((setting.low && *number < *setting.low) || (setting.high && *number > *setting.high))
      return tl::make_unexpected(fmt::format("is {}, must lie in {}..{} {}", given.raw,
                                             setting.low ? fmt::format("{}", *setting.low) : "",
                                             setting.high ? fmt::format("{}", *setting.high) : "", setting.unit));
    return setting.kind == Kind::integer ? json(static_cast<int64_t>(*number)) : json(*number);
  }
  if (!given.value.is_string()) return is_not("a text (put it in quotes)");
  const auto text = given.value.get<std::string>();
  if (setting.kind == Kind::choice &&
      std::find(setting.words.begin(), setting.words.end(), text) == setting.words.end())
    return tl::make_unexpected("is " + ticked(text) + alternatives(text, setting.words));
  if (setting.kind != Kind::path) return json(text);
  if (text.empty()) return is_not("a path");
  std::error_code ignored;
  const auto base = given.position.file == "--set"
                        ? std::filesystem::current_path(ignored)
                        : std::filesystem::absolute(given.position.file, ignored).parent_path();
  return json((base / text).lexically_normal().string());
}

}  // namespace

std::string Loader::choose_profile() {
  const json profiles = graph_.root.value("profiles", json::object());
  const json default_profile = graph_.root.value("default_profile", json());
  std::vector<std::string> names;
  if (profiles.is_object())
    for (const auto& item : profiles.items()) names.push_back(item.key());
  const bool asked = !options_.profile.empty(), named = default_profile.is_string();
  const std::string chosen = asked ? options_.profile : named ? default_profile.get<std::string>() : "sim";
  if (std::find(names.begin(), names.end(), chosen) != names.end()) return chosen;
  // Every device then names its driver itself; a record names the default.
  if (!named && names.empty() && chosen == "sim") return chosen;
  const Position at = asked ? Position{"--profile", 0, 0} : graph_.value_at(named ? "/default_profile" : "/profiles");
  const std::string hint = asked || named ? "" : "; name one with `default_profile` or --profile";
  problem(at, fmt::format("graph {} has no profile {}{}{}", ticked(spec_.name), ticked(chosen),
                          alternatives(chosen, names, "profiles"), hint));
  return "";
}

void Loader::check_profile_ids() {
  std::vector<std::string> valid{"default", "set"};
  for (const auto& device : spec_.devices) valid.push_back(device.id);
  const json profiles = graph_.root.value("profiles", json::object());
  if (!profiles.is_object()) return;
  for (const auto& [name, entries] : profiles.items()) {
    if (!entries.is_object()) continue;
    for (const auto& [id, settings] : entries.items())
      if (std::find(valid.begin(), valid.end(), id) == valid.end())
        problem(graph_.key_at(child(child("/profiles", name), id)),
                fmt::format("profile {} names {}, which is no device{}", ticked(name), ticked(id),
                            alternatives(id, valid, "devices")));
  }
}

void Loader::read_devices() {
  if (spec_.profile.empty()) return;
  const std::string defaults = child(child("/profiles", spec_.profile), "default");
  std::set<std::string> unclaimed;  // settings of `default` that no device takes
  bool all_known = true;
  for (auto& device : spec_.devices) {
    read_device(device, unclaimed);
    all_known = all_known && catalogue_.kinds.contains(device.kind) && !device.driver.empty();
  }
  if (!all_known) return;
  for (const auto& name : unclaimed) {
    std::vector<std::string> names{"driver", "rate"};
    for (const auto& device : spec_.devices)
      for (const auto& driver : catalogue_.kinds.at(device.kind).drivers)
        if (driver.name == device.driver)
          for (auto& known : setting_names(catalogue_.kinds.at(device.kind), driver)) names.push_back(std::move(known));
    const size_t dot = name.find('.');
    std::string pointer = child(defaults, name.substr(0, dot));
    if (dot != std::string::npos) pointer = child(pointer, name.substr(dot + 1));
    problem(graph_.key_at(pointer), fmt::format("no device of profile {} takes the setting {}{}", ticked(spec_.profile),
                                                ticked(name), alternatives(name, names)));
  }
}

std::map<std::string, Given> Loader::merge_settings(const DeviceSpec& device) {
  std::map<std::string, Given> merged;
  const auto take = [&](const std::string& pointer, bool from_device, bool from_default) {
    const json::json_pointer where(pointer);
    if (!graph_.root.contains(where) || !graph_.root.at(where).is_object()) return;
    const auto put = [&](const std::string& name, const std::string& at, const json& value) {
      Given one = given(at, value);
      one.from_device = from_device;
      one.from_default = from_default;
      if (value.is_null() || value.is_array()) {
        if (!graph_.broken.contains(at))
          problem(one.position,
                  fmt::format("setting {} of device {} is {}; wanted: a number, a text, a truth value or a "
                              "map of them",
                              ticked(name), ticked(device.id), value.is_null() ? "empty" : "a list"));
        return;
      }
      merged[name] = std::move(one);
    };
    for (const auto& [name, value] : graph_.root.at(where).items()) {
      if (from_device && (name == "kind" || name == "in")) continue;
      const std::string at = child(pointer, name);
      if (!value.is_object()) {
        put(name, at, value);
        continue;
      }
      for (const auto& [inner, inner_value] : value.items()) {
        if (inner_value.is_object())
          problem(graph_.value_at(child(at, inner)), fmt::format("setting {} of device {} is nested too deep",
                                                                 ticked(name + "." + inner), ticked(device.id)));
        else put(name + "." + inner, child(at, inner), inner_value);
      }
    }
  };
  const std::string profile = child("/profiles", spec_.profile);
  take(child("/devices", device.id), true, false);
  take(child(profile, "default"), false, true);
  take(child(profile, device.id), false, false);
  for (const auto& setting : set_)
    if (setting.id == device.id) merged[setting.name] = setting.given;
  return merged;
}

const DeviceDriver* Loader::choose_driver(const DeviceSpec& device, const DeviceKindEntry& kind,
                                          const std::map<std::string, Given>& settings) {
  std::vector<std::string> drivers;
  for (const auto& driver : kind.drivers) drivers.push_back(driver.name);
  const auto named = settings.find("driver");
  if (named == settings.end()) {
    problem(device.position,
            fmt::format("device {} has no driver in profile {}; name one (driver: WORD){}", ticked(device.id),
                        ticked(spec_.profile), alternatives("", drivers, "drivers of " + ticked(device.kind))));
    return nullptr;
  }
  const std::string word = named->second.value.is_string() ? named->second.value.get<std::string>() : named->second.raw;
  for (const auto& driver : kind.drivers)
    if (driver.name == word) return &driver;
  problem(named->second.position, fmt::format("device {} has the unknown driver {}{}", ticked(device.id), ticked(word),
                                              alternatives(word, drivers, "drivers of " + ticked(device.kind))));
  return nullptr;
}

void Loader::read_device(DeviceSpec& device, std::set<std::string>& unclaimed) {
  const auto kind = catalogue_.kinds.find(device.kind);
  if (kind == catalogue_.kinds.end()) {
    if (device.kind.empty()) return;  // the schema has reported it
    std::vector<std::string> kinds;
    for (const auto& [name, entry] : catalogue_.kinds) kinds.push_back(name);
    return problem(graph_.value_at(child(child("/devices", device.id), "kind")),
                   fmt::format("device {} has the unknown kind {}{}", ticked(device.id), ticked(device.kind),
                               alternatives(device.kind, kinds, "kinds")));
  }
  const auto settings = merge_settings(device);
  const DeviceDriver* driver = choose_driver(device, kind->second, settings);
  if (driver == nullptr) return;
  const bool first = device.id == spec_.devices.front().id;
  device.driver = driver->name;
  std::set<std::string> taken;
  for (const auto& [name, given] : settings) {
    if (name == "driver") continue;
    if (name == "rate") {
      const auto rate = parse_rate(given.raw);
      if (rate) device.rate = *rate, device.settings["rate"] = rate->hz();
      else problem(given.position, fmt::format("`rate` of device {} {}", ticked(device.id), rate.error()));
      continue;
    }
    if (const DeviceSetting* setting = find_setting(kind->second, *driver, name)) {
      fill_setting(device, *setting, given);
      taken.insert(name);
    } else if (!given.from_default && !(given.from_device && any_driver_takes(kind->second, name))) {
      problem(given.key, fmt::format("device {} (kind {}, driver {}) has no setting {}{}", ticked(device.id),
                                     ticked(device.kind), ticked(device.driver), ticked(name),
                                     alternatives(name, setting_names(kind->second, *driver))));
    }
  }
  // A default counts as unknown only if no device takes it.
  std::set<std::string> left;
  for (const auto& [name, given] : settings)
    if (given.from_default && name != "driver" && name != "rate" && !taken.contains(name)) left.insert(name);
  if (first) {
    unclaimed = left;
  } else {
    std::erase_if(unclaimed, [&](const std::string& name) { return !left.contains(name); });
  }
  for (const auto* list : {&kind->second.settings, &driver->settings})
    for (const auto& setting : *list)
      if (setting.required && !settings.contains(setting.name))
        problem(device.position,
                fmt::format("device {} lacks the setting {} that driver {} needs: {}", ticked(device.id),
                            ticked(setting.name), ticked(driver->name), setting.doc));
}

void Loader::fill_setting(DeviceSpec& device, const DeviceSetting& setting, const Given& given) {
  const auto value = convert(setting, given);
  if (!value)
    return problem(given.position,
                   fmt::format("setting {} of device {} {}", ticked(setting.name), ticked(device.id), value.error()));
  const size_t dot = setting.name.find('.');
  if (dot == std::string::npos) device.settings[setting.name] = *value;
  else device.settings[setting.name.substr(0, dot)][setting.name.substr(dot + 1)] = *value;
}

}  // namespace takt::graph
