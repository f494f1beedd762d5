// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "hal/semantic_link/link_end.hpp"

namespace takt::semantic_link {

/// The client of one robot: asks the server for it every kHello_ns until it is welcomed, and again when the session is
/// over.
class Client final : public LinkEnd {
 public:
  static constexpr int64_t kHello_ns = 100'000'000;
  /// `robot`: at most 31 characters.
  Client(std::unique_ptr<DatagramPort> port, const Key& key, std::string_view robot, const Clock& clock);
  Exchange& exchange() { return exchange_; }
  void say_farewell() override;

 private:
  void take(const Packet& packet, Peer from, int64_t now_ns) override;
  int64_t send_due(int64_t now_ns) override;
  void port_changed(bool open) override;
  void search();

  Exchange exchange_;
  Session session_{Way::to_client, exchange_};
  Hello hello_;
  int64_t hello_ns_ = 0;
  const char* trouble_ = "";
};

}  // namespace takt::semantic_link
