// SPDX-License-Identifier: Apache-2.0
// The run of a record, made again: its graph composed as it was, and its jobs run with what they were given.
#pragma once
#include <cstdint>
#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "graph/compose/composition.hpp"
#include "graph/log/log_content.hpp"
#include "graph/rewind/recorded_options.hpp"
#include "graph/run/isolated_replay.hpp"
#include "graph/run/prepare.hpp"
#include "rt/record/replayer.hpp"
#include "rt/time/clock.hpp"

namespace takt::rewind {

/// One thread at a time; open() comes first, then compose(). What makes a replay impossible throws Refused.
class RecordedRun {
 public:
  /// The options outlive this.
  explicit RecordedRun(const ReplayOptions& options) : options_(options) {}
  RecordedRun(const RecordedRun&) = delete;
  RecordedRun& operator=(const RecordedRun&) = delete;

  /// Reads the record, or the part of it that --from and --until leave: what it says of its run.
  command::RunOptions& open();
  /// With a registry that knows what the options of the run name, which outlives this: all but the jobs. kOk, or the
  /// exit code of what stands on stderr. Says what is not as it was.
  int compose(const Registry& registry);
  /// The same after a rehearsal in another process: only what is needed for parts(), each of which composes its own.
  int outline(const Registry& registry);
  /// Nodes as they were before the first job. After compose().
  void compose_again();

  record::LogFile& log() { return *file_; }
  /// Of the record.
  std::string name() const { return options_.log.filename().string(); }
  const graph::GraphSpec& graph() const { return *prepared_->graph; }
  const Plan& plan() const { return prepared_->composition->plan; }
  int64_t epoch_ns() const;
  int64_t at(double s) const { return epoch_ns() + static_cast<int64_t>(s * 1e9); }
  /// The record is damaged, and that is not allowed.
  bool damaged() const { return !options_.allow_damage && !file_->damages().empty(); }

  /// One for each process.
  std::vector<command::ReplayPart> parts() const;
  /// Runs the jobs of some nodes, in this process, once after each compose().
  record::ReplayResult run(record::Replayer::Options how);

 private:
  void read_part();
  void force_simd(const VectorTargets& vectors) const;
  int compose();
  void check_plugins(const std::vector<graph::PluginFact>& loaded) const;
  void check_sameness();
  void renew(size_t task);
  std::vector<char> live_tasks() const;
  std::vector<char> with_producers(std::vector<char> runs) const;
  bool add_producers(size_t task, std::vector<char>& runs) const;
  std::function<void(int64_t)> pace(int64_t from_ns) const;

  const ReplayOptions& options_;
  command::RunOptions run_;  ///< of the record, and what the command line says
  MonotonicClock clock_;
  std::optional<record::LogFile> file_;
  log::Json recorded_;  ///< the plan
  std::optional<command::Prepared> prepared_;
  graph::ComposeOptions composed_;
};

}  // namespace takt::rewind
