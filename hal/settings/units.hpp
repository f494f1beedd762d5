// SPDX-License-Identifier: Apache-2.0
// Installed as <takt/hal/settings/units.hpp>: hal, experimental.
#pragma once
#include <cstdint>
#include <optional>
#include <string_view>

namespace takt {

enum class Dimension : uint8_t { number, length, angle, time, speed, turn_rate, rate };

/// "0.24m", "24 cm", "66deg", "1.4 m/s", "15" -> SI (m, rad, s, m/s, rad/s, Hz, 1). A unit of another dimension, or no
/// unit where one is needed, gives nothing; so do infinities and NaN.
std::optional<double> parse_quantity(std::string_view text, Dimension dimension);
/// Without the blanks and tabs at both ends.
std::string_view trim(std::string_view text);
/// "m, cm, mm" for messages.
std::string_view unit_names(Dimension dimension);

}  // namespace takt
