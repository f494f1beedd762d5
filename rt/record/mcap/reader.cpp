// SPDX-License-Identifier: Apache-2.0
#include "rt/record/mcap/reader.hpp"

#include <fcntl.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <utility>

#include "rt/memory/map_as_used.hpp"
#include "rt/record/mcap/chunks.hpp"
#include "rt/record/mcap/records.hpp"

namespace takt::mcap {
namespace {

constexpr uint64_t kFooterFields = 8 + 8 + 4;
/// A run of messages outside chunks ends when it is as large: a reader takes one into memory as a whole.
constexpr size_t kRunBytes = 1 << 20;

/// Keeps a definition under an id that counts from 1; `ids` says which, by that of the file. A record of the same id
/// again must say the same: then it is a copy, as in the summary.
template <class Definition>
void keep_once(std::vector<Definition>& list, std::map<uint16_t, uint16_t>& ids, Definition definition) {
  const uint16_t id_in_file = definition.id;
  const auto same = [&](Definition other) {
    other.id = definition.id;
    return other == definition;
  };
  if (const auto known = ids.find(id_in_file); known != ids.end()) {
    if (!same(list[known->second - 1U]))
      throw std::runtime_error("two definitions have the id " + std::to_string(id_in_file));
    return;
  }
  const auto twin = std::find_if(list.begin(), list.end(), same);
  if (twin == list.end() && list.size() == UINT16_MAX) throw std::runtime_error("more than 65535 definitions");
  ids[id_in_file] = static_cast<uint16_t>(twin - list.begin() + 1);
  if (twin != list.end()) return;
  definition.id = static_cast<uint16_t>(list.size() + 1);
  list.push_back(std::move(definition));
}

bool has_magic(Bytes file, size_t at) {
  return at + kMagic.size() <= file.size() && std::memcmp(file.data() + at, kMagic.data(), kMagic.size()) == 0;
}

}  // namespace

tl::expected<Reader, std::string> Reader::open(const std::filesystem::path& file, bool all) {
  const int descriptor = ::open(file.c_str(), O_RDONLY | O_CLOEXEC);
  if (descriptor < 0) return tl::unexpected(file.string() + ": " + std::strerror(errno));
  struct stat status {};
  void* memory = MAP_FAILED;
  if (fstat(descriptor, &status) == 0 && status.st_size > 0)
    memory = map_as_used(static_cast<size_t>(status.st_size), PROT_READ, MAP_PRIVATE, descriptor);
  close(descriptor);
  if (memory == MAP_FAILED) return tl::unexpected(file.string() + ": is empty or cannot be mapped");
  Reader reader(Bytes(static_cast<const std::byte*>(memory), static_cast<size_t>(status.st_size)), all);
  if (!has_magic(reader.file_, 0)) return tl::unexpected(file.string() + ": is no MCAP file");
  reader.scan();
  return reader;
}

Reader::Reader(Reader&& other) noexcept
    : file_(std::exchange(other.file_, {})),
      all_(other.all_),
      profile_(std::move(other.profile_)),
      written_by_(std::move(other.written_by_)),
      missing_(std::move(other.missing_)),
      schemas_(std::move(other.schemas_)),
      channels_(std::move(other.channels_)),
      schema_ids_(std::move(other.schema_ids_)),
      channel_ids_(std::move(other.channel_ids_)),
      left_out_(std::move(other.left_out_)),
      chunks_(std::move(other.chunks_)),
      attachments_(std::move(other.attachments_)),
      metadata_(std::move(other.metadata_)) {}

Reader::~Reader() {
  if (!file_.empty()) munmap(const_cast<std::byte*>(file_.data()), file_.size());
}

void Reader::scan() {
  uint64_t at = kMagic.size();
  const auto note = [&](const std::string& problem) {
    if (missing_.empty()) missing_ = problem;
  };
  bool ended = false;
  try {
    for_each_record(file_.subspan(kMagic.size()), [&](Op op, Bytes fields, size_t from) {
      at = kMagic.size() + from;
      ended = op == Op::data_end || op == Op::footer;
      if (op == Op::data_end) note(check_end(at, at + kHead + fields.size()));
      if (op == Op::footer) note("the data section of the file has no end record");
      try {
        if (!ended) take(op, fields, at);
      } catch (const std::exception& problem) {  // the next record can be found all the same
        note("byte " + std::to_string(at) + ": " + problem.what());
      }
      at += kHead + fields.size();
      return !ended;
    });
    if (!ended) note("the file lacks its summary or footer");
  } catch (const TooShort&) {
    note("the file ends within a record: " + std::to_string(file_.size() - at) + " bytes after byte " +
         std::to_string(at) + " cannot be read, and there is no summary");
  }
  take_definitions_in_chunks();
  name_unknown();
}

void Reader::take(Op op, Bytes fields, uint64_t at) {
  switch (op) {
    case Op::header: {
      ByteReader head(fields);
      profile_ = head.text();
      written_by_ = head.text();
      break;
    }
    case Op::schema:
    case Op::channel: take_definition(op, fields); break;
    case Op::message: take_message(fields, at); break;
    case Op::chunk:
      chunks_.push_back(get_chunk(fields, at));
      chunk_has_index_ = false;
      break;
    case Op::message_index:
      indexed_.insert(ByteReader(fields).number<uint16_t>());
      chunks_with_index_ += chunk_has_index_ ? 0 : 1;
      chunk_has_index_ = true;
      break;
    case Op::attachment: attachments_.push_back(get_attachment(fields)); break;
    case Op::metadata: {
      ByteReader entry(fields);
      std::string name = entry.text();
      metadata_.push_back({std::move(name), entry.metadata()});
      break;
    }
    default: take_unknown(op);
  }
}

void Reader::take_definition(Op op, Bytes fields) {
  if (op == Op::schema) {
    keep_once(schemas_, schema_ids_, get_schema(fields));
  } else {
    Channel channel = get_channel(fields);
    const auto schema = schema_ids_.find(channel.schema);
    channel.schema = schema == schema_ids_.end() ? uint16_t{0} : schema->second;
    keep_once(channels_, channel_ids_, std::move(channel));
  }
}

/// One outside a chunk: with those that lie right before it, it is a chunk that is not packed.
void Reader::take_message(Bytes fields, uint64_t at) {
  const uint64_t size = kHead + fields.size();
  Chunk* run = chunks_.empty() ? nullptr : &chunks_.back();
  const bool goes_on =
      run != nullptr && run->loose && run->at + run->stored.size() == at && run->stored.size() < kRunBytes;
  if (!goes_on) {
    run = &chunks_.emplace_back();
    run->at = at;
    run->loose = true;
  }
  run->uncompressed_size += size;
  run->stored = file_.subspan(static_cast<size_t>(run->at), static_cast<size_t>(run->uncompressed_size));
}

/// Unpacking takes time: only if a channel may stand nowhere else. Indexes name the channels that have messages.
void Reader::take_definitions_in_chunks() {
  const auto packed = static_cast<size_t>(
      std::count_if(chunks_.begin(), chunks_.end(), [](const Chunk& chunk) { return !chunk.loose; }));
  if (packed == chunks_with_index_ &&
      std::all_of(indexed_.begin(), indexed_.end(), [&](uint16_t id) { return channel_ids_.contains(id); }))
    return;
  for (const Chunk& chunk : chunks_) {
    const auto records = chunk.loose ? tl::expected<std::vector<std::byte>, std::string>{} : unpack(chunk);
    if (!records) continue;  // for_each() says so
    try {
      for_each_record(*records, [&](Op op, Bytes fields, size_t) {
        if (op == Op::schema || op == Op::channel) take_definition(op, fields);
        else if (op != Op::message) take_unknown(op);
        return true;
      });
    } catch (const std::exception& problem) {
      if (missing_.empty()) missing_ = "the chunk at byte " + std::to_string(chunk.at) + ": " + problem.what();
    }
  }
}

void Reader::take_unknown(Op op) {
  if (op < Op::header || op > Op::data_end) ++unknown_[static_cast<unsigned>(op)];
}

void Reader::name_unknown() {
  for (const auto& [op, count] : unknown_)
    left_out_.push_back(std::to_string(count) + " records of kind " + std::to_string(op) +
                        ", which the format (version 0) does not have");
}

/// Takes the definitions of the summary as well, if it is whole: a writer may put some only there.
std::string Reader::check_end(uint64_t data_end_at, uint64_t summary_at) {
  const uint64_t tail = kHead + kFooterFields + kMagic.size();
  if (file_.size() < summary_at + tail || !has_magic(file_, file_.size() - kMagic.size()))
    return "the file lacks its summary or footer";
  const auto section = [&](uint64_t from, uint64_t to) {
    return file_.subspan(static_cast<size_t>(from), static_cast<size_t>(to - from));
  };
  const uint64_t footer_at = file_.size() - tail;
  ByteReader footer(file_.subspan(static_cast<size_t>(footer_at)));
  if (footer.number<uint8_t>() != static_cast<uint8_t>(Op::footer) || footer.number<uint64_t>() != kFooterFields)
    return "the file has no footer";
  const auto summary_start = footer.number<uint64_t>();
  footer.number<uint64_t>();
  const auto summary_crc = footer.number<uint32_t>(),
             data_crc = ByteReader(section(data_end_at + kHead, summary_at)).number<uint32_t>();
  if (summary_start != 0 && summary_start != summary_at) return "the summary is not where the footer says";
  if (all_ && data_crc != 0 && data_crc != crc_of(0, section(0, data_end_at)))
    return "the CRC of the data section does not fit";
  if (summary_crc != 0 && summary_crc != crc_of(0, section(summary_at, footer_at + kHead + 16)))
    return "the CRC of the summary does not fit";
  try {
    for_each_record(section(summary_at, footer_at), [&](Op op, Bytes fields, size_t) {
      if (op == Op::schema || op == Op::channel) take_definition(op, fields);
      else take_unknown(op);
      return true;
    });
  } catch (const std::exception& problem) {
    return std::string("the summary: ") + problem.what();
  }
  return "";
}

tl::expected<std::vector<std::byte>, std::string> Reader::unpack(const Chunk& chunk) const {
  return mcap::unpack(chunk);
}

tl::expected<bool, std::string> Reader::for_each_in(Bytes records,
                                                    const std::function<bool(const Message&)>& each) const {
  bool go_on = true;
  try {
    for_each_record(records, [&](Op op, Bytes fields, size_t) {
      if (op != Op::message) return true;
      Message message = get_message(fields);
      const auto channel = channel_ids_.find(message.channel);
      message.channel = channel == channel_ids_.end() ? uint16_t{0} : channel->second;
      return go_on = each(message);
    });
  } catch (const TooShort& problem) {
    return tl::unexpected(std::string(problem.what()));
  }
  return go_on;
}

tl::expected<void, std::string> Reader::for_each(const std::function<bool(const Message&)>& each) const {
  for (const Chunk& chunk : chunks_) {
    const auto records = unpack(chunk);
    if (!records) return tl::unexpected(records.error());
    const auto go_on = for_each_in(*records, each);
    if (!go_on) return tl::unexpected("the chunk at byte " + std::to_string(chunk.at) + ": " + go_on.error());
    if (!*go_on) break;
  }
  return {};
}

}  // namespace takt::mcap
