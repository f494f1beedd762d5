// SPDX-License-Identifier: Apache-2.0
#include "hal/dds/participant.hpp"
#include "hal/ros2/source.hpp"
#include "rt/abi.hpp"

namespace takt::ros2 {
namespace {

class DdsSource final : public Source {
 public:
  explicit DdsSource(const TopicName& topic)
      : participant_({.address = topic.address, .domain = topic.domain}, "enclave=/;") {
    constexpr int kDepth = 4;
    participant_.add_reader({"rt" + topic.topic, topic.type, {.depth = kDepth}, ""});
  }
  void take(int64_t patience_ns, const std::function<void(std::span<const std::byte>)>& each) override {
    participant_.take(patience_ns, [&](size_t, std::span<const std::byte> bytes, int64_t) { each(bytes); });
  }

 private:
  dds::Participant participant_;
};

std::unique_ptr<Source> make(const TopicName& topic) { return std::make_unique<DdsSource>(topic); }

}  // namespace

extern "C" [[gnu::visibility("default")]] const SourceComponent takt_ros2{kAbi, make};

}  // namespace takt::ros2
