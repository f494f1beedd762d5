// SPDX-License-Identifier: Apache-2.0
#include "rt/sched/param_mail.hpp"

namespace takt {

ParamValue value_of(const PlainParam& plain) {
  switch (plain.kind) {
    case PlainParam::flag: return plain.whole != 0;
    case PlainParam::integer: return plain.whole;
    case PlainParam::number: return plain.real;
    case PlainParam::text: return std::string(plain.words.text());
  }
  return {};
}

bool post(ParamMail& mail, size_t param, const ParamValue& value, uint32_t by_user) {
  if (mail.state.load(std::memory_order_acquire) == ParamMail::posted) return false;
  mail.param = static_cast<uint32_t>(param);
  mail.by_user = by_user;
  if (const auto* flag = std::get_if<bool>(&value)) {
    mail.kind = ParamMail::flag;
    mail.whole = *flag ? 1 : 0;
  } else if (const auto* whole = std::get_if<int64_t>(&value)) {
    mail.kind = ParamMail::integer;
    mail.whole = *whole;
  } else if (const auto* real = std::get_if<double>(&value)) {
    mail.kind = ParamMail::number;
    mail.real = *real;
  } else {
    const auto& words = std::get<std::string>(value);
    if (words.size() >= mail.words.characters.size()) return false;
    mail.kind = ParamMail::text;
    mail.words = decltype(mail.words)(words);
  }
  mail.state.store(ParamMail::posted, std::memory_order_release);
  return true;
}

std::string fixed_text(const ParamBase& param) {
  const std::string_view why = param.fixed().empty() ? kReadAtStart.why : param.fixed();
  return "is fixed while the graph runs (" + std::string(why) +
         "); give it in the graph's file or with --set, and start again";
}

bool deliver(ParamMail& mail, Node& node) {
  const ParamBase& param = *node.params()[mail.param];
  std::string refusal;
  if (!param.live()) {
    refusal = fixed_text(param);
  } else if (const auto done = node.change(mail.param, value_of(mail)); !done) {
    refusal = done.error();
  }
  if (refusal.empty()) return true;
  mail.refusal = decltype(mail.refusal)(refusal);
  mail.state.store(ParamMail::refused, std::memory_order_release);
  return false;
}

void keep(KeptParam& kept, const PlainParam& value, int64_t at_ns) {
  const uint32_t next = kept.count.load(std::memory_order_relaxed) + 1;
  KeptParam::Value& place = kept.places[next % 2];
  static_cast<PlainParam&>(place) = value;
  place.at_ns = at_ns;
  kept.count.store(next, std::memory_order_release);
}

void take_up(RunBoard& board, size_t task, Node& node) {
  bool any = false;
  for (size_t p = 0; p < board.param_count(task); ++p) {
    KeptParam& kept = board.kept(task, p);
    const KeptParam::Value* value = kept.newest();
    // The same parameter accepted it before, so it does again.
    if (value == nullptr || !node.params()[p]->set(value_of(*value))) continue;
    kept.taken_up.fetch_add(1);
    any = true;
  }
  if (any) node.changed();
}

}  // namespace takt
