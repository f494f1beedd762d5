// SPDX-License-Identifier: Apache-2.0
#include "graph/expect/condition_watch.hpp"

#include <fmt/format.h>

#include <utility>

#include "rt/time/units.hpp"

namespace takt::graph {
namespace {

std::string quoted(const std::string& text) {
  constexpr size_t kShown = 60;
  return text.size() > kShown ? fmt::format("\"{}...\"", text.substr(0, kShown)) : fmt::format("\"{}\"", text);
}

const char* word_of(Holds holds) {
  switch (holds) {
    case Holds::at_end: return "at the end";
    case Holds::once: return "once";
    case Holds::always: return "always";
    case Holds::never: return "never";
  }
  return "";
}

}  // namespace

ConditionWatch::ConditionWatch(const ConditionSpec& spec) : spec_(spec) {
  if (spec_.of == ConditionSpec::Of::messages) newest_ = 0.0, passes_now_ = passes(spec_, *newest_);
}

bool ConditionWatch::passes(const ConditionSpec& spec, const FieldValue& value) {
  const auto* text = std::get_if<std::string>(&value);
  if (spec.is) return text != nullptr && *text == *spec.is;
  if (spec.contains) return text != nullptr && text->find(*spec.contains) != std::string::npos;
  return text == nullptr && spec.bound.holds(std::get<double>(value));
}

void ConditionWatch::see(const std::optional<FieldValue>& value, int64_t at_ns) {
  if (excepted_ || !counts(at_ns)) return;
  ++seen_;
  newest_ = spec_.of == ConditionSpec::Of::messages ? FieldValue(static_cast<double>(seen_)) : value;
  const bool passed = std::exchange(passes_now_, newest_ && passes(spec_, *newest_));
  if (passes_now_ && (!passed || !since_ns_)) since_ns_ = at_ns;
  if (passes_now_ && !first_ns_) first_ns_ = at_ns, first_ = newest_;
  const bool breaks = (spec_.holds == Holds::always && !passes_now_) || (spec_.holds == Holds::never && passes_now_);
  if (breaks && !broken_ns_) broken_ns_ = at_ns, breaking_ = newest_;
}

bool ConditionWatch::met() const {
  switch (spec_.holds) {
    case Holds::at_end: return passes_now_;
    case Holds::once: return first_ns_.has_value();
    default: return seen_ > 0 && !broken_ns_;  // what was never said or seen proves nothing
  }
}

bool ConditionWatch::satisfied(int64_t now_ns) const {
  return met() && (spec_.holds == Holds::once || !spec_.to_ns || now_ns >= *spec_.to_ns);
}

bool ConditionWatch::must_come_true() const {
  return spec_.holds == Holds::once || spec_.holds == Holds::at_end || spec_.to_ns.has_value();
}

Finding ConditionWatch::finding() const {
  const std::optional<int64_t>& since = spec_.holds == Holds::once                    ? first_ns_
                                        : spec_.holds == Holds::at_end && passes_now_ ? since_ns_
                                                                                      : broken_ns_;
  return {what(), expected(), observed(), met(), since ? std::optional(to_seconds(*since)) : std::nullopt};
}

std::string ConditionWatch::what() const {
  switch (spec_.of) {
    case ConditionSpec::Of::messages: return "messages of " + spec_.port.text();
    case ConditionSpec::Of::field: return spec_.port.text() + " " + spec_.field;
    case ConditionSpec::Of::attribute: return spec_.object + "." + spec_.attribute;
    case ConditionSpec::Of::distance: break;
  }
  return fmt::format("{} from {}", spec_.object,
                     spec_.other.empty() ? fmt::format("({:g} m, {:g} m)", spec_.x_m, spec_.y_m) : spec_.other);
}

std::string ConditionWatch::test_text() const {
  const std::string unit = spec_.unit.empty() ? "" : " " + spec_.unit;
  if (spec_.is) return "is " + quoted(*spec_.is);
  if (spec_.contains) return "contains " + quoted(*spec_.contains);
  if (spec_.of == ConditionSpec::Of::distance) return fmt::format("within {:g}{}", *spec_.bound.at_most, unit);
  return bound_text(spec_.bound, unit);
}

std::string ConditionWatch::expected() const {
  std::string text = spec_.of == ConditionSpec::Of::messages ? "" : fmt::format("{} ", word_of(spec_.holds));
  text += test_text();
  for (const ConditionSpec& exception : spec_.unless)
    text += " unless " + ConditionWatch(exception).what() + " " + ConditionWatch(exception).test_text();
  if (spec_.from_ns > 0) text += fmt::format(" from {:g} s", to_seconds(spec_.from_ns));
  if (spec_.to_ns) text += fmt::format(" to {:g} s", to_seconds(*spec_.to_ns));
  return text;
}

std::string ConditionWatch::observed() const {
  const std::optional<FieldValue>& shown = broken_ns_                             ? breaking_
                                           : spec_.holds == Holds::once && first_ ? first_
                                                                                  : newest_;
  if (!shown) return "nothing";
  if (const auto* text = std::get_if<std::string>(&*shown)) return quoted(*text);
  return fmt::format("{:.4g}{}", std::get<double>(*shown), spec_.unit.empty() ? "" : " " + spec_.unit);
}

}  // namespace takt::graph
