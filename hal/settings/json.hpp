// SPDX-License-Identifier: Apache-2.0
// Installed as <takt/hal/settings/json.hpp>: hal, experimental.
// JSON values. What every file would compile for itself of them is compiled once, in json.cpp: a third of the time of a
// file that reads this.
#pragma once
#include <nlohmann/json.hpp>

extern template class nlohmann::basic_json<>;
extern template class nlohmann::basic_json<nlohmann::ordered_map>;
