// SPDX-License-Identifier: Apache-2.0
#include "nodes/semantic/attribute.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cmath>

namespace takt::semantic {
namespace {

/// Takes a number off the front; false: there is none.
bool take_number(std::string_view& text, double& value) {
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc{} || !std::isfinite(value)) return false;
  text.remove_prefix(static_cast<size_t>(end - text.data()));
  text.remove_prefix(std::min(text.find_first_not_of(" ,"), text.size()));
  return true;
}

/// A value of the attribute's kind, in its range or not.
Value read_value(const Attribute& attribute, std::string_view text) {
  switch (attribute.kind) {
    case ValueKind::scalar:
      if (double number = 0; take_number(text, number) && text == attribute.unit) return number;
      break;
    case ValueKind::boolean:
      if (text == "true" || text == "false") return text == "true";
      break;
    case ValueKind::colour:
      if (double r = 0, g = 0, b = 0;
          take_number(text, r) && take_number(text, g) && take_number(text, b) && text.empty())
        return Rgb{static_cast<float>(r), static_cast<float>(g), static_cast<float>(b)};
      break;
    case ValueKind::enumerated:
      if (const auto word = std::find(attribute.words.begin(), attribute.words.end(), text);
          word != attribute.words.end())
        return Word{static_cast<uint16_t>(word - attribute.words.begin())};
      break;
  }
  return {};
}

}  // namespace

bool fits(const Attribute& attribute, const Value& value) {
  const auto within = [](double x, double low, double high) { return x >= low && x <= high; };
  switch (attribute.kind) {
    case ValueKind::scalar: {
      const double* number = std::get_if<double>(&value);
      return number && within(*number, attribute.low, attribute.high);
    }
    case ValueKind::boolean: return std::holds_alternative<bool>(value);
    case ValueKind::colour: {
      const Rgb* c = std::get_if<Rgb>(&value);
      return c && within(c->r, 0, 1) && within(c->g, 0, 1) && within(c->b, 0, 1);
    }
    case ValueKind::enumerated: {
      const Word* word = std::get_if<Word>(&value);
      return word && word->index < attribute.words.size();
    }
  }
  return false;
}

double distance(const Attribute& attribute, const Value& a, const Value& b) {
  if (attribute.kind == ValueKind::scalar)
    return std::min(1.0, std::abs(std::get<double>(a) - std::get<double>(b)) / (attribute.high - attribute.low));
  if (attribute.kind == ValueKind::colour) {
    const Rgb &p = std::get<Rgb>(a), &q = std::get<Rgb>(b);
    const double r = p.r - q.r, g = p.g - q.g, blue = p.b - q.b;
    return std::sqrt((r * r + g * g + blue * blue) / 3);
  }
  return a == b ? 0 : 1;
}

Value value_of(const Attribute& attribute, std::string_view text) {
  const Value value = read_value(attribute, text);
  return fits(attribute, value) ? value : Value{};
}

tl::expected<Value, std::string> parse_value(const Attribute& attribute, std::string_view text) {
  const Value value = value_of(attribute, text);
  if (known(value)) return value;
  return tl::make_unexpected(fmt::format("`{}` is no value of it; valid: {}", text, describe(attribute)));
}

size_t write_value(const Attribute& attribute, const Value& value, std::span<char> into) {
  if (!fits(attribute, value)) return 0;
  const auto write = [&]<class... T>(fmt::format_string<T...> form, T&&... values) {
    return fmt::format_to_n(into.data(), into.size(), form, std::forward<T>(values)...).size;
  };
  switch (attribute.kind) {
    case ValueKind::scalar: return write("{:g}{}", std::get<double>(value), attribute.unit);
    case ValueKind::boolean: return write("{}", std::get<bool>(value));
    case ValueKind::colour: {
      const Rgb& c = std::get<Rgb>(value);
      return write("{:g} {:g} {:g}", c.r, c.g, c.b);
    }
    case ValueKind::enumerated: break;
  }
  return write("{}", attribute.words[std::get<Word>(value).index]);
}

std::string to_text(const Attribute& attribute, const Value& value) {
  std::string text(write_value(attribute, value, {}), '\0');
  write_value(attribute, value, text);
  return text.empty() ? "unknown" : text;
}

std::string describe(const Attribute& attribute) {
  switch (attribute.kind) {
    case ValueKind::scalar:
      return fmt::format("{:g}{} .. {:g}{}", attribute.low, attribute.unit, attribute.high, attribute.unit);
    case ValueKind::boolean: return "true, false";
    case ValueKind::colour: return "three channels of 0..1 such as [0.9, 0.1, 0.1]";
    case ValueKind::enumerated: break;
  }
  return fmt::format("{}", fmt::join(attribute.words, ", "));
}

}  // namespace takt::semantic
