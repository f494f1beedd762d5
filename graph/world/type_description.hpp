// SPDX-License-Identifier: Apache-2.0
// How ROS 2 describes a type to compute its hash (REP 2016): JSON of its fields and of those of all types that it uses.
//
//   type_description<ros::String>();  // {"type_description": {"type_name": "std_msgs/msg/String", "fields": [...
//
// "RIHS01_" and the SHA-256 of that text in hexadecimal is the hash that `ros2 topic info --verbose` shows.
#pragma once
#include <map>
#include <string>

#include "graph/world/schema.hpp"

namespace takt::world {
namespace detail {

/// type_description_interfaces/msg/FieldType; an array has more on top of its element.
enum FieldType : int { kNested = 1, kByte = 16, kText = 17, kFixedArray = 48, kSequence = 144 };

template <class T>
constexpr int field_type() {
  if constexpr (std::is_same_v<T, bool>) return 15;
  else if constexpr (std::is_same_v<T, std::byte>) return kByte;
  else if constexpr (std::is_floating_point_v<T>) return sizeof(T) == 4 ? 10 : 11;
  else if constexpr (std::is_arithmetic_v<T>)
    return (sizeof(T) == 1 ? 2 : sizeof(T) == 2 ? 4 : sizeof(T) == 4 ? 6 : 8) + (std::is_unsigned_v<T> ? 1 : 0);
  else if constexpr (std::is_same_v<T, std::string_view>) return kText;
  else return kNested;
}

template <class T>
struct ElementOf {
  using type = T;
  static constexpr int array = 0;
  static constexpr size_t capacity = 0;
};
template <class T>
requires Fixed<T>::value struct ElementOf<T> {
  using type = typename Fixed<T>::Element;
  static constexpr int array = kFixedArray;
  static constexpr size_t capacity = Fixed<T>::size;
};
template <class T>
requires(Packed<T> || Sequence<T>::value) struct ElementOf<T> {
  static constexpr auto element() {
    if constexpr (Packed<T>) return std::type_identity<typename T::Element>{};
    else return std::type_identity<typename Sequence<T>::Element>{};
  }
  using type = typename decltype(element())::type;
  static constexpr int array = kSequence;
  static constexpr size_t capacity = 0;
};

/// The description of S into `all`, by name, and of what it uses.
template <Schema S>
void describe(std::map<std::string, std::string>& all) {
  std::string fields;
  for_each_member(S{}, [&]<class M>(std::string_view name, const M&) {
    using Element = typename ElementOf<M>::type;
    std::string nested;
    if constexpr (Schema<Element>) {
      nested = full_name(Element::schema_name);
      describe<Element>(all);
    }
    fields += std::string(fields.empty() ? "" : ", ") + "{\"name\": \"" + std::string(name) +
              "\", \"type\": {\"type_id\": " + std::to_string(field_type<Element>() + ElementOf<M>::array) +
              ", \"capacity\": " + std::to_string(ElementOf<M>::capacity) +
              ", \"string_capacity\": 0, \"nested_type_name\": \"" + nested + "\"}}";
  });
  const std::string name = full_name(S::schema_name);
  all[name] = "{\"type_name\": \"" + name + "\", \"fields\": [" + fields + "]}";
}

}  // namespace detail

template <Schema S>
std::string type_description() {
  std::map<std::string, std::string> all;
  detail::describe<S>(all);
  const auto own = all.extract(full_name(S::schema_name));
  std::string used;
  for (const auto& [name, text] : all) used += (used.empty() ? "" : ", ") + text;
  return "{\"type_description\": " + own.mapped() + ", \"referenced_type_descriptions\": [" + used + "]}";
}

}  // namespace takt::world
