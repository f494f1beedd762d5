// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "rt/machine/finding.hpp"

namespace takt::cuda {

/// The row of `takt doctor`: which card there is, or what of plug-in, driver and card is missing and how to get it. A
/// machine without one lacks nothing that a run asks for. Loads the driver, if there is the plug-in: 0.2 s.
machine::Finding check_card();

}  // namespace takt::cuda
