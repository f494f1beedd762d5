// SPDX-License-Identifier: Apache-2.0
// Installed as <takt/hal/simulated.hpp>: hal, experimental.
#pragma once
#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

namespace takt::hal {

/// CPU time that a simulator has used in this process so far.
struct SimulatorUse {
  int64_t cpu_ns = 0;
  int64_t in_jobs_ns = 0;  ///< of it within jobs of device nodes, which count it as theirs, too
};

/// What a run asks of the world behind its simulated devices: the truth that expectations are judged by, and the
/// simulator's share of the CPU time. A driver offers its world with Devices::offer().
class SimulatedWorld {
 public:
  virtual ~SimulatedWorld() = default;
  /// What can be asked for: robots first.
  virtual std::vector<std::string> objects() const = 0;
  /// Nothing: the object has no such attribute.
  virtual std::optional<std::string> attribute(const std::string& object, const std::string& name,
                                               int64_t at_ns) const = 0;
  /// x and y in the world, m.
  virtual std::optional<std::array<double, 2>> position(const std::string& object, int64_t at_ns) const = 0;
  virtual SimulatorUse use() const = 0;
};

}  // namespace takt::hal
