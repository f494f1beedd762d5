// SPDX-License-Identifier: Apache-2.0
#include "graph/flight/left_runs.hpp"

#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <system_error>

#include "rt/file/output_file.hpp"
#include "rt/record/ring.hpp"

namespace takt::flight {
namespace {

namespace fs = std::filesystem;

const fs::path kMemory = "/dev/shm";
constexpr std::string_view kPrefix = "takt-flight-";

bool mine(const fs::path& place) {
  struct stat status {};
  return lstat(place.c_str(), &status) == 0 && status.st_uid == geteuid() && S_ISDIR(status.st_mode);
}

}  // namespace

fs::path memory_place(const std::string& run) { return kMemory / (std::string(kPrefix) + run); }

tl::expected<Rescued, std::string> rescue(const fs::path& folder, mcap::Sink& sink) {
  std::vector<fs::path> all;
  for (const record::RingFile& file : record::records_in(folder))
    if (!record::name_of(file.path).run.empty()) all.push_back(file.path);
  if (all.empty()) return tl::unexpected(folder.string() + ": no run has left anything here");
  Rescued rescued;
  rescued.run = record::name_of(all.back()).run;
  for (const fs::path& file : all)
    if (record::name_of(file).run == rescued.run) rescued.files.push_back(file);
  for (const record::RingFile& file : record::records_in(memory_place(rescued.run))) rescued.files.push_back(file.path);
  auto joined = record::join(rescued.files, sink, {});
  if (!joined) return tl::unexpected(joined.error());
  rescued.joined = std::move(*joined);
  return rescued;
}

std::vector<fs::path> clear_memory() {
  std::vector<std::pair<fs::file_time_type, fs::path>> left;
  std::error_code error;
  for (const fs::directory_entry& entry : fs::directory_iterator(kMemory, error))
    if (entry.path().filename().string().starts_with(kPrefix) && mine(entry.path()) &&
        WriterLock::of_folder(entry.path()))
      left.emplace_back(entry.last_write_time(error), entry.path());
  std::sort(left.begin(), left.end());
  std::vector<fs::path> cleared;
  for (size_t i = 0; i + 1 < left.size(); ++i)
    if (fs::remove_all(left[i].second, error); !error) cleared.push_back(left[i].second);
  return cleared;
}

}  // namespace takt::flight
