// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <filesystem>
#include <string>
#include <utility>
#include <vector>

namespace takt::machines {

/// Properties of a participant that has the keys in that folder (graph/keys/machine_keys.hpp), with the plug-ins of
/// the Cyclone DDS that is loaded. Source: OMG DDS Security 1.1, section 9.
std::vector<std::pair<std::string, std::string>> security_properties(const std::filesystem::path& keys);

}  // namespace takt::machines
