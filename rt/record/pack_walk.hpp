// SPDX-License-Identifier: Apache-2.0
// How jobs and events become bytes of a record, and back. One walk over the members serves both directions: `PackOut`
// appends them, `PackIn` fills them in. Little-endian, no padding; a list is its length (u32) and the elements.
//
//   template <class Walk, class Run> void walk(Walk& at, Run& run) { at.number(run.first), at.number(run.count); }
//   PackOut out(bytes);      walk(out, run);
//   PackIn in(bytes);        walk(in, run);      // throws std::runtime_error if the bytes end too early
#pragma once
#include <bit>
#include <cstddef>
#include <cstdint>
#include <stdexcept>
#include <string>
#include <type_traits>
#include <variant>
#include <vector>

#include "rt/node.hpp"
#include "rt/record/mcap/bytes.hpp"

namespace takt::record {

class PackOut {
 public:
  explicit PackOut(std::vector<std::byte>& to) : writer_(to) {}
  template <class T>
  void number(const T& value) {
    writer_.number(static_cast<std::make_unsigned_t<T>>(value));
  }
  void flag(const bool& value) { number(static_cast<uint8_t>(value)); }
  template <class T, class Each>
  void list(const std::vector<T>& elements, const Each& each) {
    number(static_cast<uint32_t>(elements.size()));
    for (const T& element : elements) each(element);
  }
  void question(const Question& value) { number(static_cast<uint8_t>(value)); }
  void text(const std::string& value) { writer_.text(value); }
  void value(const ParamValue& value) {
    number(static_cast<uint8_t>(value.index()));
    if (const auto* flag = std::get_if<bool>(&value)) this->flag(*flag);
    if (const auto* whole = std::get_if<int64_t>(&value)) number(*whole);
    if (const auto* real = std::get_if<double>(&value)) number(std::bit_cast<uint64_t>(*real));
    if (const auto* text = std::get_if<std::string>(&value)) writer_.text(*text);
  }

 private:
  mcap::ByteWriter writer_;
};

class PackIn {
 public:
  explicit PackIn(mcap::Bytes from) : reader_(from) {}
  size_t left() const { return reader_.left(); }
  template <class T>
  void number(T& value) {
    value = static_cast<T>(reader_.number<std::make_unsigned_t<T>>());
  }
  void flag(bool& value) { value = reader_.number<uint8_t>() != 0; }
  template <class T, class Each>
  void list(std::vector<T>& elements, const Each& each) {
    const auto count = reader_.number<uint32_t>();
    if (count > left()) throw mcap::TooShort();  // an element has at least one byte
    elements.resize(count);
    for (T& element : elements) each(element);
  }
  void text(std::string& value) { value = reader_.text(); }
  void question(Question& value) {
    const auto number = reader_.number<uint8_t>();
    if (number > static_cast<uint8_t>(Question::done)) throw std::runtime_error("a job asked what there is not to ask");
    value = static_cast<Question>(number);
  }
  void value(ParamValue& value) {
    switch (reader_.number<uint8_t>()) {
      case 0: value = reader_.number<uint8_t>() != 0; return;
      case 1: value = static_cast<int64_t>(reader_.number<uint64_t>()); return;
      case 2: value = std::bit_cast<double>(reader_.number<uint64_t>()); return;
      case 3: value = reader_.text(); return;
      default: throw std::runtime_error("a parameter is of no known kind");
    }
  }

 private:
  mcap::ByteReader reader_;
};

}  // namespace takt::record
