// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <string>

namespace takt {

/// The entry of a module that lies beside libtakt_core: what only some runs need, with libraries that others need not
/// load. `Component` begins with `const char* abi`, the kAbi of the module. Throws std::runtime_error: it is not
/// installed (`fix` says how it comes there), or is of another build.
///
///   static const auto& iceoryx = load_component<IceoryxComponent>("libtakt_iceoryx.so", "takt_iceoryx", "...");
const void* find_component(const char* file, const char* entry, const std::string& fix);

template <class Component>
const Component& load_component(const char* file, const char* entry, const std::string& fix) {
  return *static_cast<const Component*>(find_component(file, entry, fix));
}

}  // namespace takt
