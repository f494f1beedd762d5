// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <optional>
#include <string>

#include "graph/expect/finding.hpp"
#include "graph/language/message_field.hpp"

namespace takt::graph {

/// One condition while the run goes on. Instants in ns since the epoch.
class ConditionWatch {
 public:
  explicit ConditionWatch(const ConditionSpec& spec);
  const ConditionSpec& spec() const { return spec_; }

  /// Whether a value is as the test of the condition says.
  static bool passes(const ConditionSpec& spec, const FieldValue& value);
  /// What it is about was so then: of one message, or in the world. Nothing: it had no value.
  void see(const std::optional<FieldValue>& value, int64_t at_ns);

  /// What `unless` names was so in the newest message.
  void see_exception(const std::optional<FieldValue>& value) {
    excepted_ = value && passes(spec_.unless.front(), *value);
  }

  /// As far as can be said at that instant it holds, and no later instant of its window is to be waited for.
  bool satisfied(int64_t now_ns) const;
  /// It can not hold any more.
  bool broken() const { return broken_ns_.has_value(); }
  /// The run has to go on until it holds; others hold as long as nothing breaks them.
  bool must_come_true() const;
  /// At the end of the run.
  Finding finding() const;
  /// "obstacle_stop.stop reasons"; "at least 1 m/s".
  std::string what() const;
  std::string test_text() const;

 private:
  bool counts(int64_t at_ns) const { return at_ns >= spec_.from_ns && (!spec_.to_ns || at_ns < *spec_.to_ns); }
  bool met() const;
  std::string expected() const;
  std::string observed() const;

  const ConditionSpec spec_;
  uint64_t seen_ = 0;
  bool excepted_ = false;
  bool passes_now_ = false;
  std::optional<int64_t> first_ns_;   ///< it passed for the first time
  std::optional<int64_t> since_ns_;   ///< it has passed from then on
  std::optional<int64_t> broken_ns_;  ///< `always` or `never` was broken
  std::optional<FieldValue> newest_, first_, breaking_;
};

}  // namespace takt::graph
