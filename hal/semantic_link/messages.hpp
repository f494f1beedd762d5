// SPDX-License-Identifier: Apache-2.0
// What the link carries: the messages of the semantic robot, packed by their descriptors as in a record, and those of
// the conversation itself. Pure functions over bytes.
#pragma once
#include <array>
#include <cstddef>
#include <optional>
#include <span>
#include <string_view>
#include <vector>

#include "hal/semantic_link/packet.hpp"
#include "rt/memory/aligned_bytes.hpp"
#include "rt/msg/field.hpp"

namespace takt::semantic_link {

/// Which way a message goes.
enum class Way : uint8_t { to_client, to_server };
constexpr Way opposite(Way way) { return way == Way::to_client ? Way::to_server : Way::to_client; }

struct MessageKind {
  Kind kind;
  std::string_view name;
  const MessageType* type;
  Capacity capacity;  ///< of the largest that is carried
  Way way;
  bool lasting;  ///< holds until the next one: repeated until then, so that a lost one comes all the same
};

constexpr size_t kMessageKinds = 8;
constexpr size_t index_of(Kind kind) { return static_cast<size_t>(kind) - static_cast<size_t>(Kind::objects); }
/// By index_of().
std::span<const MessageKind, kMessageKinds> message_kinds();
const MessageKind& info_of(Kind kind);

/// Bytes of the largest message of a kind.
size_t most_bytes(const MessageKind& info);

/// A hash of everything that the descriptors say of these messages: two ends understand each other if it is equal.
uint64_t layout();

/// A message of its kind's capacity in memory of its own.
class Placed {
 public:
  explicit Placed(const MessageKind& info);
  void* get() { return memory_.get(); }
  template <class T>
  T& as() {
    return *reinterpret_cast<T*>(memory_.get());
  }

 private:
  AlignedBytes memory_;
};

/// Appends the message's bytes; false, and nothing appended, if it is larger than its kind may be.
bool write_message(const MessageKind& info, const void* message, std::vector<std::byte>& to);

/// Any bytes: fills the placed message, whose arrays have the room of the kind's capacity. On a fault it is of no use.
tl::expected<void, Fault> read_message(const MessageKind& info, std::span<const uint8_t> bytes, void* message);

/// Who wants to be the client of which robot.
struct Hello {
  std::array<char, 32> robot{};  ///< ended by 0
  uint64_t nonce = 0;            ///< drawn by the client: an answer that has it answers this
  uint64_t layout = 0;
};
struct Welcome {
  uint64_t nonce = 0;
  int64_t sent_ns = 0, heard_ns = 0;  ///< of the hello: client's clock, server's clock
};
enum class Reason : uint8_t { unknown_robot = 1, taken = 2, other_messages = 3 };
struct RefusalNote {
  uint64_t nonce = 0;
  Reason reason = Reason::taken;
};
/// Of the newest `alive` or `welcome` of the other end; sent_ns 0: there was none yet.
struct Alive {
  int64_t sent_ns = 0, heard_ns = 0;
};

/// Bytes of each, and back; nothing unless they are exactly that.
constexpr size_t kLargestNote = 48;
size_t write_note(const Hello& note, std::span<uint8_t> into);
size_t write_note(const Welcome& note, std::span<uint8_t> into);
size_t write_note(const RefusalNote& note, std::span<uint8_t> into);
size_t write_note(const Alive& note, std::span<uint8_t> into);
std::optional<Hello> read_hello(std::span<const uint8_t> bytes);
std::optional<Welcome> read_welcome(std::span<const uint8_t> bytes);
std::optional<RefusalNote> read_refusal(std::span<const uint8_t> bytes);
std::optional<Alive> read_alive(std::span<const uint8_t> bytes);

}  // namespace takt::semantic_link
