// SPDX-License-Identifier: Apache-2.0
// Timed requests as text, for runs without a user: "5s stop object_detection; 8s start object_detection". Read before
// start; these functions allocate.
#pragma once
#include <cstdint>
#include <string>
#include <string_view>
#include <tl/expected.hpp>
#include <vector>

namespace takt::semantic {

enum class Verb : uint8_t { stop, start, pace };

struct TimedRequest {
  int64_t after_ns = 0;  ///< since the first job
  Verb verb = Verb::start;
  std::string node;
  uint8_t every = 1;  ///< of pace: every n-th release
};

/// Pieces joined by `;`, each "TIME stop NODE", "TIME start NODE" or "TIME pace NODE N": TIME in s or ms, N 1..255 (1:
/// full rate). Ascending in time, equal times in the order of the text. Empty text gives none. The error quotes the
/// piece at fault and says what is valid.
tl::expected<std::vector<TimedRequest>, std::string> parse_script(std::string_view text);

/// Node ids joined by commas or spaces; each once. Empty text gives none.
tl::expected<std::vector<std::string>, std::string> parse_node_list(std::string_view text);

}  // namespace takt::semantic
