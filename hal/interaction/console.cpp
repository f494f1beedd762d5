// SPDX-License-Identifier: Apache-2.0
#include "hal/interaction/console.hpp"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>

namespace takt {
namespace {

constexpr std::string_view kBlank = " \t\r";

std::string_view content(std::string_view line) {
  line = line.substr(0, line.find('#'));
  const size_t first = line.find_first_not_of(kBlank);
  return first == std::string_view::npos ? "" : line.substr(first, line.find_last_not_of(kBlank) + 1 - first);
}

}  // namespace

DeviceResult Console::open() {
  if (in_) return {};
  struct stat facts {};
  if (stat(settings_.input.c_str(), &facts) != 0)
    return device_error(id_, settings_.input + ": " + std::strerror(errno),
                        "name a terminal, a FIFO (mkfifo " + settings_.input + ") or a file in `input`");
  // Open for writing as well a FIFO has no end when a writer leaves it; somebody's standard input may be for reading
  // alone.
  const int own = O_NONBLOCK | O_CLOEXEC | O_NOCTTY;
  if (S_ISFIFO(facts.st_mode)) in_ = Descriptor(::open(settings_.input.c_str(), O_RDWR | own));
  if (!in_) in_ = Descriptor(::open(settings_.input.c_str(), O_RDONLY | own));
  terminal_ = in_ && isatty(in_.get()) != 0;
  out_ = Descriptor(::open(settings_.output.c_str(), O_WRONLY | O_APPEND | O_CREAT | own, 0644));
  if (!in_ || !out_) {
    const std::string which = in_ ? settings_.output : settings_.input, why = std::strerror(errno);
    close();
    return device_error(id_, which + ": " + why, "name what this user may open in `input` and `output`");
  }
  return {};
}

void Console::close() {
  started_ = false;
  in_.close();
  out_.close();
}

DeviceResult Console::start(int64_t) {
  count_ = 0;
  skipping_ = false;
  started_ = static_cast<bool>(in_);
  return {};
}

bool Console::restart(int64_t now_ns) {
  close();
  return open().has_value() && start(now_ns).has_value();
}

DeclaredCalls Console::declared_calls() const {
  return {
      bit(JobCall::file) | bit(JobCall::socket) | bit(JobCall::malloc),
      "reads what somebody typed and prints what is said to him, without waiting; opens a terminal that was hung up"};
}

/// False: hung up.
bool Console::fill() {
  const auto got = in_.read({reinterpret_cast<uint8_t*>(bytes_.data()) + count_, bytes_.size() - count_});
  count_ += got.value_or(0);
  return got || !terminal_;
}

/// The next line that holds a task.
bool Console::take_line(int64_t at_ns) {
  for (;;) {
    const std::string_view all(bytes_.data(), count_);
    const size_t end = all.find('\n');
    if (end == std::string_view::npos) {
      if (count_ < bytes_.size()) return false;
      count_ = 0;  // longer than any task
      skipping_ = true;
      return false;
    }
    const std::string_view line = content(all.substr(0, end));
    const bool whole = !std::exchange(skipping_, false) && line.size() <= task_.size();
    const bool taken = whole && !line.empty();
    if (taken) {
      task_size_ = line.copy(task_.data(), task_.size());
      ++number_;
      stamp_ns_ = at_ns;
    }
    std::copy(bytes_.begin() + static_cast<ptrdiff_t>(end) + 1, bytes_.begin() + static_cast<ptrdiff_t>(count_),
              bytes_.begin());
    count_ -= end + 1;
    if (!whole) say("a task has 240 characters at most; this one is not taken");
    if (taken) return true;
  }
}

InteractionReading Console::read(int64_t wanted_ns) {
  InteractionReading reading;
  if (!started_) return reading;
  if (!fill()) {
    reading.status = ReadStatus::disconnected;
    return reading;
  }
  take_line(wanted_ns);
  return {ReadStatus::ok, wanted_ns, number_, {task_.data(), task_size_}};
}

bool Console::say(std::string_view text) {
  if (!out_) return false;
  std::array<char, 512> line;
  for (size_t at = 0; at < text.size();) {
    size_t used = text.copy(line.data(), line.size() - 1, at);
    at += used;
    if (at == text.size()) line[used++] = '\n';
    if (!out_.write({reinterpret_cast<const uint8_t*>(line.data()), used})) return false;
  }
  return true;
}

}  // namespace takt
