// SPDX-License-Identifier: Apache-2.0
// A schema is a struct whose members are listed once. Both its definition and its bytes are made from that list, so
// they cannot disagree:
//
//   struct Quaternion {
//     double x = 0, y = 0, z = 0, w = 1;
//     TAKT_SCHEMA(Quaternion, "geometry_msgs/Quaternion", x, y, z, w)
//   };
//   definition<Quaternion>();        // "float64 x\nfloat64 y\n..."
//   encoded(Quaternion{});           // its CDR
//
// A member is a number, a std::byte, a text (std::string_view), another schema, a std::array of numbers or a std::span
// of any of these: a sequence. A packed sequence (see Packed) is written by itself, without a copy of its elements.
#pragma once
#include <algorithm>
#include <array>
#include <concepts>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <tuple>
#include <type_traits>
#include <vector>

#include "graph/world/cdr_writer.hpp"
#include "rt/msg/field_list.hpp"

namespace takt::world {

template <class S, class T>
struct Member {
  std::string_view name;
  T S::*at;
  constexpr Member(std::string_view name_, T S::*at_) : name(name_), at(at_) {}
};

#define TAKT_SCHEMA_MEMBER(S, member) \
  ::takt::world::Member { #member, &S::member }
/// `schema`: "package/Name". Members have the names that the schema gives them.
#define TAKT_SCHEMA(S, schema, ...)                       \
  static constexpr std::string_view schema_name = schema; \
  static constexpr auto members() { return std::tuple{TAKT_FOR_EACH(TAKT_SCHEMA_MEMBER, S, __VA_ARGS__)}; }

template <class T>
concept Schema = requires {
  T::schema_name;
  T::members();
};

/// A sequence that writes itself: `using Element`, how many there are, and all of them at `to`, which is not aligned.
template <class T>
concept Packed = requires(const T& sequence, std::byte* to) {
  typename T::Element;
  { sequence.size() } -> std::same_as<size_t>;
  sequence.fill(to);
};

namespace detail {
template <class T>
struct Sequence : std::false_type {};
template <class E>
struct Sequence<std::span<const E>> : std::true_type {
  using Element = E;
};
template <class T>
struct Fixed : std::false_type {};
template <class E, size_t N>
struct Fixed<std::array<E, N>> : std::true_type {
  using Element = E;
  static constexpr size_t size = N;
};
}  // namespace detail

/// As ros2msg names the type of a number.
template <class T>
constexpr std::string_view number_name() {
  if constexpr (std::is_same_v<T, bool>) return "bool";
  else if constexpr (std::is_floating_point_v<T>) return sizeof(T) == 4 ? "float32" : "float64";
  else {
    constexpr std::string_view names[2][4]{{"uint8", "uint16", "uint32", "uint64"},
                                           {"int8", "int16", "int32", "int64"}};
    return names[std::is_signed_v<T> ? 1 : 0][sizeof(T) == 1 ? 0 : sizeof(T) == 2 ? 1 : sizeof(T) == 4 ? 2 : 3];
  }
}

template <class T>
std::string type_text() {
  if constexpr (std::is_arithmetic_v<T>) return std::string(number_name<T>());
  else if constexpr (std::is_same_v<T, std::byte>) return "byte";
  else if constexpr (std::is_same_v<T, std::string_view>) return "string";
  else if constexpr (Schema<T>) return std::string(T::schema_name);
  else if constexpr (detail::Fixed<T>::value)
    return type_text<typename detail::Fixed<T>::Element>() + "[" + std::to_string(detail::Fixed<T>::size) + "]";
  else if constexpr (Packed<T>) return type_text<typename T::Element>() + "[]";
  else return type_text<typename detail::Sequence<T>::Element>() + "[]";
}

/// Calls each(name, member) for the members of a schema, in their order.
template <Schema S, class Each>
void for_each_member(const S& value, const Each& each) {
  std::apply([&](const auto&... member) { (each(member.name, value.*member.at), ...); }, S::members());
}

template <class T>
void write(CdrWriter& to, const T& value) {
  if constexpr (std::is_arithmetic_v<T>) to.number(value);
  else if constexpr (std::is_same_v<T, std::byte>) to.number(static_cast<uint8_t>(value));
  else if constexpr (std::is_same_v<T, std::string_view>) to.text(value);
  else if constexpr (Schema<T>)
    for_each_member(value, [&](std::string_view, const auto& member) { write(to, member); });
  else if constexpr (detail::Fixed<T>::value) to.numbers(value.data(), value.size(), sizeof value[0]);
  else if constexpr (Packed<T>) {
    to.count(value.size());
    if (std::byte* at = to.take(value.size(), sizeof(typename T::Element))) value.fill(at);
  } else {
    using Element = typename detail::Sequence<T>::Element;
    to.count(value.size());
    if constexpr (std::is_arithmetic_v<Element>) to.numbers(value.data(), value.size(), sizeof(Element));
    else
      for (const Element& element : value) write(to, element);
  }
}

/// The CDR of what `writes(CdrWriter&)` writes. Empty: it cannot be written.
template <class Writes>
std::vector<std::byte> written(const Writes& writes) {
  CdrWriter counted({});
  writes(counted);
  std::vector<std::byte> bytes(counted.bytes());
  CdrWriter writer(bytes);
  writes(writer);
  if (!writer.complete()) bytes.clear();
  return bytes;
}

template <Schema S>
std::vector<std::byte> encoded(const S& value) {
  return written([&](CdrWriter& to) { write(to, value); });
}

/// "package/msg/Name" of "package/Name".
inline std::string full_name(std::string_view schema) {
  const size_t slash = schema.find('/');
  return std::string(schema.substr(0, slash)) + "/msg" + std::string(schema.substr(slash));
}

namespace detail {

/// Appends the schemas that T uses, each once, behind those that use it.
template <class T>
void add_used(std::vector<std::string_view>& named, std::string& text) {
  if constexpr (Schema<T>) {
    if (std::find(named.begin(), named.end(), T::schema_name) != named.end()) return;
    named.push_back(T::schema_name);
    const bool first = named.size() == 1;
    if (!first) text += std::string(80, '=') + "\nMSG: " + std::string(T::schema_name) + "\n";
    for_each_member(T{}, [&]<class M>(std::string_view name, const M&) {
      text += type_text<M>() + " " + std::string(name) + "\n";
    });
    for_each_member(T{}, [&]<class M>(std::string_view, const M&) { add_used<M>(named, text); });
  } else if constexpr (Sequence<T>::value) {
    add_used<typename Sequence<T>::Element>(named, text);
  }
}

}  // namespace detail

/// Its definition and those of the schemas that it uses, as ros2msg.
template <Schema S>
std::string definition() {
  std::vector<std::string_view> named;
  std::string text;
  detail::add_used<S>(named, text);
  return text;
}

}  // namespace takt::world
