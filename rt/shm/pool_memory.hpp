// SPDX-License-Identifier: Apache-2.0
// Where the pools of the local transport lie, and who may write there.
//
//   PoolFile file(7);                                  // before the fork; seven processes, numbered from 1
//   PoolMemory memory(file, {4096, 100, 921'600}, PoolMemory::Access::parts);
//   memory.allow_writing(0);                           // this process has what is in the first part
//   memory.at(2);                                      // read-only here
//
// A part is a piece of the file in pages of its own. Between two parts lies a page that nobody can touch, in the
// address space only: a store past the end of a part ends the process that makes it. Every other part is mapped through
// a descriptor that was opened for reading, so not even mprotect makes it writable.
#pragma once
#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

namespace takt {

/// The anonymous shared-memory file behind the pools. Processes forked while it exists can map it, too; it is gone when
/// the last of them is. Outlives what maps it.
class PoolFile {
 public:
  /// For processes with the numbers 1 to `processes`. Throws std::runtime_error if the kernel refuses.
  explicit PoolFile(uint32_t processes = 2);
  ~PoolFile();
  PoolFile(const PoolFile&) = delete;
  PoolFile& operator=(const PoolFile&) = delete;

  uint32_t processes() const { return processes_; }
  int descriptor() const { return writing_; }
  int for_reading() const { return reading_; }
  /// Gives it its size, for good: it can neither shrink nor grow afterwards. Throws std::runtime_error.
  void resize(uint64_t bytes) const;
  /// Its size. Throws std::runtime_error.
  uint64_t bytes() const;

 private:
  uint32_t processes_;
  int writing_ = -1, reading_ = -1;
};

/// The file as one process has it mapped. Not in a job; one thread at a time.
class PoolMemory {
 public:
  enum class Access {
    all,    ///< one mapping, all of it writable: the only process
    parts,  ///< read-only but for the parts that allow_writing() names
  };
  /// A part that can be written to while it lives, at another address.
  class Window {
   public:
    Window(void* memory, uint64_t bytes) : memory_(memory), bytes_(bytes) {}
    ~Window();
    Window(const Window&) = delete;
    Window& operator=(const Window&) = delete;
    std::byte* at() const { return static_cast<std::byte*>(memory_); }

   private:
    void* memory_;
    uint64_t bytes_;
  };

  /// Bytes that a file with these parts has; each is rounded up to whole pages.
  static uint64_t bytes(std::span<const uint64_t> parts);
  /// Maps the file, populated, so that no job takes the page fault. Throws std::runtime_error.
  PoolMemory(const PoolFile& file, std::span<const uint64_t> parts, Access access);
  ~PoolMemory();
  PoolMemory(const PoolMemory&) = delete;
  PoolMemory& operator=(const PoolMemory&) = delete;

  std::byte* at(size_t part) const { return memory_ + parts_[part].at; }
  /// From now on. Throws std::runtime_error.
  void allow_writing(size_t part);
  /// For what must be put in order in somebody else's part. Throws std::runtime_error.
  Window write(size_t part) const;

 private:
  struct Part {
    uint64_t offset, bytes, at;  ///< in the file; in memory
    bool writable;
  };
  void map(const Part& part, bool writable) const;

  const PoolFile& file_;
  std::vector<Part> parts_;
  std::byte* memory_ = nullptr;
  uint64_t reserved_ = 0;
};

}  // namespace takt
