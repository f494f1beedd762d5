// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <string>

#include "hal/settings/json.hpp"

namespace takt {

/// A member that is a text. Empty: there is none, or it is something else.
inline std::string text_of(const nlohmann::ordered_json& of, const char* key) {
  const auto found = of.find(key);
  return found != of.end() && found->is_string() ? found->get<std::string>() : "";
}

}  // namespace takt
