// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <sys/types.h>

#include <filesystem>
#include <functional>
#include <optional>
#include <string>

#include "graph/run/run.hpp"
#include "hal/settings/json.hpp"

namespace takt::bringup {

/// A run in a process of its own, spoken to as any run is:
///
///   TrialRun run(registry, options, "out/front_laser.log");
///   if (!run.begun()) return failed(run.why());
///   if (const auto scan = run.message("front_laser.scan")) ...
///
/// Ends with the object. One thread.
class TrialRun {
 public:
  using Json = nlohmann::ordered_json;
  /// What it says goes into `log`. Throws std::runtime_error if there is no process for it.
  TrialRun(const Registry& registry, const command::RunOptions& options, const std::filesystem::path& log);
  ~TrialRun();
  TrialRun(const TrialRun&) = delete;
  TrialRun& operator=(const TrialRun&) = delete;

  /// Waits until it can be asked. False: it ended before.
  bool begun();
  /// The last thing that it said.
  std::string why() const;
  /// {"error": ...} if it does not answer.
  Json ask(const Json& question) const;
  /// Fields of the newest message of an output, arrays up to `items`; nothing: there is none within 2 s.
  std::optional<Json> message(const std::string& port, size_t items = 8) const;
  /// As PNG.
  std::optional<std::string> picture(const std::string& port) const;
  /// What `takt top` says of a device: state, losses, received, and the jobs of its node (completed).
  Json device(const std::string& id) const;

 private:
  std::filesystem::path log_;
  pid_t process_ = 0;
};

/// Looks every 50 ms; whether it came to be within that time.
bool comes_to_be(double within_s, const std::function<bool()>& condition);

}  // namespace takt::bringup
