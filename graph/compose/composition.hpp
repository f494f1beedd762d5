// SPDX-License-Identifier: Apache-2.0
// From the checked graph to something that can run: devices and nodes made and set up, ports sized, the plan filled in.
#pragma once
#include <functional>
#include <memory>
#include <vector>

#include "graph/language/graph.hpp"
#include "graph/language/registry.hpp"
#include "hal/remote/remote_node.hpp"
#include "rt/node.hpp"
#include "rt/sched/plan.hpp"
#include "rt/sched/plan_ports.hpp"

namespace takt::graph {

/// Why a graph could not be composed. `device_failed` tells a broken device (exit 3) from bad input (exit 2).
struct ComposeError {
  std::vector<Problem> problems;
  bool device_failed = false;
};

/// Makes the hardware node of a device entry.
using DeviceFactory = std::function<tl::expected<std::unique_ptr<Node>, ComposeError>(const DeviceSpec&)>;

/// What a device that stands for a node or device of another machine has.
std::vector<RemoteNode::Port> remote_ports(const Registry& registry, const RemoteSpec& remote);
StampLaw remote_law(const RemoteSpec& remote);

/// Where the processes of a run tell each other what only the owner of a node knows, so that all have one plan: how
/// large its outputs can become, and when a hardware node's data come about.
class FactExchange {
 public:
  virtual ~FactExchange() = default;
  /// Nothing: the node could not be set up.
  virtual void tell(size_t port, const std::optional<Capacity>& capacity) = 0;
  /// Before that, if there is a capacity: what it comes to, for processes that know the type by its description only.
  virtual void tell_counts(size_t port, const ArrayCounts& counts) {
    static_cast<void>(port), static_cast<void>(counts);
  }
  /// After wait_for().
  virtual ArrayCounts counts(size_t port) { return static_cast<void>(port), ArrayCounts{}; }
  /// Waits for the process that owns the port. Throws std::runtime_error if that will never tell.
  virtual std::optional<Capacity> wait_for(size_t port) = 0;
  virtual void tell_source(size_t task, const SourcePlan& source) = 0;
  /// Waits as well.
  virtual SourcePlan wait_for_source(size_t task) = 0;
};

struct ComposeOptions {
  std::filesystem::path output;  ///< where nodes may write files at the end
  uint64_t seed = 1;
  std::function<bool(const std::string& id)> owns = {};  ///< nodes and devices this process sets up; empty: all
  FactExchange* exchange = nullptr;                      ///< needed where not all are owned
  Observers observers = {};
  bool quiet = false;  ///< a spare: what was left out of files is not told once more
};

/// Nodes in the order of the plan's tasks; the plan points into them.
struct Composition {
  std::vector<std::unique_ptr<Node>> nodes;
  Plan plan;
  /// What devices of this process left out of the files that they read (ReadsFiles), each with the device's id before
  /// it.
  std::vector<std::string> left_out;
};

/// Every process of a run composes the same plan; what it does not own stays an empty shell with ports.
tl::expected<Composition, ComposeError> compose(const GraphSpec& graph, const Registry& registry,
                                                const DeviceFactory& make_device, const Clock& clock,
                                                const ComposeOptions& options);

/// The node of a task once more, set up as compose() had done it: what a process that was started again has. `options`
/// as compose() was given; the plan's node is read, and stays as it is. Throws SetupError.
std::unique_ptr<Node> make_again(const GraphSpec& graph, const Registry& registry, const Clock& clock,
                                 const ComposeOptions& options, const Plan& plan, size_t task);

/// The plan as far as it is known before any node is set up: tasks, edges, ports without capacities.
Composition outline(const GraphSpec& graph, const Registry& registry, const Clock& clock);

/// Adds to an outline what the owners of its nodes tell: capacities, hence pools, and what is known of sources.
void complete(Plan& plan, FactExchange& exchange, const Observers& observers);

}  // namespace takt::graph
