// SPDX-License-Identifier: Apache-2.0
#include "hal/settings/json.hpp"

template class nlohmann::basic_json<>;
template class nlohmann::basic_json<nlohmann::ordered_map>;
