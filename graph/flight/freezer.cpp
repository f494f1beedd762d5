// SPDX-License-Identifier: Apache-2.0
#include "graph/flight/freezer.hpp"

#include <fmt/format.h>
#include <sys/resource.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <initializer_list>
#include <system_error>

#include "rt/capability.hpp"
#include "rt/record/join.hpp"

namespace takt::flight {
namespace {

namespace fs = std::filesystem;

/// Files are joined by code that is not the runtime's own loops.
constexpr size_t kStack = 1 << 20;
constexpr size_t kMostWaiting = 64, kMostAlso = 32;
/// A file of the ring has each message that stood when it began, so a little more than its length is enough.
constexpr int64_t kStandsFor_ns = 65'000'000'000;
constexpr auto kLook = std::chrono::milliseconds(100);

std::string also_text(const Frozen& frozen) {
  std::string text;
  for (const Cause& cause : frozen.also) text += (text.empty() ? "" : "\n") + cause.what;
  return text;
}

}  // namespace

Freezer::Freezer(record::Ring& disk, record::Ring* memory, Options options)
    : disk_(disk), memory_(memory), options_(std::move(options)), thread_([this] { work(); }, kStack) {}

Freezer::~Freezer() {
  if (thread_.joinable()) finish();
}

/// Takes it into what waits, if it is close enough.
bool Freezer::joins(const Cause& cause, Frozen& other) const {
  const int64_t first_ns = std::min(other.first_ns, cause.at_ns), last_ns = std::max(other.last_ns, cause.at_ns);
  if (other.begun || last_ns - first_ns > options_.after_ns) return false;
  other.first_ns = first_ns, other.last_ns = last_ns;
  const auto same = [&](const Cause& known) { return known.kind == cause.kind && known.subject == cause.subject; };
  const bool known = same(other.cause) || std::any_of(other.also.begin(), other.also.end(), same);
  if (known || other.also.size() == kMostAlso) ++other.more;
  else other.also.push_back(cause);
  return true;
}

void Freezer::freeze(Cause cause) {
  const std::lock_guard lock(mutex_);
  if (std::any_of(waiting_.begin(), waiting_.end(), [&](Frozen& other) { return joins(cause, other); })) return;
  Frozen frozen;
  frozen.first_ns = frozen.last_ns = cause.at_ns;
  frozen.cause = std::move(cause);
  if (waiting_.size() < kMostWaiting) {
    waiting_.push_back(std::move(frozen));
    changed_.notify_one();
    return;
  }
  frozen.refused = fmt::format("{} others wait to be written", kMostWaiting);
  done_.push_back(std::move(frozen));
}

std::vector<Frozen> Freezer::finish() {
  {
    const std::lock_guard lock(mutex_);
    ending_ = true;
    end_by_ = std::chrono::steady_clock::now() + options_.patience;
    changed_.notify_one();
  }
  thread_.join();
  return std::move(done_);
}

bool Freezer::ready(const Frozen& frozen) {
  const int64_t to_ns = frozen.last_ns + options_.after_ns;
  const auto has = [&](record::Ring* ring) {
    if (ring == nullptr) return true;
    const auto files = ring->files();
    if (files.empty() || files.back().began_ns >= to_ns) return !files.empty();
    if (files.back().ended_ns >= to_ns) ring->part();
    return false;
  };
  const bool on_disk = has(&disk_);
  return has(memory_) && on_disk;
}

void Freezer::work() {
  keep_rights(Rights::none);
  setpriority(PRIO_PROCESS, static_cast<id_t>(gettid()), 19);
  std::unique_lock lock(mutex_);
  for (;;) {
    changed_.wait_for(lock, kLook, [&] { return ending_; });
    while (!waiting_.empty() && (ending_ || ready(waiting_.front()))) {
      waiting_.front().begun = true;
      Frozen frozen = waiting_.front();
      const bool too_late = ending_ && std::chrono::steady_clock::now() >= end_by_;
      lock.unlock();
      if (too_late)
        frozen.refused = fmt::format("it was not written within {} s of the run's end", options_.patience.count());
      else write(frozen);
      lock.lock();
      waiting_.pop_front();
      done_.push_back(frozen);
      lock.unlock();
      if (options_.told) options_.told(frozen);
      lock.lock();
    }
    if (ending_ && waiting_.empty()) return;
  }
}

std::vector<fs::path> Freezer::files_for(int64_t from_ns, int64_t to_ns) const {
  std::vector<record::Ring::File> found;
  for (const record::Ring* ring : std::initializer_list<const record::Ring*>{&disk_, memory_}) {
    if (ring == nullptr) continue;
    const auto files = ring->files();
    for (size_t i = 0; i < files.size(); ++i) {
      const bool newest = i + 1 == files.size(), of_this_run = newest || files[i].ended_ns > 0;
      if (of_this_run && files[i].began_ns < to_ns && (newest || files[i].ended_ns >= from_ns))
        found.push_back(files[i]);
    }
  }
  std::stable_sort(found.begin(), found.end(), [](const auto& a, const auto& b) { return a.began_ns < b.began_ns; });
  std::vector<fs::path> paths;
  for (const auto& file : found) paths.push_back(file.path);
  return paths;
}

std::string Freezer::make_room() {
  std::error_code error;
  fs::create_directories(options_.folder, error);
  if (error) return fmt::format("{}: {}", options_.folder.string(), error.message());
  const auto files = record::records_in(options_.folder);
  uint64_t bytes = 0;
  for (const auto& file : files) bytes += file.bytes;
  size_t gone = 0;
  // A file may take as much as both rings hold.
  const uint64_t needed = disk_.bytes() + (memory_ != nullptr ? memory_->bytes() : 0);
  while (bytes + needed > options_.most_bytes && files.size() - gone > options_.at_least) {
    bytes -= files[gone].bytes;
    fs::remove(files[gone++].path, error);
  }
  return "";
}

void Freezer::write(Frozen& frozen) {
  const int64_t from_ns = frozen.first_ns - options_.before_ns, to_ns = frozen.last_ns + options_.after_ns;
  if (frozen.refused = make_room(); !frozen.refused.empty()) return;
  const fs::path file = options_.folder / fmt::format("{}-{:04}-{}.mcap", options_.name, ++number_, frozen.cause.kind);
  const fs::path part = file.string() + ".part";
  auto sink = mcap::FileSink::open(part);
  if (!sink) {
    frozen.refused = sink.error();
    return;
  }
  record::JoinOptions how;
  how.from_ns = from_ns - options_.lead_ns;
  how.to_ns = to_ns;
  how.edges = options_.edges;
  const Said said = options_.say ? options_.say(frozen.cause, how.from_ns, to_ns) : Said{frozen.cause.what, {}, {}};
  frozen.sentence = said.sentence;
  const auto attach = [&](const char* name, const std::string& text) {
    if (!text.empty()) how.attachments.push_back({0, 0, name, "application/json", mcap::bytes_of(text)});
  };
  attach("trace.json", said.trace);
  attach("report.json", said.report);
  how.metadata.push_back({"takt frozen",
                          {{"kind", frozen.cause.kind},
                           {"subject", frozen.cause.subject},
                           {"what", frozen.cause.what},
                           {"also", also_text(frozen)},
                           {"sentence", said.sentence},
                           {"at_ns", std::to_string(frozen.cause.at_ns)},
                           {"from_ns", std::to_string(from_ns)},
                           {"to_ns", std::to_string(to_ns)}}});
  const std::vector<fs::path> files = files_for(how.from_ns, to_ns);
  how.older = files_for(how.from_ns - kStandsFor_ns, to_ns);
  std::erase_if(how.older,
                [&](const fs::path& older) { return std::find(files.begin(), files.end(), older) != files.end(); });
  const auto joined = record::join(files, *sink, how);
  std::error_code error;
  if (joined) fs::rename(part, file, error);
  if (!joined || error) {
    frozen.refused = joined ? fmt::format("{}: {}", file.string(), error.message()) : joined.error();
    fs::remove(part, error);
    return;
  }
  frozen.file = file;
  frozen.bytes = joined->bytes;
  frozen.damages = joined->damages;
}

}  // namespace takt::flight
