// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <cstddef>
#include <cstdint>
#include <functional>
#include <span>
#include <string>
#include <tl/expected.hpp>

#include "graph/log/recorded_plan.hpp"
#include "rt/record/log_file.hpp"

namespace takt::log {

struct Echoed {
  uint64_t messages = 0;
  uint64_t hash_only = 0;        ///< of them: those of which the record does not have the fields
  uint64_t unreadable = 0;       ///< not among them
  std::string first_unreadable;  ///< the port and why
};

/// Gives the messages of these ports ("NODE.PORT"; none: of all) as JSON, in the order of the file, by the fields that
/// the record describes:
///
///   {"port":"oven.inside","type":"temperature","sequence":1,"level":0,"stamp_ns":1000000000,
///    "message":{"celsius":20.0,"number":0}}
///
/// `items`: of longer arrays so many elements. A message that was recorded by its hash has "hash" in place of
/// "message". Error: there is no such port (the valid ones are named), or the file is damaged.
tl::expected<Echoed, std::string> echo_log(const record::LogFile& log, std::span<const std::string> ports, size_t items,
                                           const std::function<void(const Json&)>& each);

}  // namespace takt::log
