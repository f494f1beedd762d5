// SPDX-License-Identifier: Apache-2.0
// iceoryx as its own users would call it: untyped publishers and subscribers, and a wait set on the trigger.
#include <unistd.h>

#include "bench/peers/medium.hpp"
#include "iceoryx_hoofs/log/logmanager.hpp"
#include "iceoryx_posh/popo/untyped_publisher.hpp"
#include "iceoryx_posh/popo/untyped_subscriber.hpp"
#include "iceoryx_posh/popo/wait_set.hpp"
#include "iceoryx_posh/runtime/posh_runtime.hpp"
#include "rt/shm/iceoryx_layout.hpp"

namespace takt::bench {
namespace {

using Name = iox::capro::IdString_t;

iox::capro::ServiceDescription service(const std::string& id, size_t node) {
  return {Name("raw"), Name(iox::cxx::TruncateToCapacity, id.c_str()),
          Name(iox::cxx::TruncateToCapacity, std::to_string(node).c_str())};
}

iox::popo::SubscriberOptions short_queue() {
  iox::popo::SubscriberOptions options;
  options.queueCapacity = 2;
  return options;
}

class IceoryxEnds final : public Ends {
 public:
  IceoryxEnds(const MediumPlan& plan, size_t node, uint32_t loan_bytes) : loan_bytes_(loan_bytes) {
    if (node != plan.shape.sink()) publisher_ = std::make_unique<iox::popo::UntypedPublisher>(service(plan.id, node));
    if (const auto producer = plan.shape.trigger(node)) {
      inputs_.push_back(subscribe(plan.id, *producer));
      waits_.attachState(*inputs_[0].subscriber, iox::popo::SubscriberState::HAS_DATA).or_else([](auto) {
        std::terminate();
      });
    }
    for (size_t producer : plan.shape.sides(node)) inputs_.push_back(subscribe(plan.id, producer));
  }
  bool wait() override {
    waits_.timedWait(iox::units::Duration::fromNanoseconds(kPatienceNs));
    return take(inputs_[0]);
  }
  size_t take_sides() override {
    size_t fresh = 0;
    for (size_t i = 1; i < inputs_.size(); ++i) fresh += take(inputs_[i]);
    return fresh;
  }
  void prepare() override {
    publisher_->loan(loan_bytes_, iceoryx_limit::alignment).and_then([this](void* chunk) { loaned_ = chunk; });
  }
  void publish() override {
    if (loaned_ != nullptr) publisher_->publish(loaned_);
    loaned_ = nullptr;
  }
  void finish() override {
    for (Input& input : inputs_) {
      if (input.held != nullptr) input.subscriber->release(input.held);
      input.held = nullptr;
    }
  }

 private:
  struct Input {
    std::unique_ptr<iox::popo::UntypedSubscriber> subscriber;
    const void* held = nullptr;
  };
  static Input subscribe(const std::string& id, size_t producer) {
    return {std::make_unique<iox::popo::UntypedSubscriber>(service(id, producer), short_queue())};
  }
  static bool take(Input& input) {
    input.subscriber->take().and_then([&](const void* chunk) { input.held = chunk; });
    return input.held != nullptr;
  }

  const uint32_t loan_bytes_;
  std::unique_ptr<iox::popo::UntypedPublisher> publisher_;
  std::vector<Input> inputs_;  ///< the trigger first
  iox::popo::WaitSet<4> waits_;
  void* loaned_ = nullptr;
};

class Iceoryx final : public Medium {
 public:
  explicit Iceoryx(const MediumPlan& plan) : plan_(plan) {}
  std::vector<PortPlan> pools() const override {
    std::vector<PortPlan> pools;
    for (size_t node = 0; node < plan_.shape.sink(); ++node)
      pools.push_back(pool_plan(plan_.id + std::to_string(node), plan_.bytes + kPoolGap,
                                static_cast<uint32_t>(plan_.shape.leaving(node).size())));
    return pools;
  }
  void served(std::span<const PortPlan> all, size_t first, const std::string&) override {
    const IceoryxLayout layout = IceoryxLayout::of(all);
    for (size_t node = 0; node < plan_.shape.sink(); ++node)
      loan_bytes_.push_back(layout.pools[layout.pool_of_port[first + node]].loan_bytes);
  }
  std::unique_ptr<Ends> open(size_t node) override {
    iox::log::LogManager::GetLogManager().SetDefaultLogLevel(iox::log::LogLevel::kFatal,
                                                             iox::log::LogLevelOutput::kHideLogLevel);
    const std::string name = plan_.id + "_" + std::to_string(getpid());
    iox::runtime::PoshRuntime::initRuntime({iox::cxx::TruncateToCapacity, name.c_str()});
    return std::make_unique<IceoryxEnds>(plan_, node, node < loan_bytes_.size() ? loan_bytes_[node] : 0);
  }

 private:
  const MediumPlan plan_;
  std::vector<uint32_t> loan_bytes_;
};

}  // namespace

std::unique_ptr<Medium> make_iceoryx(const MediumPlan& plan) { return std::make_unique<Iceoryx>(plan); }

}  // namespace takt::bench
