// SPDX-License-Identifier: Apache-2.0
#include "rt/shm/iceoryx_layout.hpp"

#include <algorithm>
#include <limits>
#include <numeric>
#include <stdexcept>
#include <string>

namespace takt {
namespace {

using namespace iceoryx_limit;

constexpr uint64_t kNoteBytes = 2 * alignment;  ///< MessageHeader and the sequence it stands for

uint64_t round_up(uint64_t bytes) { return (bytes + alignment - 1) / alignment * alignment; }
std::string id(const PortPlan& port) { return port.node + "." + port.port; }

IceoryxPool pool_for(uint64_t loan_bytes) {
  IceoryxPool pool;
  pool.loan_bytes = static_cast<uint32_t>(loan_bytes);
  // A payload aligned beyond 8 B may start anywhere up to `alignment` behind the chunk header.
  pool.payload_bytes = static_cast<uint32_t>(loan_bytes + alignment);
  return pool;
}

void check(std::span<const PortPlan> ports) {
  if (ports.size() > outputs)
    throw std::invalid_argument("the graph has " + std::to_string(ports.size()) + " outputs, iceoryx carries at most " +
                                std::to_string(outputs) + "; run it with the local transport");
  uint64_t readers = 0;
  for (const PortPlan& port : ports) {
    readers += port.readers;
    if (port.history == 0)
      throw std::invalid_argument("output " + id(port) + " keeps no message; its history must be 1 or more");
    if (uint64_t{port.history} + port.held >= queue)
      throw std::invalid_argument("output " + id(port) + ": history " + std::to_string(port.history) + " and " +
                                  std::to_string(port.held) + " held messages exceed the " + std::to_string(queue - 1) +
                                  " that an iceoryx subscriber may hold; lower the depth of its edges");
    if (port.chunk_bytes() > std::numeric_limits<uint32_t>::max() / 2)
      throw std::invalid_argument("output " + id(port) + ": a message of " + std::to_string(port.chunk_bytes()) +
                                  " bytes is larger than iceoryx can carry; lower its capacity");
  }
  if (readers > inputs)
    throw std::invalid_argument("the graph has " + std::to_string(readers) + " edges, iceoryx carries at most " +
                                std::to_string(inputs) + "; run it with the local transport");
}

/// Splits `sizes` (ascending) into at most `groups` runs, joining the neighbours whose union wastes least.
std::vector<std::vector<size_t>> group(const std::vector<size_t>& order, std::span<const PortPlan> ports,
                                       size_t groups) {
  std::vector<std::vector<size_t>> runs;
  for (size_t port : order) runs.push_back({port});
  const auto waste = [&](const std::vector<size_t>& lower, const std::vector<size_t>& upper) {
    uint64_t sum = 0;
    const uint64_t size = round_up(ports[upper.back()].chunk_bytes());
    for (size_t port : lower) sum += (size - round_up(ports[port].chunk_bytes())) * iceoryx_chunks(ports[port]);
    return sum;
  };
  while (runs.size() > groups) {
    size_t best = 0;
    for (size_t i = 1; i + 1 < runs.size(); ++i)
      if (waste(runs[i], runs[i + 1]) < waste(runs[best], runs[best + 1])) best = i;
    runs[best].insert(runs[best].end(), runs[best + 1].begin(), runs[best + 1].end());
    runs.erase(runs.begin() + static_cast<std::ptrdiff_t>(best) + 1);
  }
  return runs;
}

}  // namespace

uint32_t iceoryx_chunks(const PortPlan& port) { return port.chunks() + port.readers * port.history; }

uint64_t IceoryxLayout::bytes() const {
  return std::accumulate(pools.begin(), pools.end(), uint64_t{0},
                         [](uint64_t sum, const IceoryxPool& pool) { return sum + pool.bytes(); });
}

IceoryxLayout IceoryxLayout::of(std::span<const PortPlan> ports) {
  check(ports);
  IceoryxLayout layout;
  layout.pool_of_port.resize(ports.size());
  layout.pools.push_back(pool_for(kNoteBytes));
  // Notes wait in the queues of readers (each at most `history`, the same ones as the publisher's history), one is
  // being written, one evicted, and each reader may have one in its hands.
  for (const PortPlan& port : ports) layout.pools[0].chunks += port.history + port.readers + 2;
  layout.pools[0].chunks = std::max(layout.pools[0].chunks, 1u);

  std::vector<size_t> order(ports.size());
  std::iota(order.begin(), order.end(), size_t{0});
  std::stable_sort(order.begin(), order.end(),
                   [&](size_t a, size_t b) { return ports[a].chunk_bytes() < ports[b].chunk_bytes(); });
  // A pool must be larger than the one before by more than the slack, or iceoryx could take a loan for the larger one
  // from the smaller.
  uint64_t smallest = kNoteBytes + alignment;
  for (const auto& run : group(order, ports, iceoryx_limit::pools - 1)) {
    const uint64_t size = std::max(round_up(ports[run.back()].chunk_bytes()), smallest);
    IceoryxPool pool = pool_for(size);
    for (size_t port : run) {
      pool.chunks += iceoryx_chunks(ports[port]);
      layout.pool_of_port[port] = static_cast<uint32_t>(layout.pools.size());
    }
    layout.pools.push_back(pool);
    smallest = size + alignment;
  }
  return layout;
}

}  // namespace takt
