// SPDX-License-Identifier: Apache-2.0
// A type of DDS whose samples are their CDR, whatever it is called: bytes in, bytes out. So no type is generated.
//
//   ddsi_sertype* type = raw_type("sensor_msgs::msg::dds_::Image_");
//   dds_entity_t topic = dds_create_topic_sertype(participant, "rt/image", &type, qos, nullptr, nullptr);
//   dds_writecdr(writer, raw_sample(writers_type, cdr));   // which keeps it
//
// Over the interface of Cyclone DDS 0.10 that its middleware for ROS 2 uses, too.
#pragma once
#include <cstddef>
#include <span>
#include <string>

struct ddsi_sertype;
struct ddsi_serdata;

namespace takt::dds {

/// Without a key.
ddsi_sertype* raw_type(const std::string& name);
/// A copy of `cdr`, with its header of four bytes.
ddsi_serdata* raw_sample(const ddsi_sertype& type, std::span<const std::byte> cdr);
/// Of a sample of such a type; valid as long as the sample.
std::span<const std::byte> bytes_of(const ddsi_serdata& sample);

}  // namespace takt::dds
