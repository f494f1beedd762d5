// SPDX-License-Identifier: Apache-2.0
// Installed as <takt/msg/field.hpp>: core, stable.
#pragma once
#include <cstddef>
#include <cstdint>
#include <new>
#include <span>
#include <string_view>
#include <type_traits>

#include "rt/msg/array.hpp"

namespace takt {

class Viewer;  // rt/msg/viewer.hpp

enum class Scalar : uint8_t { u8, i16, u16, i32, u32, i64, u64, f32, f64 };

/// One field of a message, declared in its class (rt/msg/field_list.hpp) and shared by checker, recorder, diff and
/// export. A field is `count` scalars at `offset` in the header (count 0: an Array of elements of `element_bytes`).
struct Field {
  std::string_view name;
  std::string_view unit;  ///< SI symbol, "px", "1" for a pure number, "" for flags and text
  Scalar scalar;
  uint32_t offset;
  uint32_t count;
  uint32_t element_bytes;
  bool text = false;  ///< an Array<char>
  bool is_array() const { return count == 0; }
};

namespace detail {

template <class T>
constexpr Scalar scalar_of() {
  if constexpr (std::is_enum_v<T>) return scalar_of<std::underlying_type_t<T>>();
  else if constexpr (std::is_same_v<T, uint8_t> || std::is_same_v<T, char> || std::is_same_v<T, bool>)
    return Scalar::u8;
  else if constexpr (std::is_same_v<T, int16_t>) return Scalar::i16;
  else if constexpr (std::is_same_v<T, uint16_t>) return Scalar::u16;
  else if constexpr (std::is_same_v<T, int32_t>) return Scalar::i32;
  else if constexpr (std::is_same_v<T, uint32_t>) return Scalar::u32;
  else if constexpr (std::is_same_v<T, int64_t>) return Scalar::i64;
  else if constexpr (std::is_same_v<T, uint64_t>) return Scalar::u64;
  else if constexpr (std::is_same_v<T, float>) return Scalar::f32;
  else {
    static_assert(std::is_same_v<T, double>, "a message field is a scalar, a C array of scalars or an Array");
    return Scalar::f64;
  }
}

template <class T>
struct Describe {
  using Base = std::remove_all_extents_t<T>;
  static constexpr Field field(std::string_view name, std::string_view unit, size_t offset) {
    return {name,
            unit,
            scalar_of<Base>(),
            static_cast<uint32_t>(offset),
            static_cast<uint32_t>(sizeof(T) / sizeof(Base)),  // NOLINT(bugprone-sizeof-expression): 1, or an array's
            static_cast<uint32_t>(sizeof(Base))};
  }
};

/// Elements of an Array are scalars, or structs of one scalar type (`using scalar = float;` inside the struct).
template <class T>
struct ElementScalar {
  using type = T;
};
template <class T>
requires requires { typename T::scalar; }
struct ElementScalar<T> {
  using type = typename T::scalar;
};

template <class T>
struct Describe<Array<T>> {
  static constexpr Field field(std::string_view name, std::string_view unit, size_t offset) {
    return {name,
            unit,
            scalar_of<typename ElementScalar<T>::type>(),
            static_cast<uint32_t>(offset),
            0,
            static_cast<uint32_t>(sizeof(T)),
            std::is_same_v<T, char>};
  }
};

/// Null if T has no show().
template <class T>
auto show_of() -> void (*)(const void*, Viewer&) {
  if constexpr (requires(const T& message, Viewer& to) { message.show(to); })
    return [](const void* memory, Viewer& to) { static_cast<const T*>(memory)->show(to); };
  else return nullptr;
}

}  // namespace detail

/// How large a message may become on one port; what each number means is said by the message type.
struct Capacity {
  uint32_t width = 0;
  uint32_t height = 0;
  uint32_t channels = 1;
  uint32_t count = 0;
  uint64_t pixels() const { return uint64_t{width} * height; }
};

/// Type-erased description of a message type; `of<T>()` makes it from
///   static constexpr std::string_view type_name;
///   TAKT_FIELDS(T, ...)
///   bool sound() const;   (if other fields say how far an array is read: whether they stay within its capacity)
///   void show(Viewer&) const;   (if there is more to see than fields: rt/msg/viewer.hpp)
struct MessageType {
  std::string_view name;
  uint32_t header_bytes;
  std::span<const Field> fields;
  void (*construct)(void* memory);
  void (*capacities)(const Capacity&, std::span<uint32_t>);
  bool (*sound)(const void* memory);
  void (*show)(const void* memory, Viewer& to);  ///< null: it has nothing but its fields

  /// Bytes of a message of that capacity: the header and every array, each aligned to 64 B.
  uint64_t bytes(const Capacity& capacity) const;
  /// Builds an empty message in `memory` (64-byte aligned, bytes(capacity) long) and places its arrays.
  void place(void* memory, const Capacity& capacity) const;
  /// Whether every array of the message in `memory` lies where place() put it and has no more elements than fit, and
  /// the message is sound.
  bool intact(const void* memory, const Capacity& capacity) const;

  template <class T>
  static const MessageType& of();
};

template <class T>
const MessageType& MessageType::of() {
  static const MessageType type{T::type_name,
                                sizeof(T),
                                T::fields(),
                                [](void* memory) { ::new (memory) T; },
                                [](const Capacity& c, std::span<uint32_t> out) { T::capacities(c, out); },
                                [](const void* memory) {
                                  if constexpr (requires(const T& message) { message.sound(); })
                                    return static_cast<const T*>(memory)->sound();
                                  return true;
                                },
                                detail::show_of<T>()};
  return type;
}

}  // namespace takt
