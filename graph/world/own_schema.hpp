// SPDX-License-Identifier: Apache-2.0
// Messages that no well-known schema fits: a schema of takt_msgs from the fields of their type, and their bytes in it.
//
//   own_schema("laser_scan");     // "takt_msgs/msg/LaserScan" (encoder.hpp)
//   own_definition(type.fields);  // "builtin_interfaces/Time timestamp\nfloat64 first_angle_rad  # rad\n..."
//   write_own(writer, stamp_ns, type.fields, [&](const Field& field) { return piece_of(field); });
//
// Every scalar keeps its type, an array of structs of one scalar becomes one sequence of these, a text a string.
#pragma once
#include <cstddef>
#include <cstdint>
#include <functional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "graph/world/cdr_writer.hpp"
#include "rt/msg/field.hpp"

namespace takt::world {

/// The scalars of a field, where they lie.
using PieceOf = std::function<std::span<const std::byte>(const Field&)>;

/// Names of the fields in the form that ROS 2 allows, each another one; `timestamp` is none of them.
std::vector<std::string> legal_names(std::span<const Field> fields);

/// Units are comments.
std::string own_definition(std::span<const Field> fields);

void write_own(CdrWriter& to, int64_t stamp_ns, std::span<const Field> fields, const PieceOf& piece_of);

}  // namespace takt::world
