// SPDX-License-Identifier: Apache-2.0
#include "hal/actor/actor_node.hpp"
#include "hal/device_types.hpp"

namespace takt {

void register_actor(hal::DeviceTypes& types) {
  types.add({"actor", "gives `outcome`, takes `command`", [] { return std::make_unique<ActorNode>(nullptr); }, {}, {}});
}

}  // namespace takt
