// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <dc1394/dc1394.h>

#include <string>
#include <tl/expected.hpp>

namespace takt::iidc {

// clang-format off
/// What the driver calls of libdc1394 2.2.
#define TAKT_DC1394_CALLS(CALL)                                                                                        \
  CALL(dc1394_new) CALL(dc1394_free)                                                                                   \
  CALL(dc1394_camera_enumerate) CALL(dc1394_camera_free_list) CALL(dc1394_camera_new) CALL(dc1394_camera_free)         \
  CALL(dc1394_camera_set_power)                                                                                        \
  CALL(dc1394_video_set_operation_mode) CALL(dc1394_video_set_iso_speed) CALL(dc1394_video_set_mode)                   \
  CALL(dc1394_video_set_transmission)                                                                                  \
  CALL(dc1394_format7_get_max_image_size) CALL(dc1394_format7_get_color_codings) CALL(dc1394_format7_set_roi)          \
  CALL(dc1394_format7_get_packet_parameters) CALL(dc1394_format7_set_packet_size) CALL(dc1394_format7_get_total_bytes) \
  CALL(dc1394_feature_set_mode) CALL(dc1394_feature_set_value) CALL(dc1394_feature_set_absolute_control)               \
  CALL(dc1394_feature_set_absolute_value)                                                                              \
  CALL(dc1394_external_trigger_set_mode) CALL(dc1394_external_trigger_set_source)                                      \
  CALL(dc1394_external_trigger_set_polarity) CALL(dc1394_external_trigger_set_power)                                   \
  CALL(dc1394_capture_setup) CALL(dc1394_capture_stop) CALL(dc1394_capture_get_fileno) CALL(dc1394_capture_dequeue)    \
  CALL(dc1394_capture_enqueue) CALL(dc1394_capture_is_frame_corrupt)
// clang-format on

/// Those functions. The library is loaded where a graph has such a camera: nobody else needs it.
struct Dc1394Calls {
#define TAKT_CALL(name) decltype(&::name) name = nullptr;
  TAKT_DC1394_CALLS(TAKT_CALL)
#undef TAKT_CALL
};

/// Of the library on this machine, loaded once. Error: it is not installed, or lacks a function.
tl::expected<const Dc1394Calls*, std::string> load_dc1394();

}  // namespace takt::iidc
