// SPDX-License-Identifier: Apache-2.0
#include "rt/record/recorded_event.hpp"

#include <array>

#include "rt/record/pack_walk.hpp"

namespace takt::record {
namespace {

template <class Walk, class Event>
void walk_head(Walk& at, Event& event) {
  at.number(event.kind), at.number(event.task), at.number(event.job), at.number(event.at_ns);
}

template <class Walk>
struct Body {
  Walk& at;
  void operator()(const std::monostate&) {}
  template <class R>
  requires std::is_same_v<std::remove_const_t<R>, Restart>
  void operator()(R& restart) {
    at.number(restart.level), at.number(restart.phase);
    at.list(restart.outputs, [&](auto& o) { at.number(o.output), at.number(o.handed_over), at.number(o.newest); });
    at.list(restart.seen, [&](auto& seen) { at.number(seen.edge), at.number(seen.sequence); });
    at.list(restart.params, [&](auto& param) { at.number(param.param), at.value(param.value); });
  }
  template <class S>
  requires std::is_same_v<std::remove_const_t<S>, Snapshot>
  void operator()(S& snapshot) { (*this)(snapshot.from), at.number(snapshot.state); }
  template <class P>
  requires std::is_same_v<std::remove_const_t<P>, ParameterSet>
  void operator()(P& set) { at.number(set.param), at.value(set.value), at.text(set.who); }
  template <class M>
  requires std::is_same_v<std::remove_const_t<M>, ModeChange>
  void operator()(M& change) { at.number(change.mode), at.text(change.reason); }
  template <class M>
  requires std::is_same_v<std::remove_const_t<M>, MarkSet>
  void operator()(M& mark) { at.text(mark.words), at.text(mark.who); }
  template <class L>
  requires std::is_same_v<std::remove_const_t<L>, LogSaid>
  void operator()(L& said) { at.number(said.level), at.number(said.dropped), at.text(said.text); }
};

}  // namespace

std::string name_of(uint16_t kind) {
  static constexpr std::array<const char*, 9> names{"restart",  "parameter",    "mode",  "request", "mark",
                                                    "snapshot", "machine_lost", "level", "log"};
  if (kind == 0 || kind > names.size()) return "unknown kind " + std::to_string(kind);
  const std::string name = names[kind - 1];
  const bool written =
      kind < static_cast<uint16_t>(EventKind::request) || kind == static_cast<uint16_t>(EventKind::mark) ||
      kind == static_cast<uint16_t>(EventKind::snapshot) || kind == static_cast<uint16_t>(EventKind::log);
  return written ? name : "reserved kind " + std::to_string(kind) + " (" + name + ")";
}

void pack(const RecordedEvent& event, std::vector<std::byte>& to) {
  PackOut out(to);
  walk_head(out, event);
  std::visit(Body<PackOut>{out}, event.what);
}

tl::expected<RecordedEvent, std::string> unpack_event(std::span<const std::byte> packed) {
  RecordedEvent event;
  PackIn in(packed);
  try {
    walk_head(in, event);
    switch (static_cast<EventKind>(event.kind)) {
      case EventKind::restart: event.what = Restart{}; break;
      case EventKind::parameter: event.what = ParameterSet{}; break;
      case EventKind::mode: event.what = ModeChange{}; break;
      case EventKind::mark: event.what = MarkSet{}; break;
      case EventKind::snapshot: event.what = Snapshot{}; break;
      case EventKind::log: event.what = LogSaid{}; break;
      default: break;
    }
    std::visit(Body<PackIn>{in}, event.what);
  } catch (const std::runtime_error& problem) {
    return tl::make_unexpected(std::string(problem.what()));
  }
  return event;
}

const char* event_layout() {
  return "u16 kind, u16 task (65535: none), u32 job, i64 at_ns, and by kind: "
         "1 restart: i32 level, u32 phase (0), [u16 output, u64 handed_over, u64 newest] outputs, [u16 edge, u64 "
         "sequence] seen, [u16 param, u8 kind (0 flag, 1 integer, 2 number, 3 text), value] params; "
         "2 parameter: u16 param, u8 kind, value, text who; "
         "3 mode: u32 mode, text reason; "
         "5 mark: text words, text who; "
         "6 snapshot: as 1, u64 state; "
         "9 log: u8 level (0 debug, 1 info, 2 warning, 3 error), u32 dropped, text text; "
         "4 request, 7 machine_lost, 8 level: reserved; pass over kinds and bytes behind that you "
         "do not know; little-endian, [..] is u32 count and the elements, text is u32 bytes and the bytes";
}

}  // namespace takt::record
