// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <cstddef>

#include "nodes/cuda/table.hpp"

namespace takt::test {

/// How many values of a random case differ from the definition; says which first.
size_t check_stereo(const cuda::Table& card, unsigned seed);
size_t check_cooccurrences(const cuda::Table& card, unsigned seed);
/// Bounds around what a match takes: one that is late leaves its memory alone, one that is done has written all of it.
size_t check_bounds(const cuda::Table& card);

}  // namespace takt::test
