// SPDX-License-Identifier: Apache-2.0
// The fast matchers against the slow reference, on every SIMD target.
#pragma once
#include <string_view>

#include "nodes/stereo/reference.hpp"
#include "tests/on_each_target.hpp"
#include "tests/property/stereo/random_pairs.hpp"

namespace takt::test {

/// The reference once, then the matcher that make_matcher() chooses on each target.
inline void expect_equal_on_each_target(const Picture& left, const Picture& right, const MatcherParameters& p) {
  Output expected(left);
  if (p.selection == Selection::semi_global) reference::semi_global(left.view(), right.view(), p, expected.views(left));
  else reference::match(left.view(), right.view(), p, expected.views(left));
  on_each_target([&] {
    const auto matcher = make_matcher(left.width, left.height, left.channels, p);
    REQUIRE(std::string_view(matcher->target()) != "scalar");  // not the general one
    expect_equal(*matcher, left, right, p, expected);
  });
}

inline MatcherParameters quality_of(int disparities) {
  MatcherParameters p = MatcherParameters::quality();
  p.disparities = disparities;
  return p;
}

}  // namespace takt::test
