// SPDX-License-Identifier: Apache-2.0
#include "rt/param.hpp"

#include <cmath>
#include <sstream>
#include <type_traits>

#include "rt/node.hpp"

namespace takt {
namespace {

template <class T>
std::string text_of(const T& value) {
  std::ostringstream out;
  if constexpr (std::is_same_v<T, bool>) out << (value ? "true" : "false");
  else out << value;
  return out.str();
}

std::string text_of(const ParamValue& value) {
  return std::visit([](const auto& v) { return text_of(v); }, value);
}

/// The value as T, or what it is instead.
template <class T>
tl::expected<T, std::string> convert(const ParamValue& value) {
  if constexpr (std::is_same_v<T, double>) {
    if (const auto* number = std::get_if<double>(&value)) {
      if (!std::isfinite(*number)) return tl::make_unexpected("is not a finite number");
      return *number;
    }
    if (const auto* whole = std::get_if<int64_t>(&value)) return static_cast<double>(*whole);
    return tl::make_unexpected("is \"" + text_of(value) + "\", a number is wanted");
  } else if constexpr (std::is_same_v<T, int>) {
    if (const auto* whole = std::get_if<int64_t>(&value); whole && std::in_range<int>(*whole))
      return static_cast<int>(*whole);
    return tl::make_unexpected("is \"" + text_of(value) + "\", an integer is wanted");
  } else if constexpr (std::is_same_v<T, bool>) {
    if (const auto* flag = std::get_if<bool>(&value)) return *flag;
    return tl::make_unexpected("is \"" + text_of(value) + "\", true or false is wanted");
  } else {
    if (const auto* text = std::get_if<std::string>(&value)) return *text;
    return tl::make_unexpected("is " + text_of(value) + ", a text is wanted (put it in quotes)");
  }
}

}  // namespace

ParamBase::ParamBase(Node* owner, std::string_view name, std::string_view unit, std::string_view doc, Fixed fixed)
    : name_(name), unit_(unit), doc_(doc), fixed_(fixed.why.empty() && unit == kPath ? kReadAtStart.why : fixed.why) {
  owner->params_.push_back(this);
}

template <class T>
tl::expected<void, std::string> Param<T>::set(const ParamValue& value) {
  auto converted = convert<T>(value);
  if (!converted) return tl::make_unexpected(converted.error());
  if (range_ && (*converted < range_->low || *converted > range_->high))
    return tl::make_unexpected("is " + text_of(*converted) + ", must lie in " + range_text());
  value_ = std::move(*converted);
  return {};
}

template <class T>
ParamValue Param<T>::value() const {
  if constexpr (std::is_same_v<T, int>) return int64_t{value_};
  else return value_;
}

template <class T>
std::string Param<T>::value_text() const {
  return text_of(value_);
}

template <class T>
std::string Param<T>::range_text() const {
  return range_ ? text_of(range_->low) + ".." + text_of(range_->high) : "";
}

template <class T>
std::string Param<T>::kind() const {
  if constexpr (std::is_same_v<T, bool>) return "flag";
  else if constexpr (std::is_same_v<T, std::string>) return "text";
  else if constexpr (std::is_same_v<T, double>) return "number";
  else return "integer";
}

template class Param<int>;
template class Param<double>;
template class Param<bool>;
template class Param<std::string>;

Choice::Choice(Node* owner, std::string_view name, std::string_view value, std::vector<std::string_view> words,
               std::string_view doc, Fixed fixed)
    : ParamBase(owner, name, "", doc, fixed), words_(std::move(words)) {
  if (!set(std::string(value))) throw std::logic_error("default of a choice is not among its words");
}

tl::expected<void, std::string> Choice::set(const ParamValue& value) {
  if (const auto* text = std::get_if<std::string>(&value)) {
    for (size_t i = 0; i < words_.size(); ++i) {
      if (words_[i] == *text) {
        index_ = i;
        return {};
      }
    }
  }
  return tl::make_unexpected("is \"" + text_of(value) + "\", valid are: " + range_text());
}

std::string Choice::range_text() const {
  std::string text;
  for (const auto word : words_) text += (text.empty() ? "" : " | ") + std::string(word);
  return text;
}

}  // namespace takt
