// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <dds/dds.h>

#include <array>
#include <chrono>
#include <cstdint>
#include <functional>
#include <map>
#include <mutex>
#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <vector>

namespace takt::machines {

/// What Cyclone traces when it sees a participant for the first time.
struct Seen {
  std::array<uint32_t, 3> id{};  ///< the prefix of its GUID
  std::string address;           ///< "": not told
  bool secure = false;           ///< it has keys, of whomever
};
/// Nothing: the line is about something else.
std::optional<Seen> seen_in(std::string_view line);

/// Names those that this machine does not listen to, or who do not listen to it, for want of the right keys: once each,
/// and all of them at the end. DDS has no call for that, so its trace of discovery is read. One at a time in a process;
/// made before the domain. Messages of the library itself are said once each.
class Strangers {
 public:
  Strangers(bool with_keys, std::function<void(const std::string&)> say);
  ~Strangers();
  Strangers(const Strangers&) = delete;
  Strangers& operator=(const Strangers&) = delete;

  /// Now and then, one call at a time.
  void look(const std::vector<dds_entity_t>& readers);

 private:
  using Clock = std::chrono::steady_clock;
  struct Known {
    Seen seen;
    Clock::time_point since;
  };
  static void traced(void* self, const dds_log_data_t* line);
  static void logged(void* self, const dds_log_data_t* line);
  void tell(const Seen& stranger);

  const bool with_keys_;
  const std::function<void(const std::string&)> say_;
  Clock::time_point next_{};
  std::mutex mutex_;  ///< what follows; the library's threads trace
  std::map<std::array<uint32_t, 3>, Known> waiting_;
  std::set<std::string> said_, told_;
};

}  // namespace takt::machines
