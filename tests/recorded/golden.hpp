// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <fstream>
#include <nlohmann/json.hpp>
#include <string>

#include "tests/recorded/recording.hpp"

namespace takt::test {

/// A file of golden vectors, for instance golden("can_head.json"). The test case fails, with the path, where it is missing.
inline nlohmann::json golden(const std::string& name) {
  std::ifstream stream(reference("golden/" + name));
  return nlohmann::json::parse(stream);
}

}  // namespace takt::test
