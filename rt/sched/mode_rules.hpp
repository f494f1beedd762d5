// SPDX-License-Identifier: Apache-2.0
// Which mode a run is to be in while sources are lost. Pure functions; nothing is allocated.
#pragma once
#include <cstddef>
#include <cstdint>
#include <limits>
#include <optional>
#include <vector>

namespace takt {

/// Lost sources as bits: bit i is source i of ModeRules::sources.
using SourceSet = uint64_t;

/// "While exactly these or fewer are lost: this mode."
struct ModeRule {
  static constexpr size_t kUnreachable = std::numeric_limits<size_t>::max();
  size_t mode =
      kUnreachable;      ///< index into Plan::modes; kUnreachable: the mode of the start made too few nodes for it
  SourceSet covers = 0;  ///< the sources that the mode can do without
};

/// The rules of a run, in the order in which the graph names them.
struct ModeRules {
  static constexpr size_t kMostSources = 64;
  std::vector<size_t> sources;  ///< indexes into Plan::tasks: all that any rule names, each once
  std::vector<ModeRule> rules;
};

/// Who asked for a mode.
enum class ModeOrigin : uint32_t {
  other,  ///< the start, a person, a broken deadline
  rule,   ///< rules, because sources are lost or back
};

/// The mode that will be in force once all requests have taken effect.
struct ModeInForce {
  size_t mode = 0;
  ModeOrigin origin = ModeOrigin::other;
  size_t before = 0;  ///< the newest mode that no rule entered; `mode` itself if none did
};

/// The first rule's mode that covers all of `lost` (not empty); safe_stop if there is none.
size_t mode_without(const ModeRules& rules, SourceSet lost, size_t safe_stop);

/// The mode to change to; nothing: stay. `lost` are those lost now, `newly_lost` tells that one of them has only just
/// been. A safe stop that no rule entered is never left. A mode that no rule entered is left at a loss that it does not
/// cover, and only then; once a rule has entered a mode, rules lead through further ones and back to the one before.
std::optional<size_t> change_of_mode(const ModeRules& rules, SourceSet lost, bool newly_lost, const ModeInForce& now,
                                     size_t safe_stop);

}  // namespace takt
