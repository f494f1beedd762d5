// SPDX-License-Identifier: Apache-2.0
#include "graph/flight/serve.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <optional>
#include <set>
#include <system_error>
#include <utility>

#include "rt/file/output_file.hpp"
#include "rt/record/mcap/chunks.hpp"
#include "rt/record/mcap/records.hpp"
#include "rt/record/mcap/tail.hpp"
#include "rt/record/mcap/writer.hpp"
#include "rt/record/recorder.hpp"
#include "rt/record/ring.hpp"

namespace takt::flight {
namespace {

namespace fs = std::filesystem;
using record::Recorder;

constexpr mcap::Writer::Options kFile{.most_index_bytes = 16 << 20};

class Service {
 public:
  Service(fs::path ring, mcap::Sink& sink, const Watch& watch)
      : ring_(std::move(ring)), watch_(watch), writer_(sink, kFile) {}

  tl::expected<Served, std::string> run() {
    const record::RingName first = newest();
    if (first.run.empty())
      return tl::unexpected(ring_.string() + ": no run keeps a ring here; start one with takt run --ring on");
    served_.run = first.run;
    number_ = first.number - 1;
    while (served_.end.empty() && served_.refused.empty()) step();
    if (served_.refused.empty()) finish();
    served_.bytes = writer_.written_bytes();
    return std::move(served_);
  }

 private:
  record::RingName newest() const {
    const auto files = record::records_in(ring_);
    return files.empty() ? record::RingName{} : record::name_of(files.back().path);
  }

  void step() {
    // Both are asked first: once there is no run, or a next file, the one in hand grows no more.
    const bool lives = watch_.lives() && newest().run == served_.run;
    const auto next = next_file();
    take_what_is_there();
    if (!served_.end.empty() || !served_.refused.empty()) return;
    if (watch_.enough()) served_.end = "stopped";
    else if (next) follow(*next);
    else if (!lives) served_.end = "the run was killed, or its ring is gone";
    else watch_.wait();
  }

  std::optional<fs::path> next_file() const {
    std::optional<fs::path> next;
    std::error_code error;
    uint64_t least = UINT64_MAX;
    for (const fs::directory_entry& entry : fs::directory_iterator(ring_, error)) {
      const record::RingName name = record::name_of(entry.path());
      if (name.run != served_.run || name.number <= number_ || name.number >= least) continue;
      least = name.number;
      next = entry.path();
    }
    return next;
  }

  void follow(const fs::path& file) {
    const uint64_t number = record::name_of(file).number;
    auto tail = mcap::Tail::open(file);
    std::error_code none;
    if (!tail && !fs::exists(file, none)) return;  // just dropped: another one is the next
    if (served_.files > 0 && number > number_ + 1)
      missing_.push_back(fmt::format("{} files of the ring were gone before they were read", number - number_ - 1));
    number_ = number;
    ++served_.files;
    if (tail) tail_.emplace(std::move(*tail));
    else damaged(tail.error());
  }

  void take_what_is_there() {
    while (tail_ && served_.end.empty() && served_.refused.empty() && !watch_.enough()) {
      const auto record = tail_->next();
      if (record && !*record) return;
      try {
        if (record) {
          take(**record);
          continue;
        }
        damaged(record.error());
      } catch (const std::exception& problem) {  // fields that are none
        damaged(problem.what());
      }
      tail_.reset();  // what follows cannot be read; there may be a next file
    }
  }

  void damaged(const std::string& what) {
    missing_.push_back(fmt::format("{}-{:06}.mcap is damaged: {}", served_.run, number_, what));
  }

  void take(const mcap::Tail::Record& record) {
    mcap::ByteReader fields(record.fields);
    switch (record.op) {
      case mcap::Op::header:
        if (!std::exchange(begun_, true)) note(writer_.begin("", "takt"));
        break;
      case mcap::Op::metadata: {
        const std::string name = fields.text();
        take_facts(name, fields.metadata());
        break;
      }
      case mcap::Op::attachment: {
        const mcap::Attachment attachment = mcap::get_attachment(record.fields);
        if (attached_.insert(attachment.name).second) note(writer_.attach(attachment));
        break;
      }
      // All files of a run have the same ones, with ids from 1 on.
      case mcap::Op::schema:
        if (mcap::Schema schema = mcap::get_schema(record.fields); schema.id > schemas_)
          schemas_ = writer_.add_schema(std::move(schema.name), std::move(schema.encoding), std::move(schema.data));
        break;
      case mcap::Op::channel:
        if (mcap::Channel channel = mcap::get_channel(record.fields); channel.id > channels_)
          channels_ = writer_.add_channel(channel.schema, std::move(channel.topic), std::move(channel.encoding),
                                          std::move(channel.metadata));
        break;
      case mcap::Op::chunk: take_chunk(mcap::get_chunk(record.fields, record.at)); break;
      default: break;
    }
  }

  void take_facts(const std::string& name, const mcap::Metadata& facts) {
    if (name == Recorder::kFacts && !std::exchange(facts_known_, true)) note(writer_.metadata(name, facts));
    if (name != Recorder::kEnd) return;
    end_ = facts;
    if (!end_.contains("goes_on")) served_.end = "the run has ended";
  }

  void take_chunk(const mcap::Chunk& chunk) {
    const auto records = mcap::unpack(chunk);
    if (!records) return damaged(records.error());
    mcap::for_each_record(*records, [&](mcap::Op op, mcap::Bytes fields, size_t) {
      if (op != mcap::Op::message) return true;
      const mcap::Message message = mcap::get_message(fields);
      tell_gap(message.log_ns);
      note(writer_.write(message));
      last_ns_ = std::max(last_ns_, message.log_ns);
      ++served_.messages;
      return served_.refused.empty();
    });
    note(writer_.flush());
  }

  /// What is missing lies between the last message and the one to come.
  void tell_gap(uint64_t to_ns) {
    const uint64_t from_ns = last_ns_ > 0 ? std::min(last_ns_, to_ns) : to_ns;
    for (const std::string& what : std::exchange(missing_, {})) {
      ++served_.gaps;
      note(writer_.flush());
      note(writer_.metadata(kGap,
                            {{"what", what}, {"from_ns", std::to_string(from_ns)}, {"to_ns", std::to_string(to_ns)}}));
      if (watch_.say)
        watch_.say(fmt::format("a gap of {:.1f} s: {}", static_cast<double>(to_ns - from_ns) / 1e9, what));
    }
  }

  void finish() {
    if (!begun_) note(writer_.begin("", "takt"));
    tell_gap(last_ns_);
    if (!end_.empty()) note(writer_.metadata(Recorder::kEnd, end_));
    note(writer_.metadata("takt served", {{"end", served_.end}, {"gaps", std::to_string(served_.gaps)}}));
    note(writer_.finish());
  }

  void note(const mcap::Writer::Done& done) {
    if (!done && served_.refused.empty()) served_.refused = done.error();
  }

  static constexpr const char* kGap = "takt gap";
  const fs::path ring_;
  const Watch& watch_;
  mcap::Writer writer_;
  std::optional<mcap::Tail> tail_;
  uint64_t number_ = 0;  ///< of the file in hand
  bool begun_ = false, facts_known_ = false;
  std::set<std::string> attached_;
  uint16_t schemas_ = 0, channels_ = 0;
  mcap::Metadata end_;
  std::vector<std::string> missing_;  ///< since the last message
  uint64_t last_ns_ = 0;
  Served served_;
};

}  // namespace

fs::path ring_of(const fs::path& folder) {
  std::error_code none;
  for (const char* below : {"flight/ring", "ring"})
    if (fs::is_directory(folder / below, none)) return folder / below;
  return folder;
}

bool run_lives(const fs::path& ring) {
  std::error_code none;
  const fs::path output = fs::canonical(ring, none).parent_path().parent_path();
  return !none && !WriterLock::of_folder(output);
}

tl::expected<Served, std::string> serve(const fs::path& ring, mcap::Sink& sink, const Watch& watch) {
  return Service(ring, sink, watch).run();
}

}  // namespace takt::flight
