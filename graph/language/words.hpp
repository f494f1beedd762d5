// SPDX-License-Identifier: Apache-2.0
// Helpers of error messages: lists of alternatives and the nearest of them.
#pragma once
#include <string>
#include <string_view>
#include <vector>

namespace takt::graph {

/// Edits (insert, delete, replace, swap of neighbours) that turn `a` into `b`; upper and lower case count as equal.
size_t edit_distance(std::string_view a, std::string_view b);

/// The candidate nearest to `word` if it is near enough to be a slip of the pen, else "".
std::string nearest(std::string_view word, const std::vector<std::string>& candidates);

/// "; did you mean `disparity`? Valid are: disparity, pair" (the question only where one is near; "; there is none" if
/// nothing is valid). `what` names the alternatives ("Valid are", "Outputs of `stereo`").
std::string alternatives(std::string_view word, std::vector<std::string> candidates,
                         std::string_view what = "valid are");

std::string join_words(const std::vector<std::string>& words, std::string_view separator = ", ");

/// "`word`"
std::string ticked(std::string_view word);

}  // namespace takt::graph
