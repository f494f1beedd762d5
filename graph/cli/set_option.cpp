// SPDX-License-Identifier: Apache-2.0
#include "graph/cli/set_option.hpp"

#include <fmt/format.h>

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

}  // namespace takt::command
