// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "hal/settings/json_text.hpp"

namespace takt::ros2 {

using Json = nlohmann::ordered_json;

/// How a run stands, as /diagnostics tells it: a status for each node and device. A node that missed a deadline or was
/// skipped since the last call is a warning, a device that is not there an error.
class Diagnostics {
 public:
  /// `graph`: what `describe` says.
  explicit Diagnostics(const Json& graph);
  /// CDR of a DiagnosticArray of a `state`.
  std::vector<std::byte> of(const Json& state, int64_t stamp_ns);

 private:
  std::string run_;
  std::vector<std::string> nodes_;
  std::vector<uint64_t> bad_;  ///< of each node so far: misses and skipped releases
};

}  // namespace takt::ros2
