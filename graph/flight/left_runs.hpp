// SPDX-License-Identifier: Apache-2.0
// What runs that did not come to their end left behind.
#pragma once
#include <filesystem>
#include <string>
#include <tl/expected.hpp>
#include <vector>

#include "rt/record/join.hpp"

namespace takt::flight {

/// Where the images and clouds of the run with that name lie until they are frozen, or the run ends.
std::filesystem::path memory_place(const std::string& run);

struct Rescued {
  std::string run;
  std::vector<std::filesystem::path> files;
  record::Joined joined;
};

/// One record of all that the newest run in that folder (OUTPUT/flight/ring) kept, on disk and, as long as the machine
/// has not been started anew, in memory. Error: there is none, or the sink refuses it.
tl::expected<Rescued, std::string> rescue(const std::filesystem::path& folder, mcap::Sink& sink);

/// Takes away what runs of this user left in memory that are over, but for the newest of them; the places. A run that
/// goes on has a WriterLock on its place.
std::vector<std::filesystem::path> clear_memory();

}  // namespace takt::flight
