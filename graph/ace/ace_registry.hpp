// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "graph/language/registry.hpp"

namespace takt {

/// Every node type and device of this tree: what the stock programs know. The only room that links all of them.
Registry ace_registry();

/// How the libraries that these nodes share are used: one thread of OpenCV, the vector instructions of Highway.
void register_libraries(Registry& registry);

}  // namespace takt
