// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <string>

#include "rt/trace/blame.hpp"

namespace takt::explain {

/// A picture of one job from before its release to after its publication: what its time was spent on, and who had each
/// CPU meanwhile (where the trace knows). One SVG file.
std::string miss_svg(const trace::Evidence& evidence, const trace::JobSpan& job);

}  // namespace takt::explain
