// SPDX-License-Identifier: Apache-2.0
// One record of the files of a ring.
//
//   const auto joined = join(files, *sink, {.from_ns = asked_ns - 3'000'000'000});
#pragma once
#include <cstdint>
#include <filesystem>
#include <string>
#include <tl/expected.hpp>
#include <vector>

#include "rt/record/mcap/file_sink.hpp"
#include "rt/record/mcap/format.hpp"
#include "rt/record/mcap/reader.hpp"

namespace takt::record {

struct JoinOptions {
  /// Publications in [from, to), of the run's time; others stay away.
  int64_t from_ns = INT64_MIN, to_ns = INT64_MAX;
  /// By task and edge: topic of the port it reads. What jobs of that time held is taken along, however old it is: from
  /// the files, else from `older`.
  std::vector<std::vector<std::string>> edges = {};
  std::vector<std::filesystem::path> older = {};
  std::vector<mcap::Reader::Named> metadata = {};  ///< in addition, as
  std::vector<mcap::Attachment> attachments = {};  ///< these
};

struct Joined {
  uint64_t messages = 0, bytes = 0;
  int64_t first_ns = 0, last_ns = 0;  ///< publications that are there
  std::vector<std::string> damages;   ///< what could not be read, with its file
};

/// Writes what the files hold into one record, in the order of the files. A message that one of them has by its hash
/// and another one with all fields stands there once, with all fields. Facts and attachments are those of the last
/// file that opens. Any thread, takes its time. Error: nothing could be read, the sink refused something, or the files
/// are not of one run.
tl::expected<Joined, std::string> join(const std::vector<std::filesystem::path>& files, mcap::Sink& sink,
                                       const JoinOptions& options);

}  // namespace takt::record
