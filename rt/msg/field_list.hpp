// SPDX-License-Identifier: Apache-2.0
// For the .cpp files of messages: defines Message::fields().
//   TAKT_FIELDS(Pose, TAKT_TRANSFORM_FIELDS(Pose, transform), TAKT_FIELD(Pose, covariance, ""))
// The order is part of every record.
#pragma once
#include <array>
#include <cstddef>
#include <span>

#include "rt/msg/field.hpp"

// offsetof on these standard-layout-but-for-deleted-copy structs is well defined with every compiler we support.
#pragma GCC diagnostic ignored "-Winvalid-offsetof"

#define TAKT_FIELDS(M, ...)                                           \
  std::span<const Field> M::fields() {                                \
    static constexpr auto list = std::to_array<Field>({__VA_ARGS__}); \
    return list;                                                      \
  }
#define TAKT_CAMERA_FIELDS(M)                                                              \
  TAKT_NESTED_FIELD(M, camera, focal_px, "px"), TAKT_NESTED_FIELD(M, camera, cu_px, "px"), \
      TAKT_NESTED_FIELD(M, camera, cv_px, "px"), TAKT_NESTED_FIELD(M, camera, baseline_m, "m")
#define TAKT_TRANSFORM_FIELDS(M, t)                                                                         \
  TAKT_NESTED_FIELD(M, t, x, "m"), TAKT_NESTED_FIELD(M, t, y, "m"), TAKT_NESTED_FIELD(M, t, z, "m"),        \
      TAKT_NESTED_FIELD(M, t, qw, "1"), TAKT_NESTED_FIELD(M, t, qx, "1"), TAKT_NESTED_FIELD(M, t, qy, "1"), \
      TAKT_NESTED_FIELD(M, t, qz, "1")
