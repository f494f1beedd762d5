// SPDX-License-Identifier: Apache-2.0
#include "rt/faults/faulty_transport.hpp"

#include <cmath>

#include "rt/faults/faulty_writer.hpp"

namespace takt::faults {
namespace {

bool keeps(MessageFaultKind kind) { return kind == MessageFaultKind::freeze || kind == MessageFaultKind::reorder; }

}  // namespace

void make_room(std::span<PortPlan> ports, std::span<const MessageFault> faults, std::span<const double> rates_hz) {
  for (const MessageFault& fault : faults) {
    PortPlan& port = ports[fault.port];
    switch (fault.kind) {
      case MessageFaultKind::delay:
        port.history +=
            static_cast<uint32_t>(std::ceil(static_cast<double>(fault.by_ns) * 1e-9 * rates_hz[fault.port]));
        break;
      case MessageFaultKind::duplicate: port.history *= 2; break;
      case MessageFaultKind::reorder: ++port.history; break;
      case MessageFaultKind::exhaust: ++port.readers; break;
      default: break;
    }
  }
}

FaultyTransport::FaultyTransport(std::unique_ptr<Transport> inner, std::span<const PortPlan> ports,
                                 std::vector<MessageFault> faults, const Clock& clock,
                                 const std::atomic<int64_t>& epoch_ns, std::span<MessageFaultCount> counts,
                                 std::span<std::atomic<uint64_t>> offered)
    : inner_(std::move(inner)),
      ports_(ports.begin(), ports.end()),
      faults_(std::move(faults)),
      clock_(clock),
      epoch_ns_(epoch_ns),
      counts_(counts),
      offered_(offered) {}

FaultyTransport::~FaultyTransport() = default;

std::unique_ptr<Writer> FaultyTransport::make_writer(size_t port) {
  std::vector<FaultyWriter::Strike> strikes;
  for (size_t f = 0; f < faults_.size(); ++f) {
    if (faults_[f].port != port) continue;
    FaultyWriter::Strike strike;
    strike.fault = faults_[f];
    strike.type = ports_[port].type;
    strike.count = &counts_[f];
    if (keeps(faults_[f].kind)) strike.kept = KeptMessage(ports_[port]);
    if (faults_[f].kind == MessageFaultKind::exhaust)
      strike.hoard = Hoard(inner_->make_reader(port), ports_[port].chunks());
    strikes.push_back(std::move(strike));
  }
  auto writer = inner_->make_writer(port);
  if (strikes.empty()) return writer;
  return std::make_unique<FaultyWriter>(std::move(writer), std::move(strikes), clock_, epoch_ns_, offered_[port]);
}

}  // namespace takt::faults
