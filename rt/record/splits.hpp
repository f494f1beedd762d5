// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <cstdint>
#include <utility>

#include "rt/record/mcap/writer.hpp"

namespace takt::record {

/// Where a record goes: one file, or several that follow one another, each of which can be read without the others.
/// One thread at a time.
class Splits {
 public:
  virtual ~Splits() = default;
  /// The file for what was published from `at_ns` on; nothing more comes for the one before. What cannot be made
  /// refuses what is appended. Null: there is no other file.
  virtual mcap::Sink* next(int64_t at_ns) = 0;
  /// Whether the file ends here: it has `bytes`, and goes from `began_ns` to `at_ns`.
  virtual bool ends(uint64_t bytes, int64_t began_ns, int64_t at_ns) const = 0;
  /// The file has what was published until `at_ns`, and keeps it through a loss of power. With each chunk.
  virtual mcap::Writer::Done settle(int64_t at_ns) = 0;
};

/// One file, that somebody else has opened.
class OneFile final : public Splits {
 public:
  explicit OneFile(mcap::Sink& sink) : sink_(&sink) {}
  mcap::Sink* next(int64_t) override { return std::exchange(sink_, nullptr); }
  bool ends(uint64_t, int64_t, int64_t) const override { return false; }
  mcap::Writer::Done settle(int64_t) override { return {}; }

 private:
  mcap::Sink* sink_;
};

}  // namespace takt::record
