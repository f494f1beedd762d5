// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <string>
#include <tl/expected.hpp>

#include "rt/param.hpp"

namespace takt::graph {

/// A parameter's value as people write it ("0.3m", "true", "sad"), in the unit the parameter declares; or what is
/// wrong with it ("is 3, write it with a unit ...").
tl::expected<ParamValue, std::string> parse_param(const ParamBase& param, const std::string& text);

}  // namespace takt::graph
