// SPDX-License-Identifier: Apache-2.0
#include <sched.h>
#include <unistd.h>

#include <array>
#include <atomic>
#include <deque>
#include <filesystem>
#include <iostream>
#include <optional>

#include "iceoryx_hoofs/log/logmanager.hpp"
#include "iceoryx_posh/iceoryx_posh_config.hpp"
#include "iceoryx_posh/internal/roudi/roudi.hpp"
#include "iceoryx_posh/popo/untyped_subscriber.hpp"
#include "iceoryx_posh/roudi/iceoryx_roudi_components.hpp"
#include "iceoryx_posh/runtime/posh_runtime_single_process.hpp"
#include "rt/abi.hpp"
#include "rt/shm/iceoryx/component.hpp"
#include "rt/shm/iceoryx/ports.hpp"
#include "rt/shm/iceoryx_layout.hpp"
#include "rt/shm/iceoryx_preflight.hpp"
#include "rt/shm/iceoryx_transport.hpp"
#include "rt/shm/transport_error.hpp"

namespace takt {
namespace {

/// What the daemon needs beside our pools (measured: 65.7 MB, and 24 B of bookkeeping per chunk).
constexpr uint64_t kManagementBytes = 70'000'000;

std::atomic<bool> in_use{false};  ///< iceoryx keeps its runtime in globals: one per process at a time
std::atomic<int> made{0};

/// Our claim on the process-wide iceoryx runtime.
class Claim {
 public:
  Claim() {
    if (in_use.exchange(true))
      throw TransportError(
          "this process has an iceoryx transport already; iceoryx allows one in a process. End the other graph first");
    iox::log::LogManager::GetLogManager().SetDefaultLogLevel(iox::log::LogLevel::kFatal,
                                                             iox::log::LogLevelOutput::kHideLogLevel);
  }
  Claim(const Claim&) = delete;
  Claim& operator=(const Claim&) = delete;
  ~Claim() { in_use = false; }
};

/// A name no live or dead runtime of this machine has: a socket of that name in /tmp would be in the way.
iox::RuntimeName_t unused_runtime_name() {
  for (;;) {
    const std::string name = iceoryx_runtime_prefix(getpid()) + std::to_string(made++);
    if (std::filesystem::exists("/tmp/" + name) || std::filesystem::exists("/tmp/" + name + ".lock")) continue;
    return {iox::cxx::TruncateToCapacity, name.c_str()};
  }
}

/// Threads started in its lifetime run at the lowest real-time priority, if we may: the daemon must keep hearing from
/// us (it gives up after 1.5 s), whatever the real-time jobs and the rest of the machine do.
class LowRealTime {
 public:
  LowRealTime() {
    policy_ = sched_getscheduler(0);
    if (policy_ != SCHED_OTHER || sched_getparam(0, &parameters_) != 0) return;
    sched_param low{};
    low.sched_priority = 1;
    changed_ = sched_setscheduler(0, SCHED_FIFO, &low) == 0;
  }
  LowRealTime(const LowRealTime&) = delete;
  LowRealTime& operator=(const LowRealTime&) = delete;
  ~LowRealTime() {
    if (changed_) sched_setscheduler(0, policy_, &parameters_);
  }

 private:
  int policy_ = 0;
  sched_param parameters_{};
  bool changed_ = false;
};

/// The daemon greets on std::cout and std::clog; stdout belongs to our reports. Used before any job runs.
class Quiet {
 public:
  Quiet() {
    for (std::ostream* stream : streams_) stream->setstate(std::ios::failbit);
  }
  Quiet(const Quiet&) = delete;
  Quiet& operator=(const Quiet&) = delete;
  ~Quiet() {
    for (std::ostream* stream : streams_) stream->clear();
  }

 private:
  std::array<std::ostream*, 2> streams_{&std::cout, &std::clog};
};

std::deque<IceoryxPort> ports_of(std::span<const PortPlan> plans, const IceoryxLayout& layout,
                                 const std::string& domain) {
  std::deque<IceoryxPort> ports;
  for (size_t i = 0; i < plans.size(); ++i) {
    const uint32_t pool = layout.pool_of_port[i];
    ports.push_back({plans[i], layout.pools[pool], layout.pools[0], pool, domain, i});
  }
  return ports;
}

iox::RouDiConfig_t configuration(const IceoryxLayout& layout, const std::string& segment) {
  iox::mepoo::MePooConfig pools;
  for (const IceoryxPool& pool : layout.pools) pools.addMemPool({pool.payload_bytes, pool.chunks});
  iox::RouDiConfig_t config;
  const iox::posix::PosixGroup::string_t group(iox::cxx::TruncateToCapacity, segment.c_str());
  config.m_sharedMemorySegments.push_back({group, group, pools});
  return config;
}

/// The daemon, in this process.
class Daemon {
 public:
  explicit Daemon(const iox::RouDiConfig_t& config)
      : components_(config),
        roudi_(components_.rouDiMemoryManager, components_.portManager,
               // It must not send SIGTERM to the processes it knows: this one is among them.
               iox::roudi::RouDi::RoudiStartupParameters{iox::roudi::MonitoringMode::ON, false}) {}

  uint32_t chunks_in_use() const {
    const auto segments = components_.rouDiMemoryManager.segmentManager();
    if (!segments.has_value()) return 0;
    const auto user = iox::posix::PosixUser::getUserOfCurrentProcess();
    const auto segment = segments.value()->getSegmentInformationWithWriteAccessForUser(user);
    if (!segment.m_memoryManager.has_value()) return 0;
    const iox::mepoo::MemoryManager& pools = segment.m_memoryManager.value();
    uint32_t chunks = 0;
    for (uint32_t i = 0; i < pools.getNumberOfMemPools(); ++i) chunks += pools.getMemPoolInfo(i).m_usedChunks;
    return chunks;
  }

 private:
  iox::roudi::IceOryxRouDiComponents components_;
  iox::roudi::RouDi roudi_;
};

/// What serving and joining a domain have in common. Derived classes fill the ports once they know the domain.
class PortsOverIceoryx : public Transport {
 public:
  explicit PortsOverIceoryx(std::span<const PortPlan> plans) : layout_(IceoryxLayout::of(plans)) {}
  std::unique_ptr<Writer> make_writer(size_t port) override { return make_iceoryx_writer(ports_.at(port)); }
  std::unique_ptr<Reader> make_reader(size_t port) override { return make_iceoryx_reader(ports_.at(port)); }
  uint64_t shared_memory_bytes() const override { return kManagementBytes + layout_.bytes(); }
  const char* name() const override { return "iceoryx"; }

 protected:
  Claim claim_;
  IceoryxLayout layout_;
  std::deque<IceoryxPort> ports_;
};

/// Brings the daemon along.
class IceoryxTransport final : public PortsOverIceoryx {
 public:
  explicit IceoryxTransport(std::span<const PortPlan> plans) : PortsOverIceoryx(plans) {
    const IceoryxPlaces places = IceoryxPlaces::of_this_machine();
    iceoryx_preflight(places, shared_memory_bytes());
    ports_ = ports_of(plans, layout_, iceoryx_domain(getpid()));
    const LowRealTime low;
    const Quiet quiet;
    daemon_ = std::make_unique<Daemon>(configuration(layout_, places.segment));
    runtime_.emplace(unused_runtime_name());
  }

  void ask_daemon() override {
    // It makes every port, and waits for whatever keeps it from watching processes and joining ports.
    const iox::popo::UntypedSubscriber asked({"takt", "daemon", "does it answer"});
  }
  uint32_t chunks_in_use() const override { return daemon_->chunks_in_use(); }

 private:
  std::unique_ptr<Daemon> daemon_;
  std::optional<iox::runtime::PoshRuntimeSingleProcess> runtime_;
};

/// iceoryx never ends the runtime of a client before the process ends, so there is nothing to tear down here.
class JoinedTransport final : public PortsOverIceoryx {
 public:
  JoinedTransport(std::span<const PortPlan> plans, const std::string& domain) : PortsOverIceoryx(plans) {
    ports_ = ports_of(plans, layout_, domain);
    const LowRealTime low;
    const Quiet quiet;
    iox::runtime::PoshRuntime::initRuntime(unused_runtime_name());
  }
};

std::unique_ptr<Transport> make(std::span<const PortPlan> ports) { return std::make_unique<IceoryxTransport>(ports); }

std::unique_ptr<Transport> join(std::span<const PortPlan> ports, const std::string& domain) {
  return std::make_unique<JoinedTransport>(ports, domain);
}

}  // namespace
}  // namespace takt

extern "C" const takt::IceoryxComponent takt_iceoryx;
const takt::IceoryxComponent takt_iceoryx{takt::kAbi, takt::make, takt::join};
