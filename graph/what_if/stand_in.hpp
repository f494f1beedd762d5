// SPDX-License-Identifier: Apache-2.0
// A node that computes nothing: its jobs take the time, and publish what, the recorded jobs of another node did.
#pragma once
#include <deque>
#include <optional>
#include <string_view>

#include "graph/what_if/recorded_run.hpp"
#include "rt/msg/field_list.hpp"
#include "rt/node.hpp"

namespace takt::what_if {

/// What a stand-in sends instead of images and clouds.
struct Blank {
  static constexpr std::string_view type_name = "blank";
  uint8_t nothing = 0;
  TAKT_FIELDS(Blank, (nothing, ""))
};

/// The type that a port of that type gets: requests keep theirs, since the runtime obeys them.
const MessageType& stand_in_type(const MessageType& type);

class StandIn final : public Node {
 public:
  /// Both outlive it. Its ports, levels and their order are those of the real node.
  StandIn(const TaskPlan& real, const RecordedTask& recorded);
  void setup(Setup&) override {}
  void run(Job& job) override;

  /// The recorded job that its next one plays; null: it takes no time and publishes nothing.
  void play(const PastJob* past) { past_ = past; }
  const PastJob* played() const { return past_; }

 private:
  class Port final : public OutputPort {
   public:
    using OutputPort::OutputPort;
    void* loan() { return loan_message(); }
  };
  std::optional<int64_t> stamp_ns(const Publication& message, const Job& job) const;

  const TaskPlan& real_;
  const RecordedTask& recorded_;
  std::deque<InputPort> inputs_;
  std::deque<Port> outputs_;
  const PastJob* past_ = nullptr;
};

}  // namespace takt::what_if
