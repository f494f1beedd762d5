// SPDX-License-Identifier: Apache-2.0
#include "hal/driver_parts.hpp"

#include <algorithm>
#include <cmath>
#include <sstream>

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

std::string interface_of(Settings& settings) {
  const std::string interface = settings.text("interface", "");
  if (interface.empty()) settings.fail("setting `interface` is missing", "add `interface: can0` to the device");
  return interface;
}

int64_t time_ns(Settings& settings, const char* name, double fallback_s, double most_s) {
  const double time_s = settings.quantity(name, Dimension::time, fallback_s);
  if (time_s < 0 || time_s > most_s)
    settings.fail("`" + std::string(name) + "` is out of range", "at most " + std::to_string(most_s) + "s");
  return static_cast<int64_t>(std::clamp(time_s, 0.0, most_s) * 1e9);
}

}  // namespace takt::hal
