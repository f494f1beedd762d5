// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <string>

namespace takt::command {

/// The value of `--set param=value`, whose text is named in errors. Throws std::invalid_argument unless it is a number
/// within low..high.
double set_number(const std::string& text, const std::string& value, double low, double high);

/// For CLI::Validator: makes seconds ("90") of a duration with its unit ("1.5min", "0s"). The error, or "".
std::string duration(std::string& text);

}  // namespace takt::command
