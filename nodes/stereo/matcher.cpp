// SPDX-License-Identifier: Apache-2.0
#include "nodes/stereo/matcher.hpp"

#include <stdexcept>

#include "nodes/stereo/general_matcher.hpp"
#include "nodes/stereo/semi_global_matcher.hpp"
#include "nodes/stereo/window_matcher.hpp"

namespace takt::stereo {

std::unique_ptr<Matcher> make_matcher(int width, int height, int channels, const MatcherParameters& parameters) {
  if (const auto wrong = problem(parameters, width, height, channels)) throw std::invalid_argument("stereo: " + *wrong);
  if (WindowMatcher::serves(parameters)) return std::make_unique<WindowMatcher>(width, height, channels, parameters);
  if (SemiGlobalMatcher::serves(parameters))
    return std::make_unique<SemiGlobalMatcher>(width, height, channels, parameters);
  return std::make_unique<GeneralMatcher>(width, height, channels, parameters);
}

}  // namespace takt::stereo
