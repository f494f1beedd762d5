// SPDX-License-Identifier: Apache-2.0
#include "hal/semantic_link/packet.hpp"

#include "hal/semantic_link/wire.hpp"

namespace takt::semantic_link {
namespace {

/// All fragments but the last are of one size, and none is larger than the others or empty.
bool possible(const Header& h, size_t payload) {
  if (h.message_bytes > kLargestMessage || h.fragments == 0 || h.fragments > kMostFragments ||
      h.fragment >= h.fragments)
    return false;
  if (h.fragments == 1) return payload == h.message_bytes;
  const size_t others = h.fragments - 1u;
  if (payload == 0 || payload >= h.message_bytes) return false;
  if (h.fragment < others) return payload * others < h.message_bytes && h.message_bytes <= payload * h.fragments;
  const size_t before = h.message_bytes - payload;
  return before % others == 0 && payload <= before / others;
}

}  // namespace

bool known(Kind kind) {
  return (kind >= Kind::hello && kind <= Kind::farewell) || (kind >= Kind::objects && kind <= Kind::task);
}

std::string_view to_text(Fault fault) {
  constexpr std::string_view names[]{"length", "magic", "version", "check", "kind", "shape", "content"};
  return names[static_cast<size_t>(fault)];
}

size_t write_packet(const Header& h, std::span<const uint8_t> payload, const Key& key, std::span<uint8_t> into) {
  WireWriter out(into);
  out.put(kMagic, kVersion, h.kind, h.fragment, h.fragments, h.session, h.sequence, h.number, h.stamp_ns,
          h.message_bytes);
  out.put_bytes(payload);
  out.put(siphash(key, out.written()));
  return out.size();
}

tl::expected<Packet, Fault> read_packet(std::span<const uint8_t> datagram, const Key& key) {
  if (datagram.size() < kOverhead || datagram.size() > kLargestDatagram) return tl::unexpected(Fault::length);
  const auto checked = datagram.first(datagram.size() - kCheckBytes);
  WireReader in(checked), end(datagram.last(kCheckBytes));
  uint32_t magic = 0;
  uint8_t version = 0;
  uint64_t check = 0;
  Packet packet;
  Header& h = packet.header;
  in.get(magic, version, h.kind, h.fragment, h.fragments, h.session, h.sequence, h.number, h.stamp_ns, h.message_bytes);
  end.get(check);
  if (magic != kMagic) return tl::unexpected(Fault::magic);
  if (version != kVersion) return tl::unexpected(Fault::version);
  if (check != siphash(key, checked)) return tl::unexpected(Fault::check);
  if (!known(h.kind)) return tl::unexpected(Fault::kind);
  packet.payload = in.rest();
  if (!possible(h, packet.payload.size())) return tl::unexpected(Fault::shape);
  return packet;
}

size_t unit_of(const Packet& packet) {
  const Header& h = packet.header;
  if (h.fragment + 1 < h.fragments) return packet.payload.size();
  return h.fragments == 1 ? h.message_bytes : (h.message_bytes - packet.payload.size()) / (h.fragments - 1u);
}

}  // namespace takt::semantic_link
