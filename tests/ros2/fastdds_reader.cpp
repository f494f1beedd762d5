// SPDX-License-Identifier: Apache-2.0
// Reads topics with Fast DDS as it is by default, and prints what comes, a line of JSON each:
//
//   takt-fastdds-reader DOMAIN SECONDS rt/takt/front_laser/scan=sensor_msgs::msg::dds_::LaserScan_ ...
//
//   {"topic": ..., "sequence": 12, "source_ns": ..., "received_ns": ..., "message": {...}}
//   {"writer": "rt/takt/front_laser/scan", "type": ..., "user_data": "typehash=...;", "guid": ...}
//
// Best effort; `:r` behind the type: reliable, `:t`: reliable and transient local, `:q`: best effort, without the
// message.
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <fastdds/dds/domain/DomainParticipant.hpp>
#include <fastdds/dds/domain/DomainParticipantFactory.hpp>
#include <fastdds/dds/domain/DomainParticipantListener.hpp>
#include <fastdds/dds/subscriber/DataReader.hpp>
#include <fastdds/dds/subscriber/DataReaderListener.hpp>
#include <fastdds/dds/subscriber/SampleInfo.hpp>
#include <fastdds/dds/subscriber/Subscriber.hpp>
#include <fastdds/dds/topic/TopicDataType.hpp>
#include <iomanip>
#include <memory>
#include <mutex>
#include <sstream>
#include <string>
#include <thread>
#include <vector>

#include "tests/ros2/decoded.hpp"

namespace {

using namespace eprosima::fastdds::dds;
using eprosima::fastrtps::rtps::GUID_t;
using eprosima::fastrtps::rtps::InstanceHandle_t;
using eprosima::fastrtps::rtps::SerializedPayload_t;
using Bytes = std::vector<uint8_t>;

std::mutex printing;
void print(const std::string& line) {
  const std::lock_guard lock(printing);
  std::puts(line.c_str());
  std::fflush(stdout);
}

/// Samples of any type, as the bytes that came.
class AnyType final : public TopicDataType {
 public:
  explicit AnyType(const std::string& name) {
    setName(name.c_str());
    m_typeSize = 64 << 10;  // more is made when it is needed
    m_isGetKeyDefined = false;
  }
  bool serialize(void*, SerializedPayload_t*) override { return false; }
  bool deserialize(SerializedPayload_t* payload, void* to) override {
    static_cast<Bytes*>(to)->assign(payload->data, payload->data + payload->length);
    return true;
  }
  std::function<uint32_t()> getSerializedSizeProvider(void*) override {
    return [] { return 0u; };
  }
  void* createData() override { return new Bytes; }
  void deleteData(void* data) override { delete static_cast<Bytes*>(data); }
  bool getKey(void*, InstanceHandle_t*, bool) override { return false; }
};

std::string hex(const GUID_t& guid) {
  std::ostringstream text;
  text << std::hex << std::setfill('0');
  for (const auto byte : guid.guidPrefix.value) text << std::setw(2) << int{byte};
  for (const auto byte : guid.entityId.value) text << std::setw(2) << int{byte};
  return text.str();
}

class Discovered final : public DomainParticipantListener {
 public:
  void on_publisher_discovery(DomainParticipant*, eprosima::fastrtps::rtps::WriterDiscoveryInfo&& info) override {
    const auto& user_data = info.info.m_qos.m_userData;
    print("{\"writer\":\"" + info.info.topicName().to_string() + "\",\"type\":\"" + info.info.typeName().to_string() +
          "\",\"user_data\":\"" + std::string(user_data.begin(), user_data.end()) + "\",\"guid\":\"" +
          hex(info.info.guid()) + "\"}");
  }
};

class Printed final : public DataReaderListener {
 public:
  Printed(std::string topic, std::string type, bool quiet)
      : topic_(std::move(topic)), type_(std::move(type)), quiet_(quiet) {}
  void on_data_available(DataReader* reader) override {
    Bytes bytes;
    SampleInfo info;
    while (reader->take_next_sample(&bytes, &info) == ReturnCode_t::RETCODE_OK) {
      if (!info.valid_data) continue;
      std::ostringstream line;
      line << "{\"topic\":\"" << topic_ << "\",\"sequence\":" << info.sample_identity.sequence_number().to64long()
           << ",\"source_ns\":" << info.source_timestamp.to_ns() << ",\"received_ns\":"
           << std::chrono::duration_cast<std::chrono::nanoseconds>(std::chrono::system_clock::now().time_since_epoch())
                  .count();
      if (!quiet_) line << ",\"message\":" << message(bytes);
      print(line.str() + "}");
    }
  }

 private:
  std::string message(const Bytes& bytes) const {
    try {
      return takt::test::decoded(type_, bytes);
    } catch (const std::exception& problem) {
      return "{\"problem\":\"" + std::string(problem.what()) + "\"}";
    }
  }
  const std::string topic_, type_;
  const bool quiet_;
};

}  // namespace

int main(int argc, char** argv) {
  if (argc < 4) return std::fprintf(stderr, "use: %s DOMAIN SECONDS TOPIC=TYPE[:r|:t|:q] ...\n", argv[0]), 2;
  Discovered discovered;
  DomainParticipant* participant = DomainParticipantFactory::get_instance()->create_participant(
      static_cast<uint32_t>(std::atoi(argv[1])), PARTICIPANT_QOS_DEFAULT, &discovered, StatusMask::none());
  if (participant == nullptr) return std::fprintf(stderr, "no participant\n"), 3;
  Subscriber* subscriber = participant->create_subscriber(SUBSCRIBER_QOS_DEFAULT);
  std::vector<std::unique_ptr<Printed>> listeners;
  for (int i = 3; i < argc; ++i) {
    const std::string word = argv[i];
    const size_t equals = word.find('=');
    std::string name = word.substr(0, equals), type = word.substr(equals + 1);
    char how = 'b';
    if (type.size() > 2 && type[type.size() - 2] == ':') {
      how = type.back();
      type.resize(type.size() - 2);
    }
    TypeSupport(new AnyType(type)).register_type(participant);
    Topic* topic = participant->create_topic(name, type, TOPIC_QOS_DEFAULT);
    DataReaderQos qos = DATAREADER_QOS_DEFAULT;
    qos.reliability().kind = how == 'r' || how == 't' ? RELIABLE_RELIABILITY_QOS : BEST_EFFORT_RELIABILITY_QOS;
    qos.durability().kind = how == 't' ? TRANSIENT_LOCAL_DURABILITY_QOS : VOLATILE_DURABILITY_QOS;
    qos.history().kind = KEEP_LAST_HISTORY_QOS;
    qos.history().depth = 10;
    listeners.push_back(std::make_unique<Printed>(name, type, how == 'q'));
    if (topic == nullptr || subscriber->create_datareader(topic, qos, listeners.back().get()) == nullptr)
      return std::fprintf(stderr, "no reader of %s\n", name.c_str()), 3;
  }
  std::this_thread::sleep_for(std::chrono::duration<double>(std::atof(argv[2])));
  participant->delete_contained_entities();
  DomainParticipantFactory::get_instance()->delete_participant(participant);
  return 0;
}
