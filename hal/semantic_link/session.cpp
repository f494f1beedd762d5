// SPDX-License-Identifier: Apache-2.0
#include "hal/semantic_link/session.hpp"

#include <algorithm>

namespace takt::semantic_link {
namespace {

std::span<const uint8_t> plain(std::span<const std::byte> bytes) {
  return {reinterpret_cast<const uint8_t*>(bytes.data()), bytes.size()};
}

}  // namespace

Session::Session(Way incoming, Exchange& exchange)
    : incoming_way_(incoming),
      exchange_(exchange),
      first_in_(index_of(incoming == Way::to_client ? Kind::objects : Kind::velocity)) {
  for (const MessageKind& info : message_kinds())
    if (info.way == incoming) incoming_.emplace_back(info);
}

void Session::begin(Peer peer, uint64_t id, uint64_t nonce, int64_t now_ns) {
  end();
  active_ = true;
  peer_ = peer;
  id_ = id;
  nonce_ = nonce;
  heard_ns_ = now_ns;
}

void Session::end() {
  active_ = left_ = false;
  next_sequence_ = 1;
  alive_ns_ = 0;
  echo_ = {};
  lost_before_ += window_.missing();
  window_ = {};
  clock_ = {};
  for (Incoming& in : incoming_) {
    in.assembly.reset();
    in.delivered = 0;
  }
  for (const MessageKind& info : message_kinds()) {
    Outgoing& out = outgoing_[index_of(info.kind)];
    out.number = 0;
    out.fresh = info.lasting && out.parcel != nullptr;  // the next peer does not have it yet
  }
}

void Session::learn_clock(int64_t sent_ns, int64_t heard_ns, int64_t answered_ns, int64_t now_ns) {
  clock_.observe(sent_ns, heard_ns, answered_ns, now_ns);
  echo_ = {answered_ns, now_ns};
}

void Session::take(const Packet& packet, int64_t now_ns) {
  if (!window_.take(packet.header.sequence)) {
    ++counts_.replayed;
    return;
  }
  ++counts_.received;
  heard_ns_ = now_ns;
  exchange_.heard.fetch_add(1, std::memory_order_relaxed);
  const Kind kind = packet.header.kind;
  if (kind == Kind::farewell) {
    left_ = true;
  } else if (kind == Kind::alive) {
    const auto note = read_alive(packet.payload);
    if (!note) ++counts_.malformed;
    else if (note->sent_ns != 0) learn_clock(note->sent_ns, note->heard_ns, packet.header.stamp_ns, now_ns);
    else echo_ = {packet.header.stamp_ns, now_ns};
  } else if (kind >= Kind::objects && info_of(kind).way == incoming_way_) {
    take_message(packet, now_ns);
  } else {
    ++counts_.malformed;
  }
}

void Session::take_message(const Packet& packet, int64_t now_ns) {
  const Header& h = packet.header;
  const MessageKind& info = info_of(h.kind);
  Incoming& in = incoming_[index_of(h.kind) - first_in_];
  if (h.number <= in.delivered) {
    if (h.number < in.delivered) ++counts_.late;
    return;
  }
  // Without a common time nobody could say how old it is; the next one comes soon.
  const auto stamp_ns = clock_.own_ns(h.stamp_ns);
  if (!stamp_ns) return;
  const uint64_t given_up = in.assembly.given_up();
  const Assembly::Step step = in.assembly.add(packet);
  counts_.incomplete += in.assembly.given_up() - given_up;
  if (step == Assembly::Step::incomplete) return;
  if (step == Assembly::Step::refused || !read_message(info, in.assembly.message(), in.message.get())) {
    ++counts_.malformed;
    return;
  }
  in.delivered = h.number;
  Newest<Parcel>& parcels = exchange_.parcels[index_of(h.kind)];
  const auto bytes = std::as_bytes(in.assembly.message());
  parcels.draft().bytes.assign(bytes.begin(), bytes.end());
  parcels.draft().stamp_ns = std::min(*stamp_ns, now_ns);
  parcels.publish();
}

/// What the jobs have handed over since the last time.
void Session::collect() {
  for (const MessageKind& info : message_kinds()) {
    if (info.way == incoming_way_) continue;
    const Parcel* parcel = exchange_.parcels[index_of(info.kind)].take();
    if (parcel == nullptr) continue;
    Outgoing& out = outgoing_[index_of(info.kind)];
    out.parcel = parcel;
    out.fresh = active_ || info.lasting;
  }
}

int64_t Session::send_due(int64_t now_ns, Outlet& outlet) {
  collect();
  if (!active_) return now_ns + kAlive_ns;
  for (const MessageKind& info : message_kinds()) {
    Outgoing& out = outgoing_[index_of(info.kind)];
    const bool again = info.lasting && out.parcel != nullptr && now_ns - out.sent_ns >= kRepeat_ns;
    if (out.fresh || again) send_message(info, out, now_ns, outlet);
  }
  if (now_ns - alive_ns_ >= kAlive_ns) {
    std::array<uint8_t, kLargestNote> note;
    const size_t size = write_note(echo_, note);
    Header header;
    header.stamp_ns = now_ns;
    header.message_bytes = static_cast<uint32_t>(size);
    send(header, std::span(note).first(size), outlet);
    alive_ns_ = now_ns;
  }
  return alive_ns_ + kAlive_ns;
}

void Session::send_message(const MessageKind& info, Outgoing& out, int64_t now_ns, Outlet& outlet) {
  if (out.fresh) ++out.number;
  out.fresh = false;
  out.sent_ns = now_ns;
  const auto message = plain(out.parcel->bytes);
  const size_t unit = std::min(outlet.port.largest(), kLargestDatagram) - kOverhead;
  Header header;
  header.kind = info.kind;
  header.fragments = static_cast<uint8_t>(fragments_of(message.size(), unit));
  header.number = out.number;
  header.stamp_ns = out.parcel->stamp_ns;
  header.message_bytes = static_cast<uint32_t>(message.size());
  for (; header.fragment < header.fragments; ++header.fragment) {
    const size_t at = header.fragment * unit;
    send(header, message.subspan(at, std::min(unit, message.size() - at)), outlet);
  }
}

void Session::send(const Header& header, std::span<const uint8_t> payload, Outlet& outlet) {
  Header numbered = header;
  numbered.session = id_;
  numbered.sequence = next_sequence_;
  if (next_sequence_ < UINT32_MAX) ++next_sequence_;
  outlet.send(peer_, numbered, payload);
  ++counts_.sent;
}

void Session::say_farewell(int64_t now_ns, Outlet& outlet) {
  if (!active_) return;
  Header header;
  header.kind = Kind::farewell;
  header.stamp_ns = now_ns;
  send(header, {}, outlet);
}

void Session::publish(const LinkCounts& end_counts, const char* trouble) {
  LinkReport& report = exchange_.report.draft();
  report.attached = active_;
  report.to_own_ns = clock_.known() ? clock_.to_own_ns() : 0;
  report.round_trip_ns = clock_.known() ? clock_.round_trip_ns() : 0;
  report.bound_ns = clock_.known() ? clock_.bound_ns() : 0;
  report.trouble = active_ ? "" : trouble;
  report.counts = counts_;
  report.counts.lost = lost_before_ + window_.missing();
  report.counts.malformed += end_counts.malformed;
  report.counts.damaged = end_counts.damaged;
  report.counts.foreign = end_counts.foreign;
  report.counts.refused = end_counts.refused;
  exchange_.report.publish();
  exchange_.bad.store(report.counts.malformed + report.counts.damaged, std::memory_order_relaxed);
}

}  // namespace takt::semantic_link
