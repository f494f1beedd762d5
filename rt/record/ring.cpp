// SPDX-License-Identifier: Apache-2.0
#include "rt/record/ring.hpp"

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <optional>
#include <system_error>
#include <utility>

namespace takt::record {
namespace fs = std::filesystem;
namespace {

constexpr int kDigits = 6;  ///< at least, of the number of a file

}  // namespace

std::vector<RingFile> records_in(const fs::path& folder) {
  std::vector<std::pair<fs::file_time_type, RingFile>> found;
  std::error_code error;
  for (const fs::directory_entry& entry : fs::directory_iterator(folder, error))
    if (entry.path().extension() == ".mcap" && entry.is_regular_file(error))
      found.push_back({entry.last_write_time(error), {entry.path(), 0, 0, entry.file_size(error)}});
  std::sort(found.begin(), found.end(), [](const auto& a, const auto& b) {
    return std::pair(a.first, a.second.path) < std::pair(b.first, b.second.path);
  });
  std::vector<RingFile> files;
  for (auto& [written, file] : found) files.push_back(std::move(file));
  return files;
}

RingName name_of(const fs::path& file) {
  const std::string name = file.stem().string();
  const size_t number_at = name.rfind('-') + 1;
  if (file.extension() != ".mcap" || number_at < 2 || name.size() < number_at + kDigits ||
      name.find_first_not_of("0123456789", number_at) != std::string::npos)
    return {};
  return {name.substr(0, number_at - 1), std::strtoull(name.c_str() + number_at, nullptr, 10)};
}

/// The newest file. It is made with its first bytes, so that a disk that is gone and comes back is asked again.
class Ring::Sink final : public mcap::Sink {
 public:
  Sink(Ring& ring, fs::path path) : ring_(ring), path_(std::move(path)) {}

  tl::expected<void, std::string> append(std::span<const mcap::Bytes> parts) override {
    uint64_t bytes = 0;
    for (const mcap::Bytes part : parts) bytes += part.size();
    if (!ring_.make_room(bytes))
      return tl::unexpected(path_.string() + ": the folder may take " + std::to_string(ring_.limits_.bytes) + " bytes");
    if (!file_) {
      std::error_code error;
      fs::create_directories(path_.parent_path(), error);  // somebody may have cleared it away
      auto opened = mcap::FileSink::open(path_);
      if (!opened) return tl::unexpected(opened.error());
      file_.emplace(std::move(*opened));
    }
    auto done = file_->append(parts);
    if (done) ring_.grow(bytes);
    return done;
  }
  mcap::Writer::Done settle() const {
    if (!file_) return {};
    auto done = file_->still_there();
    if (done && ring_.limits_.durable) done = file_->settle();
    return done ? done : tl::unexpected(path_.string() + ": " + done.error());
  }

 private:
  Ring& ring_;
  const fs::path path_;
  std::optional<mcap::FileSink> file_;
};

tl::expected<std::unique_ptr<Ring>, std::string> Ring::open(const fs::path& folder, std::string name,
                                                            RingLimits limits) {
  std::error_code error;
  fs::create_directories(folder, error);
  if (error) return tl::unexpected(folder.string() + ": " + error.message());
  limits.bytes = std::max(limits.bytes, RingLimits::kLeastBytes);
  limits.split_bytes = std::min(limits.split_bytes, limits.bytes / 8);
  std::unique_ptr<Ring> ring(new Ring(folder, std::move(name), limits));
  for (File& left : records_in(folder)) {
    ring->bytes_ += left.bytes;
    ring->files_.push_back(std::move(left));
  }
  ring->make_room(0);
  return ring;
}

Ring::Ring(fs::path folder, std::string name, RingLimits limits)
    : folder_(std::move(folder)), name_(std::move(name)), limits_(limits) {}

Ring::~Ring() = default;

mcap::Sink* Ring::next(int64_t at_ns) {
  part_.store(false);
  const std::lock_guard lock(mutex_);
  if (!files_.empty() && sink_ != nullptr && files_.back().bytes == 0) files_.pop_back();  // nothing could be written
  while (!files_.empty() && files_.front().ended_ns > 0 && files_.front().ended_ns < at_ns - limits_.age_ns)
    if (!drop_oldest()) break;
  char number[32];
  std::snprintf(number, sizeof number, "-%0*llu.mcap", kDigits, static_cast<unsigned long long>(++number_));
  files_.push_back({folder_ / (name_ + number), at_ns, at_ns, 0});
  sink_ = std::make_unique<Sink>(*this, files_.back().path);
  return sink_.get();
}

bool Ring::ends(uint64_t bytes, int64_t began_ns, int64_t at_ns) const {
  return part_.load() || bytes >= limits_.split_bytes || at_ns - began_ns >= limits_.split_ns;
}

mcap::Writer::Done Ring::settle(int64_t at_ns) {
  auto done = sink_ != nullptr ? sink_->settle() : mcap::Writer::Done{};
  if (!done) part();  // a file of its own may fare better
  const std::lock_guard lock(mutex_);
  if (!files_.empty()) files_.back().ended_ns = std::max(files_.back().ended_ns, at_ns);
  return done;
}

bool Ring::make_room(uint64_t bytes) {
  const std::lock_guard lock(mutex_);
  const size_t in_hand = sink_ != nullptr ? 1 : 0;
  while (bytes_ + bytes > limits_.bytes)
    if (files_.size() <= in_hand || !drop_oldest()) return false;
  return true;
}

void Ring::grow(uint64_t bytes) {
  const std::lock_guard lock(mutex_);
  files_.back().bytes += bytes;
  bytes_ += bytes;
  most_bytes_ = std::max(most_bytes_, bytes_);
}

bool Ring::drop_oldest() {
  std::error_code error;
  fs::remove(files_.front().path, error);
  if (error) return false;  // it still takes its room
  bytes_ -= files_.front().bytes;
  files_.pop_front();
  ++dropped_;
  return true;
}

std::vector<Ring::File> Ring::files() const {
  const std::lock_guard lock(mutex_);
  return {files_.begin(), files_.end()};
}

uint64_t Ring::bytes() const {
  const std::lock_guard lock(mutex_);
  return bytes_;
}

uint64_t Ring::most_bytes() const {
  const std::lock_guard lock(mutex_);
  return most_bytes_;
}

uint64_t Ring::dropped() const {
  const std::lock_guard lock(mutex_);
  return dropped_;
}

}  // namespace takt::record
