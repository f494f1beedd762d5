// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <cstdint>
#include <set>
#include <string>
#include <tl/expected.hpp>

#include "graph/language/message_types.hpp"
#include "graph/log/export_forms.hpp"
#include "rt/record/log_file.hpp"
#include "rt/record/mcap/file_sink.hpp"

namespace takt::log {

struct Exported {
  uint64_t messages = 0;        ///< written
  uint64_t states = 0;          ///< of nodes, which only a replay reads: left out
  uint64_t hash_only = 0;       ///< of which the record does not have the fields: a replay can make them
  uint64_t showed_nothing = 0;  ///< such as pictures without pixels: left out
  uint64_t bytes = 0;
  std::set<std::string> own_fields;  ///< types that show nothing of themselves: their messages are there field by field
  uint64_t unreadable = 0;           ///< messages that the record has whole and that cannot be read, and lost channels
  std::string first_unreadable;      ///< the port and why
};

/// Writes what the record holds with all fields as MCAP that other programs show. Of `types`, what a message shows of
/// itself (rt/msg/viewer.hpp), in Foxglove's well-known schemas: a pair as `NODE.PORT.left` and `.right`, things with a
/// place as `.scene`, where a sensor sits on the robot as a transform on `/tf`. Everything else by the fields that the
/// record describes, whether this program was built with the type or not. Events are foxglove.Log on `takt/events`.
/// Stamps are those of the data. Pictures are raw in JSON and JPEG in CDR.
/// Error: the file takes no more, or the record does not hold its plan.
tl::expected<Exported, std::string> export_log(record::LogFile& log, const graph::MessageTypes& types,
                                               const ExportEncoding& encoding, mcap::Sink& sink);

}  // namespace takt::log
