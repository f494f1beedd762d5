// SPDX-License-Identifier: Apache-2.0
// What is in a record, as figures.
#pragma once
#include <cstdint>
#include <string>
#include <vector>

#include "graph/log/recorded_plan.hpp"
#include "rt/record/log_file.hpp"

namespace takt::log {

/// One of the facts at the head or end of a record; empty if it does not state it.
std::string fact(const mcap::Metadata& facts, const std::string& name);

/// Everything that a reader asks first: what was run, for how long, what each channel holds, what is lost or damaged,
/// the hash of the content. Throws nlohmann's exception if the record does not hold its plan.
Json content_json(record::LogFile& log);
std::string content_text(const Json& content);

/// Hash of all messages, jobs, the plan and the files that the graph names; not of what tells one run on one machine
/// from another (paths, machine, commit, program). Two runs on virtual time from the same input give the same.
std::string content_hash(const record::LogFile& log);

/// How one record differs from another, `to` told against `from`: first what each node did (jobs per second, misses,
/// execution time), then the messages.
struct LogDifference {
  std::vector<std::string> lines;
  bool same = true;
  uint64_t messages = 0;  ///< of both, that were looked at
};
LogDifference difference(record::LogFile& from, record::LogFile& to);

}  // namespace takt::log
