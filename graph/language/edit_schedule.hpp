// SPDX-License-Identifier: Apache-2.0
// Changes a schedule file as its author would by hand: values are replaced where they stand, everything else - order,
// comments, blanks - stays as it is.
#pragma once
#include <cstdint>
#include <map>
#include <string>
#include <string_view>
#include <tl/expected.hpp>

#include "graph/language/graph.hpp"

namespace takt::graph {

/// `text` (of the file `name`) with these budgets and this block `measured`. A budget that is not there yet becomes the
/// first word of its entry, a missing entry the first of `nodes`; the block is replaced, or added at the end. The
/// result is read back: if anything but these values had changed, or the text cannot be edited, it is a Problem with
/// the place.
tl::expected<std::string, Problem> with_budgets(std::string_view text, const std::string& name,
                                                const std::map<std::string, int64_t>& budgets_ns,
                                                const MeasuredSpec& measured);

/// Three significant digits in ms, or whole us below 1 ms, rounded up: "12.5ms", "540us". For ns > 0.
std::string budget_text(int64_t ns);

}  // namespace takt::graph
