// SPDX-License-Identifier: Apache-2.0
// Cyclone DDS: reliable, keep last 1, a wait set on the trigger. Over shared memory (its own use of iceoryx) where this
// machine's build has that, else over UDP on the loopback device; note() tells which.
#include <dds/dds.h>
#include <dds/ddsc/dds_loan_api.h>

#include <cstdlib>

#include "bench/peers/medium.hpp"
#include "bench/suite.hpp"
#include "payload.h"

namespace takt::bench {
namespace {

const dds_topic_descriptor_t* type_of(uint32_t bytes) {
  switch (bytes) {
    case sizeof(takt_bench_Payload128): return &takt_bench_Payload128_desc;
    case sizeof(takt_bench_Payload921600): return &takt_bench_Payload921600_desc;
    case sizeof(takt_bench_Payload3686400): return &takt_bench_Payload3686400_desc;
    default: throw CannotRun("payload.idl has no type of " + std::to_string(bytes) + " bytes");
  }
}

dds_entity_t check(dds_entity_t entity) {
  if (entity < 0) throw CannotRun(std::string("Cyclone DDS: ") + dds_strretcode(-entity));
  return entity;
}

/// One machine, no multicast, up to 100 participants; shared memory if this build knows that word.
dds_entity_t make_participant() {
  const std::string common =
      "<General><Interfaces><NetworkInterface name=\"lo\" multicast=\"false\"/></Interfaces>"
      "<AllowMulticast>false</AllowMulticast></General><Discovery><ParticipantIndex>auto</ParticipantIndex>"
      "<MaxAutoParticipantIndex>100</MaxAutoParticipantIndex><Peers><Peer Address=\"127.0.0.1\"/></Peers></Discovery>"
      "<Tracing><Verbosity>none</Verbosity></Tracing>";
  const std::string shared = "<SharedMemory><Enable>true</Enable><LogLevel>off</LogLevel></SharedMemory>";
  dds_entity_t participant = 0;
  for (const std::string& configuration : {common + shared, common}) {
    setenv("CYCLONEDDS_URI", ("<CycloneDDS><Domain>" + configuration + "</Domain></CycloneDDS>").c_str(), 1);
    participant = dds_create_participant(DDS_DOMAIN_DEFAULT, nullptr, nullptr);
    if (participant >= 0) break;
  }
  return check(participant);
}

class CycloneEnds final : public Ends {
 public:
  CycloneEnds(const MediumPlan& plan, size_t node) : plan_(plan), participant_(make_participant()) {
    qos_ = dds_create_qos();
    dds_qset_reliability(qos_, DDS_RELIABILITY_RELIABLE, DDS_SECS(1));
    dds_qset_history(qos_, DDS_HISTORY_KEEP_LAST, 1);
    if (node != plan.shape.sink()) {
      writer_ = check(dds_create_writer(participant_, topic(node), qos_, nullptr));
      shared_ = dds_is_loan_available(writer_);
      if (!shared_) buffer_.resize(plan.bytes);
    }
    if (const auto producer = plan.shape.trigger(node)) subscribe(*producer);
    for (size_t producer : plan.shape.sides(node)) subscribe(producer);
    if (!inputs_.empty()) {
      waits_ = check(dds_create_waitset(participant_));
      check(dds_waitset_attach(waits_, check(dds_create_readcondition(inputs_[0].reader, DDS_ANY_STATE)), 0));
    }
    await_partners(node);
  }
  ~CycloneEnds() override {
    dds_delete(participant_);
    dds_delete_qos(qos_);
  }
  CycloneEnds(const CycloneEnds&) = delete;
  CycloneEnds& operator=(const CycloneEnds&) = delete;

  bool wait() override {
    dds_attach_t which = 0;
    return dds_waitset_wait(waits_, &which, 1, kPatienceNs) > 0 && take(inputs_[0]);
  }
  size_t take_sides() override {
    size_t fresh = 0;
    for (size_t i = 1; i < inputs_.size(); ++i) fresh += take(inputs_[i]);
    return fresh;
  }
  void prepare() override {
    sample_ = buffer_.data();
    if (shared_ && dds_loan_sample(writer_, &sample_) != DDS_RETCODE_OK) sample_ = nullptr;
  }
  void publish() override {
    if (sample_ != nullptr) dds_write(writer_, sample_);
  }
  std::string note() const override { return shared_ ? "shared memory" : "UDP loopback"; }

 private:
  struct Input {
    dds_entity_t reader = 0;
    std::vector<uint8_t> buffer;
  };
  dds_entity_t topic(size_t node) const {
    const std::string name = plan_.id + "_" + std::to_string(node);
    return check(dds_create_topic(participant_, type_of(plan_.bytes), name.c_str(), nullptr, nullptr));
  }
  void subscribe(size_t producer) {
    inputs_.push_back(
        {check(dds_create_reader(participant_, topic(producer), qos_, nullptr)), std::vector<uint8_t>(plan_.bytes)});
  }
  /// Until every edge of this node is matched, 10 s at most: what is written earlier is lost.
  void await_partners(size_t node) const {
    for (int tries = 0; tries < 1000; ++tries) {
      bool all = true;
      dds_publication_matched_status_t out{};
      if (writer_ != 0)
        all = dds_get_publication_matched_status(writer_, &out) == 0 &&
              out.current_count == plan_.shape.leaving(node).size();
      dds_subscription_matched_status_t in{};
      for (const Input& input : inputs_)
        all = all && dds_get_subscription_matched_status(input.reader, &in) == 0 && in.current_count == 1;
      if (all) return;
      dds_sleepfor(DDS_MSECS(10));
    }
  }
  /// Into memory of our own: this version copies out of shared memory anyway, and clears what it lends.
  static bool take(Input& input) {
    void* sample = input.buffer.data();
    dds_sample_info_t info{};
    return dds_take(input.reader, &sample, &info, 1, 1) == 1 && info.valid_data;
  }

  const MediumPlan plan_;
  const dds_entity_t participant_;
  dds_qos_t* qos_ = nullptr;
  dds_entity_t writer_ = 0, waits_ = 0;
  std::vector<Input> inputs_;  ///< the trigger first
  std::vector<uint8_t> buffer_;
  void* sample_ = nullptr;
  bool shared_ = false;
};

class Cyclone final : public Medium {
 public:
  explicit Cyclone(const MediumPlan& plan) : plan_(plan) { type_of(plan.bytes); }
  std::unique_ptr<Ends> open(size_t node) override { return std::make_unique<CycloneEnds>(plan_, node); }
  /// One pool for all writers: each loans one, each reader keeps one and has one in hand.
  std::vector<PortPlan> pools() const override {
    PortPlan pool = pool_plan(plan_.id, plan_.bytes + kPoolGap / 2, static_cast<uint32_t>(plan_.shape.edges.size()));
    pool.held = static_cast<uint32_t>(plan_.shape.nodes + 2 * plan_.shape.edges.size());
    return {pool};
  }

 private:
  const MediumPlan plan_;
};

}  // namespace

std::unique_ptr<Medium> make_cyclonedds(const MediumPlan& plan) { return std::make_unique<Cyclone>(plan); }

}  // namespace takt::bench
