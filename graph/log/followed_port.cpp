// SPDX-License-Identifier: Apache-2.0
#include "graph/log/followed_port.hpp"

#include "rt/record/packed_message.hpp"

namespace takt::log {

FollowedPort::FollowedPort(const nlohmann::ordered_json& described, const graph::MessageTypes& types) {
  auto read = RecordedType::read({.name = "takt." + described.value("type", ""),
                                  .encoding = {},
                                  .data = described.value("layout", nlohmann::ordered_json()).dump()});
  if (!read) return;
  recorded.emplace(std::move(*read));
  const auto& size = described.at("capacity");
  capacity = {size.at(0), size.at(1), size.at(2), size.at(3)};
  const auto known = types.find(recorded->name());
  if (known == types.end() || !recorded->is(*known->second)) return;
  type = known->second;
  memory = aligned_bytes(type->bytes(capacity));
}

bool FollowedPort::fill(std::span<const std::byte> packed) {
  if (type == nullptr) return false;
  type->place(memory.get(), capacity);
  return record::unpack(*type, packed, memory.get()) && type->sound(memory.get());
}

}  // namespace takt::log
