// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <cstdint>
#include <optional>
#include <string>

#include "graph/language/message_field.hpp"
#include "graph/rewind/recorded_run.hpp"

namespace takt::rewind {

/// A condition on an output of a node, looked at behind each job that sends one.
class SeenCondition {
 public:
  /// Throws Refused if no job of a replay makes such a message.
  SeenCondition(const graph::ConditionSpec& spec, const RecordedRun& run);

  struct Seen {
    bool passes = false;
    std::string value;  ///< "1.25", or a text
  };
  /// Nothing: the job sent no such message, or it has no such number.
  std::optional<Seen> behind(const record::Replayer& replayer, const record::RecordedJob& job) const;
  size_t task() const { return task_; }
  /// "obstacle_stop.stop reasons at least 1".
  const std::string& text() const { return text_; }

 private:
  const graph::ConditionSpec spec_;
  graph::MessageField field_;
  size_t task_ = 0, port_ = 0;
  uint16_t output_ = 0;
  std::string text_;
};

}  // namespace takt::rewind
