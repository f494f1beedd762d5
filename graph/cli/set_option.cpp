// SPDX-License-Identifier: Apache-2.0
#include "graph/cli/set_option.hpp"

#include <fmt/format.h>

#include <map>
#include <stdexcept>

namespace takt::command {

double set_number(const std::string& text, const std::string& value, double low, double high) {
  size_t used = 0;
  double v = low - 1;
  try {
    v = std::stod(value, &used);
  } catch (const std::exception&) {
  }
  if (used != value.size() || !(v >= low && v <= high))
    throw std::invalid_argument(fmt::format("--set {}: must be a number in {}..{}", text, low, high));
  return v;
}

std::string duration(std::string& text) {
  static const std::map<std::string, double> units{{"ms", 1e-3}, {"s", 1}, {"min", 60}, {"h", 3600}};
  size_t used = 0;
  double value = 0;
  try {
    value = std::stod(text, &used);
  } catch (const std::exception&) {
    return "is no duration; write for instance 20s";
  }
  const auto unit = units.find(text.substr(used));
  if (unit == units.end() || value < 0) return "is no duration; write a number with ms, s, min or h, for instance 20s";
  text = std::to_string(value * unit->second);
  return "";
}

}  // namespace takt::command
