// SPDX-License-Identifier: Apache-2.0
#include "rt/sched/param_mail.hpp"

#include <algorithm>
#include <cstring>

namespace takt {
namespace {

template <size_t N>
void copy_text(const std::string& text, std::array<char, N>& into) {
  const size_t length = std::min(text.size(), N - 1);
  std::memcpy(into.data(), text.data(), length);
  into[length] = 0;
}

ParamValue value_of(const ParamMail& mail) {
  switch (mail.kind) {
    case ParamMail::flag: return mail.whole != 0;
    case ParamMail::integer: return mail.whole;
    case ParamMail::number: return mail.real;
    case ParamMail::text: return std::string(mail.words.data());
  }
  return {};
}

}  // namespace

bool post(ParamMail& mail, size_t param, const ParamValue& value) {
  if (mail.state.load(std::memory_order_acquire) == ParamMail::posted) return false;
  mail.param = static_cast<uint32_t>(param);
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
    if (words.size() >= mail.words.size()) return false;
    mail.kind = ParamMail::text;
    copy_text(words, mail.words);
  }
  mail.state.store(ParamMail::posted, std::memory_order_release);
  return true;
}

void deliver(ParamMail& mail, Node& node) {
  ParamBase& param = *node.params()[mail.param];
  std::string refusal;
  if (!param.live()) {
    refusal = "is used only before the start of a run; give it with --set or in the graph";
  } else if (const auto done = param.set(value_of(mail)); !done) {
    refusal = done.error();
  }
  copy_text(refusal, mail.refusal);
  mail.state.store(refusal.empty() ? ParamMail::taken : ParamMail::refused, std::memory_order_release);
}

}  // namespace takt
