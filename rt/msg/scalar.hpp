// SPDX-License-Identifier: Apache-2.0
// Installed as <takt/msg/scalar.hpp>: core, experimental.
// What can be done with the scalars of a message whose type is known by its descriptors only.
#pragma once
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <string_view>

#include "rt/msg/field.hpp"

namespace takt {

/// Calls visit(value) with the scalar that lies at `at`, in its own type. No alignment is needed.
template <class Visit>
auto visit_scalar(Scalar scalar, const std::byte* at, const Visit& visit) {
  const auto read = [&](auto value) {
    std::memcpy(&value, at, sizeof value);
    return visit(value);
  };
  switch (scalar) {
    case Scalar::u8: return read(uint8_t{});
    case Scalar::i16: return read(int16_t{});
    case Scalar::u16: return read(uint16_t{});
    case Scalar::i32: return read(int32_t{});
    case Scalar::u32: return read(uint32_t{});
    case Scalar::i64: return read(int64_t{});
    case Scalar::u64: return read(uint64_t{});
    case Scalar::f32: return read(float{});
    case Scalar::f64: break;
  }
  return read(double{});
}

inline size_t scalar_bytes(Scalar scalar) {
  constexpr std::byte none[sizeof(uint64_t)]{};
  return visit_scalar(scalar, none, [](auto value) { return sizeof value; });
}

constexpr std::string_view name_of(Scalar scalar) {
  constexpr std::string_view names[]{"u8", "i16", "u16", "i32", "u32", "i64", "u64", "f32", "f64"};
  return names[static_cast<size_t>(scalar)];
}

/// The Array at `at`, whatever it holds: every one begins alike.
inline const Array<std::byte>& any_array(const std::byte* at) { return *reinterpret_cast<const Array<std::byte>*>(at); }

}  // namespace takt
