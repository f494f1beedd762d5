// SPDX-License-Identifier: Apache-2.0
// The flight recorder of a run: what it said last is always kept, and frozen by a miss, a loss or a mark.
#pragma once
#include <filesystem>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

#include "graph/flight/freezer.hpp"
#include "graph/flight/places.hpp"
#include "graph/flight/triggers.hpp"
#include "hal/settings/json.hpp"
#include "rt/file/output_file.hpp"
#include "rt/record/recorder.hpp"
#include "rt/record/ring.hpp"

namespace takt::flight {

/// OUTPUT/flight: `ring` has the newest part of the run, `frozen` a file for each cause. Images and clouds of the ring
/// lie in a folder of /dev/shm until they are frozen.
class FlightRecorder {
 public:
  struct Options {
    std::filesystem::path folder;
    std::vector<std::string> processes = {};  ///< names, for outages
    bool by_caller = false;                   ///< see record::Recorder::Options
    int priority = 0;
    std::function<void(const std::string&)> say = {};  ///< a line for whoever looks on
  };
  /// Of each port.
  static constexpr uint32_t kFollowers = 2;

  /// Before the first job, once the ports have their memory. All given outlives this, the data of the head too. What
  /// is in the way is in lacks(), and nothing is kept then.
  FlightRecorder(const graph::GraphSpec& graph, const Plan& plan, const RunBoard& board, Transport& transport,
                 record::Head head, Options options);
  ~FlightRecorder();
  FlightRecorder(const FlightRecorder&) = delete;
  FlightRecorder& operator=(const FlightRecorder&) = delete;

  const std::string& lacks() const { return lacks_; }
  std::filesystem::path frozen_folder() const { return options_.folder / "frozen"; }
  /// What is kept may be less than was asked for, and why.
  const std::vector<std::string>& doubts() const { return doubts_; }
  /// As of record::Recorder.
  void take(int32_t ring, const trace::Event& event);
  void capture();
  void take_rest();
  void finish(const mcap::Metadata& facts, uint64_t unheard_threads);
  /// Of all that was frozen so far. Any thread.
  std::vector<std::string> sentences() const;
  /// For the report's key `flight`.
  nlohmann::ordered_json told() const;

 private:
  Freezer::Options freezing(const graph::RecordSpec& spec, const Plan& plan, const std::string& run);
  void look_for_outages();
  void tell(const Frozen& frozen);

  const Options options_;
  const RunBoard& board_;
  Triggers triggers_;
  Places places_;
  std::string lacks_;
  std::vector<std::string> doubts_;
  std::filesystem::path in_memory_;
  std::optional<WriterLock> memory_lock_;
  std::unique_ptr<record::Ring> disk_, memory_;
  mutable std::mutex mutex_;
  std::vector<std::string> sentences_;  ///< the newest ones
  std::unique_ptr<Evidence> evidence_;
  std::unique_ptr<Freezer> freezer_;
  std::unique_ptr<record::Recorder> recorder_, images_;
  record::RecordResult kept_, kept_images_;
  std::vector<Frozen> frozen_;
  size_t outages_seen_ = 0;
};

}  // namespace takt::flight
