// SPDX-License-Identifier: Apache-2.0
#include "rt/component.hpp"
#include "rt/shm/iceoryx/component.hpp"
#include "rt/shm/iceoryx_transport.hpp"
#include "rt/shm/transport_error.hpp"

namespace takt {
namespace {

/// Loaded at the first use, and again at the next one if that failed.
const IceoryxComponent& component() {
  try {
    static const auto& loaded = load_component<IceoryxComponent>(
        "libtakt_iceoryx.so", "takt_iceoryx",
        "install libiceoryx-posh2 and the target takt_iceoryx of this build, or run with --transport local");
    return loaded;
  } catch (const std::runtime_error& problem) {
    throw TransportError(std::string("the iceoryx transport: ") + problem.what());
  }
}

}  // namespace

std::string iceoryx_runtime_prefix(int pid) { return "takt-" + std::to_string(pid) + "-"; }

std::string iceoryx_domain(int daemon_pid) { return "graph-" + std::to_string(daemon_pid); }

std::unique_ptr<Transport> make_iceoryx_transport(std::span<const PortPlan> ports) { return component().make(ports); }

std::unique_ptr<Transport> join_iceoryx_transport(std::span<const PortPlan> ports, const std::string& domain) {
  return component().join(ports, domain);
}

}  // namespace takt
