// SPDX-License-Identifier: Apache-2.0
// What a clock generator is told as text: timed requests for runs without a user, "5s stop object_detection; 8s start
// object_detection", and rules by need, "body_pose when person within 4m else stop". Read before start; these functions
// allocate.
#pragma once
#include <cstdint>
#include <string>
#include <string_view>
#include <tl/expected.hpp>
#include <vector>

#include "rt/msg/requests.hpp"

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

/// A node that runs at full rate only where it is needed.
struct Rule {
  std::string type;     ///< needed while an object of that type is near; empty: while a crossing is
  double within_m = 0;  ///< so near
  Request otherwise;    ///< the node, and what it is asked for while it is not needed
};

/// Pieces joined by `;`, each "NODE when CONDITION else stop" or "NODE when CONDITION else pace N", a CONDITION being
/// "TYPE within LENGTH" or "crossing": LENGTH in m or cm, N 2..255. Empty text gives none. Errors as of a script.
tl::expected<std::vector<Rule>, std::string> parse_rules(std::string_view text);

/// Node ids joined by commas or spaces; each once. Empty text gives none.
tl::expected<std::vector<std::string>, std::string> parse_node_list(std::string_view text);

}  // namespace takt::semantic
