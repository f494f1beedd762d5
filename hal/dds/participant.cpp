// SPDX-License-Identifier: Apache-2.0
#include "hal/dds/participant.hpp"

#include <dds/ddsi/ddsi_serdata.h>

#include <algorithm>
#include <map>
#include <mutex>
#include <vector>

#include "hal/dds/interface.hpp"
#include "hal/dds/raw_type.hpp"

namespace takt::dds {
namespace {

constexpr size_t kAtOnce = 32;
constexpr dds_duration_t kPatience = DDS_MSECS(5);  ///< for a reliable reader that does not keep up

struct EntityQos {
  dds_qos_t* const qos = dds_create_qos();
  EntityQos() = default;
  EntityQos(const EntityQos&) = delete;
  EntityQos& operator=(const EntityQos&) = delete;
  ~EntityQos() { dds_delete_qos(qos); }
  void say(const std::string& user_data) {
    if (!user_data.empty()) dds_qset_userdata(qos, user_data.data(), user_data.size());
  }
  void take(const Profile& profile) {
    dds_qset_reliability(qos, profile.reliable ? DDS_RELIABILITY_RELIABLE : DDS_RELIABILITY_BEST_EFFORT, kPatience);
    dds_qset_durability(qos, profile.transient_local ? DDS_DURABILITY_TRANSIENT_LOCAL : DDS_DURABILITY_VOLATILE);
    dds_qset_history(qos, DDS_HISTORY_KEEP_LAST, profile.depth);
    dds_qset_writer_data_lifecycle(qos, false);
  }
};

Guid guid_of_entity(dds_entity_t entity) {
  dds_guid_t guid{};
  dds_get_guid(entity, &guid);
  Guid bytes{};
  std::copy(std::begin(guid.v), std::end(guid.v), bytes.begin());
  return bytes;
}

/// Loopback has no multicast that one could count on: others of this machine are asked one by one, and often, since
/// those that begin later cannot be heard.
std::string finding_others(const std::string& address) {
  if (!address.starts_with("127.")) return "";
  return fmt::format(
      "<Discovery><ParticipantIndex>auto</ParticipantIndex><MaxAutoParticipantIndex>20</MaxAutoParticipantIndex>"
      "<SPDPInterval>1s</SPDPInterval><Peers><Peer address=\"{}\"/></Peers></Discovery>",
      address);
}

}  // namespace

/// A process has one domain of a number: its participants share it, whoever made it. Any thread.
class SharedDomain {
 public:
  static std::shared_ptr<SharedDomain> of(const Participant::Options& options) {
    static std::mutex mutex;
    static std::map<int, std::weak_ptr<SharedDomain>> domains;
    const std::lock_guard lock(mutex);
    std::shared_ptr<SharedDomain> domain = domains[options.domain].lock();
    if (!domain) domains[options.domain] = domain = std::make_shared<SharedDomain>(options);
    if (domain->address_ != options.address)
      throw std::runtime_error(fmt::format("DDS: domain {} is on {} in this process, and cannot be on {}, too",
                                           options.domain, domain->address_, options.address));
    return domain;
  }
  explicit SharedDomain(const Participant::Options& options)
      : address_(options.address),
        entity_(domain_on(options.address, options.domain, "", finding_others(options.address))) {}
  ~SharedDomain() { dds_delete(entity_); }
  SharedDomain(const SharedDomain&) = delete;
  SharedDomain& operator=(const SharedDomain&) = delete;

 private:
  const std::string address_;
  const dds_entity_t entity_;
};

class Participant::Inside {
 public:
  struct Writer {
    dds_entity_t topic = 0, writer = 0;
    const ddsi_sertype* type = nullptr;
  };
  Inside(const Options& options, const std::string& user_data) : domain(SharedDomain::of(options)) {
    EntityQos qos;
    qos.say(user_data);
    participant =
        made(dds_create_participant(static_cast<dds_domainid_t>(options.domain), qos.qos, nullptr), "participant");
    waitset = made(dds_create_waitset(participant), "waitset");
  }
  ~Inside() { dds_delete(participant); }  // with all in it
  Inside(const Inside&) = delete;
  Inside& operator=(const Inside&) = delete;

  Writer topic_of(const Endpoint& endpoint) const {
    ddsi_sertype* type = raw_type(endpoint.type);
    const dds_entity_t topic =
        dds_create_topic_sertype(participant, endpoint.topic.c_str(), &type, nullptr, nullptr, nullptr);
    if (topic < 0) ddsi_sertype_unref(type);
    return {made(topic, "topic " + endpoint.topic), 0, type};
  }

  const std::shared_ptr<SharedDomain> domain;
  dds_entity_t participant = 0, waitset = 0;
  std::vector<Writer> writers;
  std::vector<dds_entity_t> readers;
};

Participant::Participant(const Options& options, const std::string& user_data)
    : inside_(std::make_unique<Inside>(options, user_data)) {}
Participant::~Participant() = default;

size_t Participant::add_writer(const Endpoint& endpoint) {
  Inside::Writer writer = inside_->topic_of(endpoint);
  EntityQos qos;
  qos.take(endpoint.profile);
  qos.say(endpoint.user_data);
  writer.writer =
      made(dds_create_writer(inside_->participant, writer.topic, qos.qos, nullptr), "writer of " + endpoint.topic);
  inside_->writers.push_back(writer);
  return inside_->writers.size() - 1;
}

void Participant::remove_writer(size_t writer) {
  dds_delete(inside_->writers[writer].writer);
  dds_delete(inside_->writers[writer].topic);
  inside_->writers[writer] = {};
}

size_t Participant::readers_of(size_t writer) const {
  dds_publication_matched_status_t status{};
  dds_get_publication_matched_status(inside_->writers[writer].writer, &status);
  return status.current_count;
}

bool Participant::write(size_t writer, std::span<const std::byte> cdr, int64_t at_ns) {
  const Inside::Writer& to = inside_->writers[writer];
  ddsi_serdata* sample = raw_sample(*to.type, cdr);
  sample->timestamp.v = at_ns;
  return dds_forwardcdr(to.writer, sample) == DDS_RETCODE_OK;
}

Guid Participant::guid() const { return guid_of_entity(inside_->participant); }
Guid Participant::guid_of(size_t writer) const { return guid_of_entity(inside_->writers[writer].writer); }

size_t Participant::add_reader(const Endpoint& endpoint) {
  EntityQos qos;
  qos.take(endpoint.profile);
  qos.say(endpoint.user_data);
  const dds_entity_t reader =
      made(dds_create_reader(inside_->participant, inside_->topic_of(endpoint).topic, qos.qos, nullptr),
           "reader of " + endpoint.topic);
  const dds_entity_t fresh = made(dds_create_readcondition(reader, DDS_ANY_STATE), "condition");
  dds_waitset_attach(inside_->waitset, fresh, static_cast<dds_attach_t>(inside_->readers.size()));
  inside_->readers.push_back(reader);
  return inside_->readers.size() - 1;
}

void Participant::take(int64_t patience_ns,
                       const std::function<void(size_t, std::span<const std::byte>, int64_t)>& each) {
  std::array<dds_attach_t, kAtOnce> ready{};
  if (dds_waitset_wait(inside_->waitset, ready.data(), ready.size(), patience_ns) <= 0) return;
  std::array<ddsi_serdata*, kAtOnce> samples{};
  std::array<dds_sample_info_t, kAtOnce> infos;
  for (size_t reader = 0; reader < inside_->readers.size(); ++reader)
    for (dds_return_t count = static_cast<dds_return_t>(kAtOnce); count == static_cast<dds_return_t>(kAtOnce);) {
      count = dds_takecdr(inside_->readers[reader], samples.data(), kAtOnce, infos.data(), DDS_ANY_STATE);
      for (int i = 0; i < count; ++i) {
        const auto at = static_cast<size_t>(i);
        if (infos[at].valid_data) each(reader, bytes_of(*samples[at]), infos[at].source_timestamp);
        ddsi_serdata_unref(samples[at]);
      }
    }
}

}  // namespace takt::dds
