// SPDX-License-Identifier: Apache-2.0
#include <dds/dds.h>

#include <algorithm>
#include <array>
#include <memory>
#include <mutex>
#include <stdexcept>
#include <string>
#include <vector>

#include "bytes.h"
#include "graph/machines/dds/component.hpp"
#include "graph/machines/dds/security.hpp"
#include "graph/machines/dds/strangers.hpp"
#include "hal/dds/interface.hpp"
#include "rt/abi.hpp"

namespace takt::machines {
namespace {

using dds::made;

constexpr size_t kAtOnce = 32;
constexpr const char* kLargeDatagrams =
    "<MaxMessageSize>65500B</MaxMessageSize><FragmentSize>1344B</FragmentSize>";  ///< both ends are Cyclone
/// What is traced, Strangers reads.
constexpr const char* kTraced = "<Tracing><Category>discovery</Category><OutputFile>/dev/null</OutputFile></Tracing>";

dds_entity_t made_participant(const WireOptions& options) {
  const auto domain = static_cast<dds_domainid_t>(options.domain);
  if (options.keys.empty()) return made(dds_create_participant(domain, nullptr, nullptr), "participant");
  const std::unique_ptr<dds_qos_t, decltype(&dds_delete_qos)> qos(dds_create_qos(), dds_delete_qos);
  for (const auto& [name, value] : security_properties(options.keys))
    dds_qset_prop(qos.get(), name.c_str(), value.c_str());
  return made(
      dds_create_participant(domain, qos.get(), nullptr),
      fmt::format("participant with the keys in {}; what is wrong with them stands above", options.keys.string()));
}

class DdsWire final : public Wire {
 public:
  explicit DdsWire(const WireOptions& options)
      : strangers_(!options.keys.empty(), options.say),
        domain_(dds::domain_on(options.address, options.domain, kLargeDatagrams, kTraced)),
        participant_(made_participant(options)) {}
  ~DdsWire() override { dds_delete(domain_); }  // with all in it

  size_t sends(const Topic& topic) override {
    if (topic.promise == Promise::newest) state_topic_ = writers_.size();
    writers_.push_back(made(with_qos(topic,
                                     [&](const dds_qos_t* qos) {
                                       return dds_create_writer(participant_, topic_of(topic, qos), qos, nullptr);
                                     }),
                            "writer"));
    return writers_.size() - 1;
  }
  size_t takes(const Topic& topic) override {
    const dds_entity_t reader = made(
        with_qos(
            topic,
            [&](const dds_qos_t* qos) { return dds_create_reader(participant_, topic_of(topic, qos), qos, nullptr); }),
        "reader");
    readers_.push_back(reader);
    return readers_.size() - 1;
  }

  void send(size_t topic, std::span<const std::byte> bytes) override {
    takt_Bytes sample{};
    sample.data._buffer = const_cast<uint8_t*>(reinterpret_cast<const uint8_t*>(bytes.data()));
    sample.data._length = sample.data._maximum = static_cast<uint32_t>(bytes.size());
    if (topic == state_topic_) strangers_.look(readers_);
    dds_write(writers_[topic], &sample);  // what could not be sent is missing there, and counted
  }

  void begin(Each each) override {
    {
      const std::lock_guard lock(taking_);
      each_ = std::move(each);
    }
    dds_listener_t* const listener = dds_create_listener(this);
    dds_lset_data_available(listener,
                            [](dds_entity_t reader, void* wire) { static_cast<DdsWire*>(wire)->take_all(reader); });
    for (const dds_entity_t reader : readers_) {
      dds_set_listener(reader, listener);
      take_all(reader);  // what came before
    }
    dds_delete_listener(listener);
  }

 private:
  template <class Make>
  dds_entity_t with_qos(const Topic& topic, const Make& make) const {
    dds_qos_t* const qos = dds_create_qos();
    const bool again = topic.promise != Promise::none;
    dds_qset_reliability(qos, again ? DDS_RELIABILITY_RELIABLE : DDS_RELIABILITY_BEST_EFFORT, DDS_MSECS(10));
    dds_qset_history(qos, DDS_HISTORY_KEEP_LAST, topic.promise == Promise::newest ? 1 : kAtOnce);
    if (topic.promise == Promise::newest) dds_qset_durability(qos, DDS_DURABILITY_TRANSIENT_LOCAL);
    const dds_entity_t entity = make(qos);
    dds_delete_qos(qos);
    return entity;
  }
  dds_entity_t topic_of(const Topic& topic, const dds_qos_t* qos) const {
    return made(dds_create_topic(participant_, &takt_Bytes_desc, topic.name.c_str(), qos, nullptr), "topic");
  }

  void take_all(dds_entity_t reader) {
    const std::lock_guard lock(taking_);
    const auto topic = static_cast<size_t>(std::find(readers_.begin(), readers_.end(), reader) - readers_.begin());
    std::array<void*, kAtOnce> samples{};
    std::array<dds_sample_info_t, kAtOnce> infos;
    for (;;) {
      const dds_return_t count = dds_take(reader, samples.data(), infos.data(), kAtOnce, kAtOnce);
      if (count <= 0) return;
      for (int i = 0; i < count; ++i) {
        if (!infos[static_cast<size_t>(i)].valid_data) continue;
        const auto& data = static_cast<const takt_Bytes*>(samples[static_cast<size_t>(i)])->data;
        each_(topic, std::as_bytes(std::span(data._buffer, data._length)));
      }
      dds_return_loan(reader, samples.data(), count);
    }
  }

  Strangers strangers_;  // hears what the domain says
  const dds_entity_t domain_, participant_;
  std::vector<dds_entity_t> writers_, readers_;
  size_t state_topic_ = SIZE_MAX;  ///< what is sent every now and then
  std::mutex taking_;              ///< several threads of DDS receive
  Each each_;
};

std::unique_ptr<Wire> make(const WireOptions& options) { return std::make_unique<DdsWire>(options); }

}  // namespace

extern "C" [[gnu::visibility("default")]] const DdsComponent takt_dds{kAbi, make};

}  // namespace takt::machines
