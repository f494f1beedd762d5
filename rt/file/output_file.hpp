// SPDX-License-Identifier: Apache-2.0
// Files that a program writes whole: a report, a picture, a page. Each is written next to its place, as NAME.part, and
// renamed once all of it is there, so that a full disk or a kill leaves the older file as it was. From the claim to the
// end it belongs to one process.
//
//   auto report = OutputFile::claim("run.json");   // before the work: nothing can be in the way later
//   report->stream() << text;
//   if (const auto done = report->finish(); !done) return refuse(done.error().what);
//
// Functions of one object are called by one thread at a time. Processes forked after the claim share it.
#pragma once
#include <filesystem>
#include <memory>
#include <ostream>
#include <stdexcept>
#include <string>
#include <string_view>
#include <tl/expected.hpp>

namespace takt {

/// Why a file was not written: "FILE: REASON".
struct OutputFailure {
  std::string what;
  bool system = false;  ///< a full disk, a limit, a broken device; else another name would do
};

/// A file or folder of which only one process at a time may be the writer. Ends with the process, or with all that were
/// forked from it.
class WriterLock {
 public:
  /// An existing folder. Failure: another process has it, which is named, or it cannot be opened.
  static tl::expected<WriterLock, OutputFailure> of_folder(const std::filesystem::path& folder);
  /// A file that is written in place, such as a record; it is made if it is not there, and goes again unless it was
  /// written to.
  static tl::expected<WriterLock, OutputFailure> of_file(const std::filesystem::path& file);
  WriterLock(WriterLock&& other) noexcept;
  WriterLock& operator=(WriterLock&&) = delete;
  ~WriterLock();

 private:
  explicit WriterLock(int descriptor) : descriptor_(descriptor) {}
  int descriptor_;
  std::filesystem::path made_;
};

class OutputFile {
 public:
  /// Failure: it cannot be written there, or another process writes it, which is named. Devices, and pipes that the
  /// shell hands over, are written to directly.
  static tl::expected<OutputFile, OutputFailure> claim(const std::filesystem::path& file);
  OutputFile(OutputFile&&) noexcept;
  OutputFile& operator=(OutputFile&&) noexcept;
  /// Without finish() the older file stays, or none.
  ~OutputFile();

  const std::filesystem::path& file() const;
  /// For those that open a file by themselves: its content until it is renamed. Empty where that is written directly.
  std::filesystem::path part() const;
  std::ostream& stream();
  /// Gives the file its name. Failure: something was not written, and why; the older file is as it was.
  tl::expected<void, OutputFailure> finish();

 private:
  struct Open;
  explicit OutputFile(std::unique_ptr<Open> made);
  std::unique_ptr<Open> open_;
};

/// A failure for those that throw.
struct OutputError : std::runtime_error {
  explicit OutputError(const OutputFailure& failure) : std::runtime_error(failure.what), system(failure.system) {}
  const bool system;
};
/// Throws OutputError where something was not written.
inline void require_written(const tl::expected<void, OutputFailure>& done) {
  if (!done) throw OutputError(done.error());
}

/// All of it at once.
tl::expected<void, OutputFailure> write_file(const std::filesystem::path& file, std::string_view content);

}  // namespace takt
