// SPDX-License-Identifier: Apache-2.0
#include <dirent.h>
#include <fcntl.h>
#include <sched.h>
#include <signal.h>
#include <sys/mount.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstdlib>
#include <cstring>
#include <ctime>
#include <map>
#include <set>
#include <utility>

#include "rt/trace/ftrace_page.hpp"
#include "rt/trace/switch_source.hpp"

namespace takt::trace {
namespace {

constexpr const char* kBufferKb = "2048";                     // per CPU: some seconds of switches
constexpr int kBufferPages = 512;                             // the same, in pages of 4 kB
constexpr size_t kLargestFilter = 3500;                       // the kernel takes a page of text
constexpr int64_t kStateMask = 0xff, kPreemptedFlag = 0x200;  // TASK_REPORT, TASK_REPORT_MAX << 1

/// A file descriptor that closes itself.
class File {
 public:
  explicit File(int fd = -1) : fd_(fd) {}
  ~File() {
    if (fd_ >= 0) close(fd_);
  }
  File(File&& other) noexcept : fd_(std::exchange(other.fd_, -1)) {}
  File& operator=(File&& other) noexcept {
    std::swap(fd_, other.fd_);
    return *this;
  }
  int get() const { return fd_; }
  explicit operator bool() const { return fd_ >= 0; }

 private:
  int fd_;
};

std::string problem(const std::string& what) { return what + ": " + std::strerror(errno); }

/// tracefs on a mount that stands nowhere: nothing is left behind, whatever becomes of this process.
File mount_tracefs() {
  const File context(fsopen("tracefs", FSOPEN_CLOEXEC));
  if (!context || fsconfig(context.get(), FSCONFIG_CMD_CREATE, nullptr, nullptr, 0) != 0) return File();
  return File(fsmount(context.get(), FSMOUNT_CLOEXEC, 0));
}

std::string read_file(int folder, const std::string& path) {
  const File file(openat(folder, path.c_str(), O_RDONLY | O_CLOEXEC));
  std::string text;
  std::array<char, 4096> buffer{};
  for (ssize_t got = 0; file && (got = read(file.get(), buffer.data(), buffer.size())) > 0;)
    text.append(buffer.data(), static_cast<size_t>(got));
  return text;
}

bool write_file(int folder, const std::string& path, std::string_view text) {
  const File file(openat(folder, path.c_str(), O_WRONLY | O_TRUNC | O_CLOEXEC));
  return file && write(file.get(), text.data(), text.size()) == static_cast<ssize_t>(text.size());
}

/// Instances of takt processes that were killed.
void remove_leftovers(int instances) {
  const int copy = dup(instances);
  DIR* folder = fdopendir(copy);
  if (folder == nullptr) {
    close(copy);
    return;
  }
  std::vector<std::string> names;
  while (const dirent* entry = readdir(folder))
    if (std::strncmp(entry->d_name, "takt-", 5) == 0) names.emplace_back(entry->d_name);
  closedir(folder);
  for (const std::string& name : names)
    if (const int owner = std::atoi(name.c_str() + 5); owner > 0 && kill(owner, 0) != 0 && errno == ESRCH)
      unlinkat(instances, name.c_str(), AT_REMOVEDIR);
}

/// A folder below instances/ that removes itself.
class Instance {
 public:
  bool make(int tracefs) {
    instances_ = File(openat(tracefs, "instances", O_RDONLY | O_DIRECTORY | O_CLOEXEC));
    if (!instances_) return false;
    remove_leftovers(instances_.get());
    name_ = "takt-" + std::to_string(getpid());
    if (mkdirat(instances_.get(), name_.c_str(), 0700) != 0) {
      name_.clear();
      return false;
    }
    folder_ = File(openat(instances_.get(), name_.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC));
    return static_cast<bool>(folder_);
  }
  ~Instance() {
    if (name_.empty()) return;
    if (folder_) write_file(folder_.get(), "tracing_on", "0");
    folder_ = File();
    unlinkat(instances_.get(), name_.c_str(), AT_REMOVEDIR);
  }
  Instance() = default;
  Instance(const Instance&) = delete;
  Instance& operator=(const Instance&) = delete;
  int folder() const { return folder_.get(); }

 private:
  File instances_, folder_;
  std::string name_;
};

/// The calling thread stays on that CPU while this lives.
class OnCpu {
 public:
  explicit OnCpu(int cpu) {
    cpu_set_t one;
    CPU_ZERO(&one);
    CPU_SET(static_cast<size_t>(cpu), &one);
    moved_ = sched_getaffinity(0, sizeof before_, &before_) == 0 && sched_setaffinity(0, sizeof one, &one) == 0;
  }
  ~OnCpu() {
    if (moved_) sched_setaffinity(0, sizeof before_, &before_);
  }
  OnCpu(const OnCpu&) = delete;
  OnCpu& operator=(const OnCpu&) = delete;

 private:
  cpu_set_t before_;
  bool moved_ = false;
};

struct Formats {
  uint16_t switch_id = 0, waking_id = 0;
  Field type, prev_pid, prev_state, next_comm, next_pid, next_prio, woken_pid;
  size_t data_offset = 16, page_bytes = 4096;

  bool read(int tracefs) {
    const std::string page = read_file(tracefs, "events/header_page");
    const std::string switching = read_file(tracefs, "events/sched/sched_switch/format");
    const std::string waking = read_file(tracefs, "events/sched/sched_waking/format");
    const auto set = [](auto& into, const auto& found) {
      if (found) into = *found;
      return found.has_value();
    };
    Field data;
    const bool found =
        set(data, find_field(page, "data")) && set(switch_id, find_id(switching)) && set(waking_id, find_id(waking)) &&
        set(type, find_field(switching, "common_type")) && set(prev_pid, find_field(switching, "prev_pid")) &&
        set(prev_state, find_field(switching, "prev_state")) && set(next_comm, find_field(switching, "next_comm")) &&
        set(next_pid, find_field(switching, "next_pid")) && set(next_prio, find_field(switching, "next_prio")) &&
        set(woken_pid, find_field(waking, "pid"));
    data_offset = data.offset;
    page_bytes = data.offset + data.size;
    return found;
  }
};

class TracefsSource final : public SwitchSource {
 public:
  /// False, and why, if this machine does not grant it.
  bool open(std::span<const int> cpus, std::string& why_not) {
    const File tracefs = mount_tracefs();
    if (!tracefs) return why_not = problem("tracefs cannot be mounted"), false;
    if (!formats_.read(tracefs.get())) return why_not = "tracefs: no sched_switch, sched_waking in this kernel", false;
    if (!instance_.make(tracefs.get())) return why_not = problem("tracefs: no instance of its own"), false;
    const int folder = instance_.folder();
    const bool set = write_file(folder, "trace_clock", "mono") && write_file(folder, "buffer_size_kb", kBufferKb) &&
                     write_file(folder, "events/sched/sched_switch/enable", "1") &&
                     write_file(folder, "events/sched/sched_waking/enable", "1");
    if (!set) return why_not = problem("tracefs: clock, buffer or events"), false;
    for (const int cpu : cpus) {
      const std::string path = "per_cpu/cpu" + std::to_string(cpu) + "/trace_pipe_raw";
      pipes_.push_back({File(openat(folder, path.c_str(), O_RDONLY | O_NONBLOCK | O_CLOEXEC)), cpu});
      if (!pipes_.back().file) return why_not = problem("tracefs: " + path), false;
    }
    if (pipes_.empty()) return why_not = "tracefs: no CPU to look at", false;
    page_.resize(formats_.page_bytes);
    return sees_itself(why_not);
  }

  Source kind() const override { return Source::tracefs; }

  void follow(std::span<const int32_t> threads) override {
    followed_.insert(threads.begin(), threads.end());
    std::string filter;
    for (const int32_t thread : followed_)
      filter += (filter.empty() ? "pid == " : " || pid == ") + std::to_string(thread);
    // Wakings of others would only fill the buffer; they are not kept in either case.
    if (!filter.empty() && filter.size() < kLargestFilter)
      write_file(instance_.folder(), "events/sched/sched_waking/filter", filter);
  }

  void drain(Switches& into) override {
    for (Pipe& pipe : pipes_) {
      // No more than a full buffer: where reading itself makes switches (a debugger), there would be no end.
      int pages = kBufferPages;
      for (ssize_t got = 0; pages-- > 0 && (got = read(pipe.file.get(), page_.data(), page_.size())) > 0;) {
        lost_ += for_each_record(std::span(page_.data(), static_cast<size_t>(got)), formats_.data_offset,
                                 [&](int64_t at, std::span<const std::byte> record) { take(pipe, at, record, into); });
      }
    }
  }

  void finish(int64_t now_ns, Switches& into) override {
    for (Pipe& pipe : pipes_) close_slice(pipe, now_ns, Slice::End::open, into);
  }

  uint64_t lost() const override { return lost_; }

 private:
  struct Pipe {
    File file;
    int cpu = -1;
    Slice running = {};  ///< thread 0: nobody, or not known
    bool seen = false;   ///< any switch so far: whom the next one comes from is then known
  };

  void take(Pipe& pipe, int64_t at, std::span<const std::byte> record, Switches& into) {
    const auto type = static_cast<uint16_t>(read_field(record, formats_.type));
    if (type == formats_.waking_id) {
      const auto thread = static_cast<int32_t>(read_field(record, formats_.woken_pid));
      if (followed_.count(thread) != 0) into.wakings.push_back({at, thread});
      return;
    }
    if (type != formats_.switch_id) return;
    const int64_t state = read_field(record, formats_.prev_state);
    const bool preempted = (state & kStateMask) == 0 || (state & kPreemptedFlag) != 0;
    const bool known = pipe.running.thread == static_cast<int32_t>(read_field(record, formats_.prev_pid));
    if (!known && pipe.seen) ++lost_;  // at least one switch in between was not shown
    pipe.seen = true;
    if (known) close_slice(pipe, at, preempted ? Slice::End::preempted : Slice::End::asleep, into);
    Slice& slice = pipe.running = {};
    slice.thread = static_cast<int32_t>(read_field(record, formats_.next_pid));
    slice.priority = static_cast<int32_t>(read_field(record, formats_.next_prio));
    slice.from_ns = at;
    slice.cpu = pipe.cpu;
    if (slice.thread != 0) slice.name = into.name(read_text(record, formats_.next_comm));
  }

  static void close_slice(Pipe& pipe, int64_t at, Slice::End end, Switches& into) {
    if (pipe.running.thread == 0) return;
    pipe.running.to_ns = at;
    pipe.running.end = end;
    into.slices.push_back(pipe.running);
    pipe.running = {};
  }

  /// Process ids in a container are not those of the kernel: then our threads would never be recognised. Some kernels
  /// also stop recording what an idle CPU switches to (after a fault in a tracer, until the next boot): then no stretch
  /// on that CPU has a beginning. On a CPU that others keep busy the latter shows only later, in `lost`.
  bool sees_itself(std::string& why_not) {
    for (const Pipe& pipe : pipes_) {
      if (sees_itself_on(pipe.cpu)) continue;
      why_not = "tracefs: it does not show this process on cpu " + std::to_string(pipe.cpu) +
                " (a container with process ids of its own, or a kernel that drops what an idle CPU switches to?)";
      return false;
    }
    return true;
  }

  bool sees_itself_on(int cpu) {
    constexpr int kWakes = 5, kMostWakes = 20;  // the fewer, the likelier that the CPU was never idle before one
    const OnCpu here(cpu);
    Switches seen;
    bool itself = false;
    for (int wake = 0; wake < (itself ? kWakes : kMostWakes) && lost_ == 0; ++wake) {
      const timespec pause{0, 2'000'000};
      nanosleep(&pause, nullptr);
      drain(seen);
      itself = std::any_of(seen.slices.begin(), seen.slices.end(),
                           [&](const Slice& s) { return s.thread == gettid() && s.cpu == cpu; });
    }
    return itself && lost_ == 0;
  }

  Instance instance_;  ///< goes after the files in it
  Formats formats_;
  std::vector<Pipe> pipes_;
  std::vector<std::byte> page_;
  std::set<int32_t> followed_;
  uint64_t lost_ = 0;
};

}  // namespace

uint32_t Switches::name(std::string_view text) {
  // Few names, and mostly the last ones again.
  const auto found = std::find(names.rbegin(), names.rend(), text);
  if (found != names.rend()) return static_cast<uint32_t>(names.rend() - found - 1);
  names.emplace_back(text);
  return static_cast<uint32_t>(names.size() - 1);
}

std::unique_ptr<SwitchSource> open_tracefs(std::span<const int> cpus, std::string& why_not) {
  auto source = std::make_unique<TracefsSource>();
  return source->open(cpus, why_not) ? std::move(source) : nullptr;
}

}  // namespace takt::trace
