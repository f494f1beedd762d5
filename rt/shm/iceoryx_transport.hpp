// SPDX-License-Identifier: Apache-2.0
// What iceoryx offers beyond make_iceoryx_transport(): other processes may join the graph.
#pragma once
#include <memory>
#include <span>
#include <string>

#include "rt/shm/transport.hpp"

namespace takt {

/// Name under which the ports of the transport of process `daemon_pid` are found.
std::string iceoryx_domain(int daemon_pid);

/// How the names of a process's iceoryx runtimes begin, hence of its sockets and locks.
std::string iceoryx_runtime_prefix(int pid);

/// Joins the ports of a transport that another process made with make_iceoryx_transport() from the same `ports`. Waits
/// for its daemon, 60 s at most, then iceoryx ends the process. One transport in a process at a time (TransportError).
std::unique_ptr<Transport> join_iceoryx_transport(std::span<const PortPlan> ports, const std::string& domain);

}  // namespace takt
