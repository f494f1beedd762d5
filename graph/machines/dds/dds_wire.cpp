// SPDX-License-Identifier: Apache-2.0
#include <dds/dds.h>

#include <array>
#include <stdexcept>
#include <string>
#include <vector>

#include "bytes.h"
#include "graph/machines/dds/component.hpp"
#include "hal/dds/interface.hpp"
#include "rt/abi.hpp"

namespace takt::machines {
namespace {

using dds::made;

constexpr size_t kAtOnce = 32;
constexpr const char* kLargeDatagrams =
    "<MaxMessageSize>65500B</MaxMessageSize><FragmentSize>1344B</FragmentSize>";  ///< both ends are Cyclone

class DdsWire final : public Wire {
 public:
  explicit DdsWire(const WireOptions& options)
      : domain_(dds::domain_on(options.address, options.domain, kLargeDatagrams, "")),
        participant_(
            made(dds_create_participant(static_cast<dds_domainid_t>(options.domain), nullptr, nullptr), "participant")),
        waitset_(made(dds_create_waitset(participant_), "waitset")) {}
  ~DdsWire() override { dds_delete(domain_); }  // with all in it

  size_t sends(const Topic& topic) override {
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
    const dds_entity_t fresh = made(dds_create_readcondition(reader, DDS_ANY_STATE), "condition");
    dds_waitset_attach(waitset_, fresh, static_cast<dds_attach_t>(readers_.size()));
    readers_.push_back(reader);
    return readers_.size() - 1;
  }

  void send(size_t topic, std::span<const std::byte> bytes) override {
    takt_Bytes sample{};
    sample.data._buffer = const_cast<uint8_t*>(reinterpret_cast<const uint8_t*>(bytes.data()));
    sample.data._length = sample.data._maximum = static_cast<uint32_t>(bytes.size());
    dds_write(writers_[topic], &sample);  // what could not be sent is missing there, and counted
  }

  void take(int64_t patience_ns, const std::function<void(size_t, std::span<const std::byte>)>& each) override {
    std::array<dds_attach_t, kAtOnce> ready{};
    const dds_return_t count = dds_waitset_wait(waitset_, ready.data(), ready.size(), patience_ns);
    if (count <= 0) return;
    for (size_t topic = 0; topic < readers_.size(); ++topic) take_all(topic, each);
  }

 private:
  template <class Make>
  dds_entity_t with_qos(const Topic& topic, const Make& make) const {
    dds_qos_t* const qos = dds_create_qos();
    if (topic.reliable) {
      dds_qset_reliability(qos, DDS_RELIABILITY_RELIABLE, DDS_MSECS(10));
      dds_qset_durability(qos, DDS_DURABILITY_TRANSIENT_LOCAL);
      dds_qset_history(qos, DDS_HISTORY_KEEP_LAST, 1);
    } else {
      dds_qset_reliability(qos, DDS_RELIABILITY_BEST_EFFORT, 0);
      dds_qset_history(qos, DDS_HISTORY_KEEP_LAST, kAtOnce);
    }
    const dds_entity_t entity = make(qos);
    dds_delete_qos(qos);
    return entity;
  }
  dds_entity_t topic_of(const Topic& topic, const dds_qos_t* qos) const {
    return made(dds_create_topic(participant_, &takt_Bytes_desc, topic.name.c_str(), qos, nullptr), "topic");
  }

  void take_all(size_t topic, const std::function<void(size_t, std::span<const std::byte>)>& each) {
    std::array<void*, kAtOnce> samples{};
    std::array<dds_sample_info_t, kAtOnce> infos;
    for (;;) {
      const dds_return_t count = dds_take(readers_[topic], samples.data(), infos.data(), kAtOnce, kAtOnce);
      if (count <= 0) return;
      for (int i = 0; i < count; ++i) {
        if (!infos[static_cast<size_t>(i)].valid_data) continue;
        const auto& data = static_cast<const takt_Bytes*>(samples[static_cast<size_t>(i)])->data;
        each(topic, std::as_bytes(std::span(data._buffer, data._length)));
      }
      dds_return_loan(readers_[topic], samples.data(), count);
    }
  }

  const dds_entity_t domain_, participant_, waitset_;
  std::vector<dds_entity_t> writers_, readers_;
};

std::unique_ptr<Wire> make(const WireOptions& options) { return std::make_unique<DdsWire>(options); }

}  // namespace

extern "C" [[gnu::visibility("default")]] const DdsComponent takt_dds{kAbi, make};

}  // namespace takt::machines
