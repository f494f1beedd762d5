// SPDX-License-Identifier: Apache-2.0
#include <array>
#include <limits>

#include "rt/machine/child.hpp"
#include "rt/machine/measure.hpp"
#include "rt/machine/measure_support.hpp"
#include "rt/memory/process_memory.hpp"
#include "rt/msg/field_list.hpp"
#include "rt/sched/grant.hpp"
#include "rt/shm/iceoryx_preflight.hpp"
#include "rt/shm/transport.hpp"
#include "rt/shm/transport_error.hpp"
#include "rt/supervise/private_mounts.hpp"

namespace takt::machine {
namespace {

constexpr int kTransfers = 2'000, kWarmUp = 100;
constexpr int64_t kEver = std::numeric_limits<int64_t>::max();

/// Bytes without meaning.
struct Block {
  static constexpr std::string_view type_name = "block";
  Array<uint8_t> bytes;
  TAKT_FIELDS(Block, (bytes, "1"))
};

std::vector<PortPlan> ports() {
  std::vector<PortPlan> plans;
  for (const uint64_t bytes : kTransferBytes) {
    PortPlan port;
    port.node = "doctor";
    port.port = "b" + std::to_string(bytes);
    port.type = &MessageType::of<Block>();
    port.capacity.count = static_cast<uint32_t>(bytes - 64);  // behind the description, which takes one cache line
    port.history = port.held = port.readers = 1;
    plans.push_back(std::move(port));
  }
  return plans;
}

TransferCost transfer_cost(Transport& transport, size_t port) {
  const auto writer = transport.make_writer(port);
  const auto reader = transport.make_reader(port);
  std::vector<int64_t> publish, take;
  for (int i = 0; i < kWarmUp + kTransfers; ++i) {
    const int64_t begin = now_ns();
    if (writer->loan() == nullptr) break;
    writer->publish(begin, begin, begin);
    const int64_t published = now_ns();
    std::array<Candidate, 1> newest;
    if (reader->list(kEver, newest) == 0) break;
    Held held = reader->take(newest[0].sequence);
    reader->release(held);
    const int64_t taken = now_ns();
    if (i < kWarmUp) continue;
    publish.push_back(published - begin);
    take.push_back(taken - published);
  }
  TransferCost cost;
  cost.bytes = kTransferBytes[port];
  cost.publish = Spread::of(std::move(publish));
  cost.take = Spread::of(std::move(take));
  return cost;
}

struct Answer {
  bool carried = false;
  TransferCosts costs{};
};

Answer transfer_costs(Transport& transport) {
  Answer answer;
  answer.carried = true;
  apply(fixed_reservation(80));  // as a job would: not preempted by what is not real-time
  for (size_t i = 0; i < kTransferBytes.size(); ++i) answer.costs[i] = transfer_cost(transport, i);
  apply_default();
  return answer;
}

Answer over_iceoryx() {
  prepare_process_memory();
  const auto places = IceoryxPlaces::of_this_machine();
  Answer answer;
  try {
    try {
      iceoryx_preflight(places, 0);
    } catch (const TransportError&) {
      if (!enter_private_mounts().empty()) return answer;
    }
    const auto plan = ports();
    const auto transport = make_iceoryx_transport(plan);
    answer = transfer_costs(*transport);
  } catch (const TransportError&) {
    return answer;
  }
  remove_iceoryx_leftovers(places, getpid());  // this process ends without the destructors that would do it
  return answer;
}

std::optional<TransferCosts> carried(const std::optional<Answer>& answer) {
  return answer && answer->carried ? std::optional(answer->costs) : std::nullopt;
}

}  // namespace

std::optional<TransferCosts> measure_local_transfers() {
  return carried(in_child<Answer>([] {
    prepare_process_memory();
    const auto plan = ports();
    const auto transport = make_local_transport(plan);
    return transfer_costs(*transport);
  }));
}

std::optional<TransferCosts> measure_iceoryx_transfers() {
  return carried(in_child<Answer>(over_iceoryx, 20'000'000'000));
}

}  // namespace takt::machine
