// SPDX-License-Identifier: Apache-2.0
// A slow and plain reader of ros2msg definitions and of CDR, which knows nothing of the encoder:
//
//   const RosReader reader(schema_text(form.schema));
//   Json message = reader.read(form.bytes);  // throws std::runtime_error with what does not fit
#pragma once
#include <cctype>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <map>
#include <nlohmann/json.hpp>
#include <span>
#include <sstream>
#include <stdexcept>
#include <string>
#include <vector>

namespace takt::test {

class RosReader {
 public:
  using Json = nlohmann::ordered_json;

  explicit RosReader(const std::string& definition) {
    std::istringstream lines(definition);
    std::string name;  // of the schema whose members follow; empty: the first
    for (std::string line; std::getline(lines, line);) {
      line = line.substr(0, line.find('#'));
      while (!line.empty() && line.back() == ' ') line.pop_back();
      if (line.empty()) continue;
      if (line == std::string(80, '=')) {
        require(static_cast<bool>(std::getline(lines, line)) && line.starts_with("MSG: "), "no MSG behind =");
        name = line.substr(5);
        require(!schemas_.contains(name), "two definitions of " + name);
        schemas_[name];
        continue;
      }
      schemas_[name].push_back(member(line));
    }
    for (const auto& [schema, members] : schemas_)
      for (const Member& m : members)
        require(number_bytes(m.type) > 0 || m.type == "string" || schemas_.contains(m.type),
                "no definition of " + m.type);
  }

  Json read(std::span<const std::byte> bytes) const {
    require(bytes.size() >= 4, "no header");
    const std::byte header[]{std::byte{0}, std::byte{1}, std::byte{0}, std::byte{0}};
    require(std::memcmp(bytes.data(), header, 4) == 0, "not CDR, little-endian");
    Cursor at{bytes.subspan(4), 0};
    Json json = schema("", at);
    require(at.next == at.bytes.size(), "bytes behind the message");
    return json;
  }

 private:
  struct Member {
    std::string type, name;
    bool sequence = false;
    size_t fixed = 0;
  };
  struct Cursor {
    std::span<const std::byte> bytes;
    size_t next;
  };

  static void require(bool holds, const std::string& what) {
    if (!holds) throw std::runtime_error(what);
  }

  static Member member(const std::string& line) {
    const size_t space = line.find(' ');
    require(space != std::string::npos && line.find(' ', space + 1) == std::string::npos, "no member: " + line);
    Member m{line.substr(0, space), line.substr(space + 1)};
    if (const size_t bracket = m.type.find('['); bracket != std::string::npos) {
      require(m.type.back() == ']', "no type: " + m.type);
      const std::string count = m.type.substr(bracket + 1, m.type.size() - bracket - 2);
      m.sequence = count.empty();
      m.fixed = count.empty() ? 0 : std::stoul(count);
      m.type.resize(bracket);
    }
    bool legal = std::islower(static_cast<unsigned char>(m.name[0])) != 0 && m.name.back() != '_' &&
                 m.name.find("__") == std::string::npos;
    for (const char c : m.name) legal = legal && ((c >= 'a' && c <= 'z') || (c >= '0' && c <= '9') || c == '_');
    require(legal, "no name of ROS 2: " + m.name);
    return m;
  }

  static size_t number_bytes(const std::string& type) {
    static const std::map<std::string, size_t> bytes{{"bool", 1},  {"uint8", 1},   {"int8", 1},   {"uint16", 2},
                                                     {"int16", 2}, {"uint32", 4},  {"int32", 4},  {"uint64", 8},
                                                     {"int64", 8}, {"float32", 4}, {"float64", 8}};
    const auto found = bytes.find(type);
    return found == bytes.end() ? 0 : found->second;
  }

  template <class T>
  static T take(Cursor& at) {
    while (at.next % sizeof(T) != 0) {
      require(at.next < at.bytes.size() && at.bytes[at.next] == std::byte{0}, "padding that is not 0");
      ++at.next;
    }
    T value;
    require(at.next + sizeof value <= at.bytes.size(), "cut off");
    std::memcpy(&value, at.bytes.data() + at.next, sizeof value);
    at.next += sizeof value;
    return value;
  }

  static Json number(const std::string& type, Cursor& at) {
    if (type == "bool") return take<uint8_t>(at) != 0;
    if (type == "uint8") return take<uint8_t>(at);
    if (type == "int8") return take<int8_t>(at);
    if (type == "uint16") return take<uint16_t>(at);
    if (type == "int16") return take<int16_t>(at);
    if (type == "uint32") return take<uint32_t>(at);
    if (type == "int32") return take<int32_t>(at);
    if (type == "uint64") return take<uint64_t>(at);
    if (type == "int64") return take<int64_t>(at);
    if (type == "float32") return take<float>(at);
    return take<double>(at);
  }

  Json one(const std::string& type, Cursor& at) const {
    if (number_bytes(type) > 0) return number(type, at);
    if (type != "string") return schema(type, at);
    const auto size = take<uint32_t>(at);
    require(size > 0 && at.next + size <= at.bytes.size(), "a text that is cut off");
    const auto* text = reinterpret_cast<const char*>(at.bytes.data() + at.next);
    require(std::memchr(text, 0, size) == text + size - 1, "a text that does not end with its 0");
    at.next += size;
    return std::string(text, size - 1);
  }

  Json schema(const std::string& name, Cursor& at) const {
    Json json = Json::object();
    for (const Member& m : schemas_.at(name)) {
      Json& value = json[m.name];
      if (!m.sequence && m.fixed == 0) {
        value = one(m.type, at);
        continue;
      }
      const size_t count = m.sequence ? take<uint32_t>(at) : m.fixed;
      require(count <= at.bytes.size(), "a sequence that is cut off");
      value = Json::array();
      for (size_t i = 0; i < count; ++i) value.push_back(one(m.type, at));
    }
    return json;
  }

  std::map<std::string, std::vector<Member>> schemas_;
};

}  // namespace takt::test
