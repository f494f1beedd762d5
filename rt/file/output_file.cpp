// SPDX-License-Identifier: Apache-2.0
#include "rt/file/output_file.hpp"

#include <fcntl.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstring>
#include <utility>

#include "rt/file/lock_holder.hpp"

namespace takt {
namespace {

tl::unexpected<OutputFailure> failure(const std::filesystem::path& file, int reason) {
  constexpr std::array kSystem{ENOSPC, EDQUOT, EFBIG, EIO, EPIPE, EMFILE, ENFILE, ENOMEM};
  const bool system = std::find(kSystem.begin(), kSystem.end(), reason) != kSystem.end();
  return tl::unexpected(OutputFailure{file.string() + ": " + std::strerror(reason), system});
}

tl::unexpected<OutputFailure> taken(const std::filesystem::path& file, const std::filesystem::path& locked) {
  const auto holder = lock_holder(locked, "/proc/locks");
  const std::string who = !holder               ? "another process"
                          : *holder == getpid() ? "this command itself, for another option,"
                                                : "process " + std::to_string(*holder);
  return tl::unexpected(OutputFailure{file.string() + ": " + who + " writes to it", false});
}

/// What the shell hands over, and devices: there is nothing to be renamed.
bool written_directly(const std::filesystem::path& file, const struct stat& facts) {
  const std::string name = file.lexically_normal().string();
  return name.starts_with("/dev/") || name.starts_with("/proc/self/fd/") || S_ISCHR(facts.st_mode);
}

/// Where the file itself lies: a link stays a link.
std::filesystem::path behind_links(const std::filesystem::path& file) {
  std::error_code none;
  const auto target = std::filesystem::is_symlink(file, none) ? std::filesystem::weakly_canonical(file, none) : file;
  return none || target.empty() ? file : target;
}

/// The file of that name in the folder is the one that is open.
bool same_file(int folder, const char* name, int descriptor) {
  struct stat named {
  }, open{};
  return fstatat(folder, name, &named, AT_SYMLINK_NOFOLLOW) == 0 && fstat(descriptor, &open) == 0 &&
         named.st_ino == open.st_ino && named.st_dev == open.st_dev;
}

}  // namespace

WriterLock::WriterLock(WriterLock&& other) noexcept
    : descriptor_(std::exchange(other.descriptor_, -1)), made_(std::move(other.made_)) {}

WriterLock::~WriterLock() {
  if (descriptor_ < 0) return;
  struct stat facts {};
  if (!made_.empty() && fstat(descriptor_, &facts) == 0 && facts.st_size == 0 &&
      same_file(AT_FDCWD, made_.c_str(), descriptor_))
    unlink(made_.c_str());
  close(descriptor_);
}

tl::expected<WriterLock, OutputFailure> WriterLock::of_folder(const std::filesystem::path& folder) {
  const int descriptor = open(folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC);
  if (descriptor < 0) return failure(folder, errno);
  WriterLock lock(descriptor);
  if (flock(descriptor, LOCK_EX | LOCK_NB) != 0 && errno == EWOULDBLOCK) return taken(folder, folder);
  return lock;
}

tl::expected<WriterLock, OutputFailure> WriterLock::of_file(const std::filesystem::path& file) {
  struct stat facts {};
  const bool there = stat(file.c_str(), &facts) == 0;
  if (there && S_ISFIFO(facts.st_mode) && !written_directly(file, facts))
    return tl::unexpected(OutputFailure{file.string() + ": is a named pipe, a file is expected", false});
  const int descriptor = open(file.c_str(), O_WRONLY | O_CREAT | O_CLOEXEC | O_NONBLOCK, 0644);
  if (descriptor < 0) return failure(file, errno);
  WriterLock lock(descriptor);
  if (!there) lock.made_ = file;
  if (there && written_directly(file, facts)) return lock;
  if (flock(descriptor, LOCK_EX | LOCK_NB) != 0 && errno == EWOULDBLOCK) {
    lock.made_.clear();  // whoever has it made it
    return taken(file, file);
  }
  return lock;
}

/// Writes to the descriptor; remembers the first reason why something was not written.
struct OutputFile::Open final : std::streambuf {
  Open(std::filesystem::path asked, int at) : file(std::move(asked)), descriptor(at) {
    setp(buffer.data(), buffer.data() + buffer.size());
  }
  Open(const Open&) = delete;
  Open& operator=(const Open&) = delete;
  ~Open() override {
    if (!part.empty() && same_file(folder, part.c_str(), descriptor)) unlinkat(folder, part.c_str(), 0);
    if (descriptor >= 0) close(descriptor);
    if (folder >= 0) close(folder);
  }
  int_type overflow(int_type c) override {
    if (sync() != 0) return traits_type::eof();
    if (!traits_type::eq_int_type(c, traits_type::eof())) sputc(traits_type::to_char_type(c));
    return traits_type::not_eof(c);
  }
  int sync() override {
    for (const char* at = pbase(); at < pptr() && reason == 0;) {
      const ssize_t written = write(descriptor, at, static_cast<size_t>(pptr() - at));
      if (written < 0 && errno == EINTR) continue;
      if (written <= 0) reason = written < 0 ? errno : ENOSPC;
      else at += written;
    }
    setp(buffer.data(), buffer.data() + buffer.size());
    return reason == 0 ? 0 : -1;
  }

  std::filesystem::path file;
  int descriptor, folder = -1, reason = 0;
  std::string part, name;  ///< in the folder; no part: it is written directly
  std::array<char, 65536> buffer{};
  std::ostream out{this};
};

namespace {

/// The descriptor of the part in that folder, which no other process has; or -1 and why in errno, EWOULDBLOCK: it has.
int open_part(int folder, const std::string& part, mode_t mode) {
  for (int tries = 0; tries < 100; ++tries) {
    const int descriptor = openat(folder, part.c_str(), O_WRONLY | O_CREAT | O_CLOEXEC | O_NOFOLLOW | O_NONBLOCK, mode);
    if (descriptor < 0) return -1;
    if (flock(descriptor, LOCK_EX | LOCK_NB) != 0 && errno == EWOULDBLOCK) {
      close(descriptor);
      errno = EWOULDBLOCK;
      return -1;
    }
    // Its owner may have renamed it between the two calls.
    if (same_file(folder, part.c_str(), descriptor)) {
      if (ftruncate(descriptor, 0) == 0) return descriptor;
    }
    close(descriptor);
  }
  errno = EWOULDBLOCK;
  return -1;
}

}  // namespace

OutputFile::OutputFile(std::unique_ptr<Open> made) : open_(std::move(made)) {}
OutputFile::OutputFile(OutputFile&&) noexcept = default;
OutputFile& OutputFile::operator=(OutputFile&&) noexcept = default;
OutputFile::~OutputFile() = default;

tl::expected<OutputFile, OutputFailure> OutputFile::claim(const std::filesystem::path& file) {
  const auto not_a_file = [&](const char* what) {
    return tl::unexpected(OutputFailure{file.string() + ": " + what + ", a file is expected", false});
  };
  struct stat facts {};
  const bool there = stat(file.c_str(), &facts) == 0;
  if (there && S_ISDIR(facts.st_mode)) return not_a_file("is a folder");
  if (there && written_directly(file, facts)) {
    const int descriptor = open(file.c_str(), O_WRONLY | O_CLOEXEC | O_APPEND);
    if (descriptor < 0) return failure(file, errno);
    return OutputFile(std::make_unique<Open>(file, descriptor));
  }
  if (there && !S_ISREG(facts.st_mode)) return not_a_file(S_ISFIFO(facts.st_mode) ? "is a named pipe" : "is a device");
  const auto place = behind_links(file);
  if (there) {  // a record that is being written has its lock on the file itself
    if (access(place.c_str(), W_OK) != 0) return failure(file, errno);
    const auto unlocked = WriterLock::of_file(place);
    if (!unlocked) return tl::unexpected(unlocked.error());
  }
  const auto parent = place.has_parent_path() ? place.parent_path() : std::filesystem::path(".");
  const int folder = open(parent.c_str(), O_PATH | O_DIRECTORY | O_CLOEXEC);
  if (folder < 0) return failure(file, errno);
  const std::string name = place.filename().string(), part = name + ".part";
  if (name.empty()) {
    close(folder);
    return not_a_file("is a folder");
  }
  const int descriptor = open_part(folder, part, there ? facts.st_mode & 0777 : 0644);
  const int reason = errno;
  auto made = std::make_unique<Open>(file, descriptor);
  made->folder = folder;
  if (descriptor < 0 && reason == EWOULDBLOCK) return taken(file, parent / part);
  if (descriptor < 0) return failure(file, reason);
  made->name = name;
  made->part = part;
  return OutputFile(std::move(made));
}

const std::filesystem::path& OutputFile::file() const { return open_->file; }

std::filesystem::path OutputFile::part() const {
  const auto place = behind_links(open_->file);
  return open_->part.empty() ? std::filesystem::path() : place.parent_path() / open_->part;
}

std::ostream& OutputFile::stream() { return open_->out; }

tl::expected<void, OutputFailure> OutputFile::finish() {
  const std::unique_ptr<Open> whole = std::move(open_);
  whole->out.flush();
  int reason = whole->reason;
  if (reason == 0 && !whole->out) reason = EIO;
  // Some file systems tell only now that there is no room.
  if (reason == 0 && fsync(whole->descriptor) != 0 && errno != EINVAL && errno != EROFS) reason = errno;
  if (reason != 0) return failure(whole->file, reason);
  if (whole->part.empty()) return {};
  if (renameat(whole->folder, whole->part.c_str(), whole->folder, whole->name.c_str()) != 0)
    return failure(whole->file, errno);
  whole->part.clear();
  return {};
}

tl::expected<void, OutputFailure> write_file(const std::filesystem::path& file, std::string_view content) {
  auto out = OutputFile::claim(file);
  if (!out) return tl::unexpected(out.error());
  out->stream() << content;
  return out->finish();
}

}  // namespace takt
