// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <string>

namespace takt::command {

/// The value of `--set param=value`, whose text is named in errors. Throws std::invalid_argument unless it is a number
/// within low..high.
double set_number(const std::string& text, const std::string& value, double low, double high);

}  // namespace takt::command
