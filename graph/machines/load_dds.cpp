// SPDX-License-Identifier: Apache-2.0
#include "graph/machines/dds/component.hpp"
#include "rt/component.hpp"

namespace takt::machines {

std::unique_ptr<Wire> make_dds_wire(const WireOptions& options) {
  static const auto& dds = load_component<DdsComponent>(
      "libtakt_dds.so", "takt_dds",
      "a graph on several machines needs cyclonedds (libddsc0debian1), and Takt built with cyclonedds-dev");
  return dds.make(options);
}

}  // namespace takt::machines
