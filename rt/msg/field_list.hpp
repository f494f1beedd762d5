// SPDX-License-Identifier: Apache-2.0
// Installed as <takt/msg/field_list.hpp>: core, stable.
// Declares the fields of a message, once, in its class:
//
//   struct Wheel {
//     static constexpr std::string_view type_name = "wheel";
//     double speed_m_s = 0;
//     Transform wheel_in_robot;
//     Array<float> current_a;
//     TAKT_FIELDS(Wheel, (speed_m_s, "m/s"), (wheel_in_robot), (current_a, "A", capacity.count))
//   };
//
// An entry is (member), (member, unit) or, of an Array, (member, unit, elements that it has room for): an expression of
// `capacity`, what the port was sized for (rt/msg/field.hpp). Units are SI symbols, "px", "1" for a pure number, "" for
// flags and text. A member that is a struct with TAKT_PARTS takes no unit: its parts have their own. All members are
// listed, once each, in the order of their declaration; that order is part of every record. What is forgotten does not
// compile.
#pragma once
#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string_view>
#include <type_traits>

#include "rt/msg/field.hpp"

namespace takt::detail {

/// A name as a template argument, so that names put together have a place of their own.
template <size_t N>
struct Name {
  char text[N]{};
  consteval Name() = default;
  consteval Name(const char (&from)[N]) {  // NOLINT(google-explicit-constructor): written as a literal
    for (size_t i = 0; i < N; ++i) text[i] = from[i];
  }
  constexpr std::string_view view() const { return {text, N - 1}; }
};

template <size_t A, size_t B>
consteval Name<A + B> dotted(const Name<A>& outer, const Name<B>& inner) {
  Name<A + B> whole;
  for (size_t i = 0; i < A; ++i) whole.text[i] = outer.text[i];
  whole.text[A - 1] = '.';
  for (size_t i = 0; i < B; ++i) whole.text[A + i] = inner.text[i];
  return whole;
}

template <Name name>
inline constexpr auto kept_name = name;

/// The fields that a member makes: one, or those of its parts.
template <class T, Name name>
consteval auto fields_of(size_t offset, std::string_view unit = "") {
  if constexpr (requires { T::template parts<name>(offset); }) return T::template parts<name>(offset);
  else return std::array{Describe<T>::field(kept_name<name>.view(), unit, offset)};
}

template <size_t... N>
consteval auto joined(const std::array<Field, N>&... lists) {
  std::array<Field, (N + ... + 0)> all{};
  size_t at = 0;
  const auto append = [&](const auto& list) {
    for (const Field& field : list) all[at++] = field;
  };
  (append(lists), ...);
  return all;
}

/// Where a member lies, for the check that none is forgotten.
struct Member {
  size_t offset, bytes, alignment;
};

/// Whether these are all members of a struct of that size, in their order: nothing but padding lies between them.
template <size_t N>
consteval bool all_listed(const std::array<Member, N>& members, size_t bytes, size_t alignment) {
  const auto align = [](size_t at, size_t to) { return (at + to - 1) / to * to; };
  size_t end = 0;
  for (const Member& member : members) {
    if (member.offset != align(end, member.alignment)) return false;
    end = member.offset + member.bytes;
  }
  return align(end, alignment) == bytes;
}

template <class T>
inline constexpr bool is_array = false;
template <class T>
inline constexpr bool is_array<Array<T>> = true;

/// Notes for how many elements an Array has room; of other members nothing.
template <class T>
void give_room(std::span<uint32_t> elements, size_t& array, const Capacity& capacity) {
  if constexpr (is_array<T>) elements[array++] = capacity.count;
}
template <class T, class Room>
void give_room(std::span<uint32_t> elements, size_t& array, const Capacity&, Room room) {
  static_assert(is_array<T>, "only an Array has room for elements");
  elements[array++] = static_cast<uint32_t>(room);
}

}  // namespace takt::detail

// TAKT_FOR_EACH(MACRO, M, entry, ...): MACRO(M, entry) for each, with commas between.
#define TAKT_PARENTHESES ()
#define TAKT_EXPAND(...) TAKT_EXPAND_3(TAKT_EXPAND_3(TAKT_EXPAND_3(TAKT_EXPAND_3(__VA_ARGS__))))
#define TAKT_EXPAND_3(...) TAKT_EXPAND_2(TAKT_EXPAND_2(TAKT_EXPAND_2(TAKT_EXPAND_2(__VA_ARGS__))))
#define TAKT_EXPAND_2(...) TAKT_EXPAND_1(TAKT_EXPAND_1(TAKT_EXPAND_1(TAKT_EXPAND_1(__VA_ARGS__))))
#define TAKT_EXPAND_1(...) __VA_ARGS__
#define TAKT_FOR_EACH(MACRO, M, ...) __VA_OPT__(TAKT_EXPAND(TAKT_FOR_EACH_STEP(MACRO, M, __VA_ARGS__)))
#define TAKT_FOR_EACH_STEP(MACRO, M, entry, ...) \
  MACRO(M, entry) __VA_OPT__(, TAKT_FOR_EACH_AGAIN TAKT_PARENTHESES(MACRO, M, __VA_ARGS__))
#define TAKT_FOR_EACH_AGAIN() TAKT_FOR_EACH_STEP

// An entry `(member, unit, room)` is taken apart behind its parentheses; what it leaves out is empty.
#define TAKT_TAKE_APART(MACRO, M, ...) MACRO(M, __VA_ARGS__, , , )
#define TAKT_CONTENT(...) __VA_ARGS__
#define TAKT_COMMA_AND(...) __VA_OPT__(, __VA_ARGS__)
#define TAKT_FIELD_ENTRY(M, entry) TAKT_TAKE_APART(TAKT_FIELD_OF, M, TAKT_CONTENT entry)
#define TAKT_FIELD_OF(M, member, unit, ...)                                                         \
  ::takt::detail::fields_of<decltype(M::member), ::takt::detail::Name{#member}>(offsetof(M, member) \
                                                                                    TAKT_COMMA_AND(unit))
#define TAKT_PART_ENTRY(M, entry) TAKT_TAKE_APART(TAKT_PART_OF, M, TAKT_CONTENT entry)
#define TAKT_PART_OF(M, member, unit, ...)                                                                      \
  ::takt::detail::fields_of<decltype(M::member), ::takt::detail::dotted(outer, ::takt::detail::Name{#member})>( \
      base + offsetof(M, member) TAKT_COMMA_AND(unit))
#define TAKT_PLACE_ENTRY(M, entry) TAKT_TAKE_APART(TAKT_PLACE_OF, M, TAKT_CONTENT entry)
#define TAKT_PLACE_OF(M, member, ...) \
  ::takt::detail::Member { offsetof(M, member), sizeof(M::member), alignof(decltype(M::member)) }
#define TAKT_ROOM_ENTRY(M, entry) TAKT_TAKE_APART(TAKT_ROOM_OF, M, TAKT_CONTENT entry)
#define TAKT_ROOM_OF(M, member, unit, room, ...) \
  ::takt::detail::give_room<decltype(M::member)>(elements, array, capacity TAKT_COMMA_AND(room))

#define TAKT_ALL_LISTED(M, ...)                                                                                       \
  static_assert(                                                                                                      \
      ::takt::detail::all_listed(std::array{TAKT_FOR_EACH(TAKT_PLACE_ENTRY, M, __VA_ARGS__)}, sizeof(M), alignof(M)), \
      #M ": a member is missing from its list, or they are not in the order of their declaration")

#define TAKT_FIELDS(M, ...)                                                                                 \
  static std::span<const ::takt::Field> fields() {                                                          \
    static_assert(std::is_trivially_destructible_v<M>, #M " must be plain data: it lies in shared memory"); \
    TAKT_ALL_LISTED(M, __VA_ARGS__);                                                                        \
    static constexpr auto list = ::takt::detail::joined(TAKT_FOR_EACH(TAKT_FIELD_ENTRY, M, __VA_ARGS__));   \
    return list;                                                                                            \
  }                                                                                                         \
  static void capacities([[maybe_unused]] const ::takt::Capacity& capacity,                                 \
                         [[maybe_unused]] std::span<uint32_t> elements) {                                   \
    [[maybe_unused]] size_t array = 0;                                                                      \
    TAKT_FOR_EACH(TAKT_ROOM_ENTRY, M, __VA_ARGS__);                                                         \
  }

/// For a struct that is a member of messages: TAKT_PARTS(Transform, (x, "m"), ...), its entries as those above.
#define TAKT_PARTS(T, ...)                                                         \
  template <::takt::detail::Name outer>                                            \
  static consteval auto parts(size_t base) {                                       \
    TAKT_ALL_LISTED(T, __VA_ARGS__);                                               \
    return ::takt::detail::joined(TAKT_FOR_EACH(TAKT_PART_ENTRY, T, __VA_ARGS__)); \
  }
