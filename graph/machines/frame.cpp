// SPDX-License-Identifier: Apache-2.0
#include "graph/machines/frame.hpp"

#include "rt/record/mcap/bytes.hpp"
#include "rt/record/message_record.hpp"
#include "rt/record/packed_message.hpp"

namespace takt::machines {
namespace {

constexpr uint32_t kMagic = 0x32744B54;  // "TKt2"
constexpr size_t kHash = sizeof(uint64_t);

}  // namespace

std::span<const std::byte> Framer::frame(uint64_t run, const Held& held) {
  packed_.clear(), frame_.clear();
  record::pack(*type_, held.message(), packed_);
  const auto coded = coder_.code(*type_, packed_);
  mcap::ByteWriter out(frame_);
  out.number(kMagic), out.number(run), out.number(held.sequence);
  out.number(static_cast<uint64_t>(held.stamp_ns)), out.number(static_cast<uint64_t>(held.header->published_ns));
  out.number(static_cast<uint32_t>(held.header->level)), out.number(static_cast<uint32_t>(coder_.coding()));
  frame_.insert(frame_.end(), coded.begin(), coded.end());
  out.number(record::hash_of(frame_));
  return frame_;
}

tl::expected<Frame, std::string> frame_of(std::span<const std::byte> bytes) {
  if (bytes.size() < kHash) return tl::make_unexpected(std::string("too short"));
  const auto sent = bytes.first(bytes.size() - kHash);
  Frame frame;
  try {
    mcap::ByteReader end(bytes.last(kHash));
    if (end.number<uint64_t>() != record::hash_of(sent)) return tl::make_unexpected(std::string("damaged"));
    mcap::ByteReader in(sent);
    if (in.number<uint32_t>() != kMagic) return tl::make_unexpected(std::string("of another format"));
    frame.run = in.number<uint64_t>(), frame.sequence = in.number<uint64_t>();
    frame.stamp_ns = static_cast<int64_t>(in.number<uint64_t>());
    frame.published_ns = static_cast<int64_t>(in.number<uint64_t>());
    frame.level = static_cast<int32_t>(in.number<uint32_t>());
    const auto coding = in.number<uint32_t>();
    if (coding > static_cast<uint32_t>(Coding::jpeg)) return tl::make_unexpected(std::string("in an unknown coding"));
    frame.coding = static_cast<Coding>(coding);
    frame.coded = in.bytes(in.left());
  } catch (const mcap::TooShort& problem) {
    return tl::make_unexpected(std::string(problem.what()));
  }
  if (frame.sequence == 0) return tl::make_unexpected(std::string("without a number"));
  return frame;
}

}  // namespace takt::machines
