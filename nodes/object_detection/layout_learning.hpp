// SPDX-License-Identifier: Apache-2.0
// What tells an object's views from its surroundings.
#pragma once
#include <span>
#include <vector>

#include "nodes/object_detection/database.hpp"
#include "nodes/object_detection/layout_stage.hpp"

namespace takt::object_detection {

/// Templates of all views by linear discriminant analysis: weights S^-1 (mean of the view - mean of the surroundings).
/// Surroundings are the photographs, under three lights, and generated ones. A view's mean is that of 40 small scenes
/// with it on pieces of these: at 0.8 to 1.3 times its size, light 0.5 to 1.5, noise, a little off. S is the covariance
/// of the surroundings plus that of the scenes about the means of their objects. Equal arguments give equal templates.
/// Throws std::invalid_argument if a photograph is smaller than twice a view.
std::vector<LayoutObject> learn_layout(std::span<const DatabaseObject> database,
                                       std::span<const Photograph> photographs, double threshold_scale = 1);

}  // namespace takt::object_detection
