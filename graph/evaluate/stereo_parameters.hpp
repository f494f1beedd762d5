// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <string>
#include <vector>

#include "nodes/stereo/parameters.hpp"

namespace takt::command {

/// Applies "param=value" by the names of the stereo node. Throws std::invalid_argument naming the text at fault and
/// what would be valid.
void set_stereo_parameters(const std::vector<std::string>& texts, stereo::MatcherParameters& p);

/// Every way of matching that the thesis names, and those added here, with the settings they are compared at.
struct StereoVariant {
  const char* name;
  stereo::MatcherParameters parameters;
};
std::vector<StereoVariant> stereo_variants(int disparities);

}  // namespace takt::command
