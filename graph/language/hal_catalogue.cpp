// SPDX-License-Identifier: Apache-2.0
#include "graph/language/catalogue.hpp"

namespace takt::graph {

DeviceCatalogue hal_catalogue() { return {}; }

}  // namespace takt::graph
