// SPDX-License-Identifier: Apache-2.0
// Objects out of photographs: reference views for the database.
#pragma once
#include <filesystem>

#include "nodes/object_detection/database.hpp"

namespace takt::object_detection {

/// The object of a photograph before a plain background, the whole photograph at `side_px`: background is what hangs
/// together with the border and differs from the border's median colour by at most 30 in each channel. Throws
/// std::runtime_error if it cannot be read.
ReferenceView cut_out(const std::filesystem::path& file, int side_px);

/// The object of an image as a view of the database: its longer edge fills `side_px`, its middle is the view's. It is
/// where an alpha channel is 128 or more; without one where the image is not exactly (0, 0, 0), if its border is for
/// the most part; else as in cut_out(). An image of `side_px` x `side_px` on black is taken as it is. Throws
/// std::runtime_error, with the file, if it cannot be read or the object would be nothing or everything.
ReferenceView learn_view(const std::filesystem::path& file, int side_px);

/// Writes a view as the database reads it (PNG). Throws std::runtime_error if it cannot.
void write_view(const ReferenceView& view, const std::filesystem::path& file);

}  // namespace takt::object_detection
