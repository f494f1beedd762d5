// SPDX-License-Identifier: Apache-2.0
#include "tests/ros2/decoded.hpp"

#include <fastcdr/Cdr.h>

#include <cmath>
#include <functional>
#include <iomanip>
#include <map>
#include <sstream>
#include <stdexcept>

namespace takt::test {
namespace {

using eprosima::fastcdr::Cdr;

template <class T>
T take(Cdr& from) {
  T value{};
  from >> value;
  return value;
}

std::string quoted(const std::string& text) {
  std::ostringstream out;
  out << '"';
  for (const char c : text)
    if (c == '"' || c == '\\') out << '\\' << c;
    else if (static_cast<unsigned char>(c) >= ' ') out << c;
  out << '"';
  return out.str();
}

std::string number(double value) {
  if (!std::isfinite(value)) return std::isnan(value) ? "\"nan\"" : value > 0 ? "\"inf\"" : "\"-inf\"";
  std::ostringstream out;
  out << std::setprecision(17) << value;
  return out.str();
}

template <class T>
std::string numbers(const std::vector<T>& values) {
  std::string text = "[";
  for (const T value : values) text += (text.size() > 1 ? "," : "") + number(static_cast<double>(value));
  return text + "]";
}

std::string text_of(Cdr& from) { return quoted(take<std::string>(from)); }
std::string double_of(Cdr& from) { return number(take<double>(from)); }
std::string float_of(Cdr& from) { return number(static_cast<double>(take<float>(from))); }
std::string count_of(Cdr& from) { return std::to_string(take<uint32_t>(from)); }
std::string time_of(Cdr& from) {
  const auto seconds = take<int32_t>(from);
  const auto nanoseconds = take<uint32_t>(from);
  return std::to_string(int64_t{seconds} * 1'000'000'000 + nanoseconds);
}
std::string header(Cdr& from) {
  const std::string stamp = time_of(from);
  return "{\"stamp_ns\":" + stamp + ",\"frame\":" + text_of(from) + "}";
}
/// So many doubles, one after the other.
std::string doubles(Cdr& from, int count) {
  std::string text = "[";
  for (int i = 0; i < count; ++i) text += (i > 0 ? "," : "") + double_of(from);
  return text + "]";
}
std::string pose(Cdr& from) { return doubles(from, 7); }

/// Size, a sum that depends on the order, and each 997th byte.
std::string bytes(Cdr& from) {
  const auto all = take<std::vector<uint8_t>>(from);
  uint64_t sum = 14695981039346656037ULL;  // FNV-1a
  std::vector<int> some;
  for (size_t i = 0; i < all.size(); ++i) {
    sum = (sum ^ all[i]) * 1099511628211ULL;
    if (i % 997 == 0) some.push_back(all[i]);
  }
  return "{\"size\":" + std::to_string(all.size()) + ",\"fnv\":\"" + std::to_string(sum) +
         "\",\"some\":" + numbers(some) + "}";
}
std::string sequence(Cdr& from, const std::function<std::string(Cdr&)>& element) {
  std::string text = "[";
  const auto count = take<uint32_t>(from);
  for (uint32_t i = 0; i < count; ++i) text += (i > 0 ? "," : "") + element(from);
  return text + "]";
}

std::string image(Cdr& from) {
  std::string text = "{\"header\":" + header(from);
  text += ",\"height\":" + count_of(from);
  text += ",\"width\":" + count_of(from);
  text += ",\"encoding\":" + text_of(from);
  text += ",\"big\":" + std::to_string(take<uint8_t>(from));
  text += ",\"step\":" + count_of(from);
  return text + ",\"data\":" + bytes(from) + "}";
}
std::string compressed(Cdr& from) {
  std::string text = "{\"header\":" + header(from);
  text += ",\"format\":" + text_of(from);
  return text + ",\"data\":" + bytes(from) + "}";
}
std::string camera_info(Cdr& from) {
  std::string text = "{\"header\":" + header(from);
  text += ",\"height\":" + count_of(from);
  text += ",\"width\":" + count_of(from);
  text += ",\"model\":" + text_of(from);
  text += ",\"d\":" + numbers(take<std::vector<double>>(from));
  text += ",\"k\":" + doubles(from, 9);
  text += ",\"r\":" + doubles(from, 9);
  text += ",\"p\":" + doubles(from, 12);
  text += ",\"binning\":" + count_of(from) + ",\"binning_y\":" + count_of(from);
  for (int i = 0; i < 4; ++i) count_of(from);
  take<bool>(from);
  return text + "}";
}
std::string scan(Cdr& from) {
  std::string text = "{\"header\":" + header(from);
  for (const char* name :
       {"angle_min", "angle_max", "angle_increment", "time_increment", "scan_time", "range_min", "range_max"})
    text += std::string(",\"") + name + "\":" + float_of(from);
  text += ",\"ranges\":" + numbers(take<std::vector<float>>(from));
  return text + ",\"intensities\":" + numbers(take<std::vector<float>>(from)) + "}";
}
std::string odometry(Cdr& from) {
  std::string text = "{\"header\":" + header(from);
  text += ",\"child\":" + text_of(from);
  text += ",\"pose\":" + pose(from);
  text += ",\"pose_covariance\":" + doubles(from, 36);
  text += ",\"twist\":" + doubles(from, 6);
  return text + ",\"twist_covariance\":" + doubles(from, 36) + "}";
}
std::string grid(Cdr& from) {
  std::string text = "{\"header\":" + header(from);
  text += ",\"load_ns\":" + time_of(from);
  text += ",\"resolution\":" + float_of(from);
  text += ",\"width\":" + count_of(from);
  text += ",\"height\":" + count_of(from);
  text += ",\"origin\":" + pose(from);
  return text + ",\"cells\":" + numbers(take<std::vector<int8_t>>(from)) + "}";
}
std::string cloud(Cdr& from) {
  std::string text = "{\"header\":" + header(from);
  text += ",\"height\":" + count_of(from);
  text += ",\"width\":" + count_of(from);
  text += ",\"fields\":" + sequence(from, [](Cdr& field) {
            std::string one = "[" + text_of(field);
            one += "," + count_of(field);
            one += "," + std::to_string(take<uint8_t>(field));
            return one + "," + count_of(field) + "]";
          });
  text += std::string(",\"big\":") + (take<bool>(from) ? "true" : "false");
  text += ",\"point_step\":" + count_of(from);
  text += ",\"row_step\":" + count_of(from);
  text += ",\"data\":" + bytes(from);
  return text + ",\"dense\":" + (take<bool>(from) ? "true" : "false") + "}";
}
std::string transforms(Cdr& from) {
  return "{\"transforms\":" +
         sequence(from,
                  [](Cdr& one) {
                    std::string text = "{\"header\":" + header(one);
                    text += ",\"child\":" + text_of(one);
                    return text + ",\"pose\":" + doubles(one, 7) + "}";
                  }) +
         "}";
}
std::string diagnostics(Cdr& from) {
  std::string text = "{\"header\":" + header(from);
  return text + ",\"status\":" +
         sequence(from,
                  [](Cdr& one) {
                    std::string status = "{\"level\":" + std::to_string(take<uint8_t>(one));
                    status += ",\"name\":" + text_of(one);
                    status += ",\"message\":" + text_of(one);
                    status += ",\"hardware_id\":" + text_of(one);
                    return status + ",\"values\":" +
                           sequence(one,
                                    [](Cdr& pair) {
                                      const std::string key = text_of(pair);
                                      return "[" + key + "," + text_of(pair) + "]";
                                    }) +
                           "}";
                  }) +
         "}";
}
std::string gid(Cdr& from) {
  std::ostringstream text;
  for (int i = 0; i < 16; ++i) text << std::hex << std::setw(2) << std::setfill('0') << int{take<uint8_t>(from)};
  return quoted(text.str());
}
std::string entities(Cdr& from) {
  std::string text = "{\"gid\":" + gid(from);
  return text + ",\"nodes\":" +
         sequence(from,
                  [](Cdr& one) {
                    std::string node = "{\"namespace\":" + text_of(one);
                    node += ",\"name\":" + text_of(one);
                    node += ",\"readers\":" + sequence(one, gid);
                    return node + ",\"writers\":" + sequence(one, gid) + "}";
                  }) +
         "}";
}

}  // namespace

std::string decoded(const std::string& dds_type, const std::vector<uint8_t>& cdr) {
  static const std::map<std::string, std::string (*)(Cdr&)> kTypes{
      {"sensor_msgs::msg::dds_::Image_", image},
      {"sensor_msgs::msg::dds_::CompressedImage_", compressed},
      {"sensor_msgs::msg::dds_::CameraInfo_", camera_info},
      {"sensor_msgs::msg::dds_::LaserScan_", scan},
      {"sensor_msgs::msg::dds_::PointCloud2_", cloud},
      {"nav_msgs::msg::dds_::Odometry_", odometry},
      {"nav_msgs::msg::dds_::OccupancyGrid_", grid},
      {"tf2_msgs::msg::dds_::TFMessage_", transforms},
      {"diagnostic_msgs::msg::dds_::DiagnosticArray_", diagnostics},
      {"rmw_dds_common::msg::dds_::ParticipantEntitiesInfo_", entities}};
  const auto type = kTypes.find(dds_type);
  if (type == kTypes.end()) throw std::runtime_error("no decoder of " + dds_type);
  std::vector<uint8_t> copy(cdr);
  eprosima::fastcdr::FastBuffer buffer(reinterpret_cast<char*>(copy.data()), copy.size());
  Cdr from(buffer, Cdr::DEFAULT_ENDIAN, Cdr::DDS_CDR);
  from.read_encapsulation();
  std::string text = type->second(from);
  constexpr size_t kAlignedTo = 4;  // the protocol sends whole words
  if (copy.size() - from.getSerializedDataLength() >= kAlignedTo) throw std::runtime_error("bytes behind the message");
  return text;
}

}  // namespace takt::test
