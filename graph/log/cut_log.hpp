// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <cstdint>
#include <string>
#include <tl/expected.hpp>

#include "rt/record/log_file.hpp"
#include "rt/record/mcap/file_sink.hpp"

namespace takt::log {

struct Cut {
  uint64_t jobs = 0, messages = 0, events = 0, bytes = 0;  ///< written
};

/// Writes the part of a record that its jobs released in [from_ns, to_ns) need: these jobs, the messages that they held
/// or published, earlier jobs that made what they held where the record has it by hash only, all that the head says,
/// and with the next job of a node the parameters that jobs left out had set. Of the events: those of that time, the
/// last restart of a node before each of its jobs with the messages that it was handed over, the mode at the begin.
/// Nodes that remember what was left out make other messages when the cut is replayed. Error: the file takes no more,
/// or part of the record is damaged.
tl::expected<Cut, std::string> cut_log(const record::LogFile& log, int64_t from_ns, int64_t to_ns, mcap::Sink& sink);

/// Instant from which the seconds of a record are counted: the epoch of the run; of a record without an end, the first
/// release; 0 of one without jobs.
int64_t epoch_ns(const record::LogFile& log);

}  // namespace takt::log
