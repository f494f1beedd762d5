// SPDX-License-Identifier: Apache-2.0
#include <unistd.h>

#include <cstdio>
#include <cstdlib>
#include <sstream>

#include "bench/peers/medium.hpp"
#include "rt/shm/iceoryx_transport.hpp"

namespace takt::bench {
namespace {

[[maybe_unused]] bool program_installed(const std::string& name) {
  const char* path = std::getenv("PATH");
  std::istringstream folders(path != nullptr ? path : "");
  for (std::string folder; std::getline(folders, folder, ':');)
    if (access((folder + "/" + name).c_str(), X_OK) == 0) return true;
  return false;
}

std::vector<Peer> known() {
  Peer zeromq{"zeromq", "libzmq3-dev"}, cyclone{"cyclonedds", "cyclonedds-dev cyclonedds-tools"},
      ros{"roscpp", "libroscpp-dev libstd-msgs-dev python3-rosmaster"}, tbb{"onetbb", "libtbb-dev"};
#ifdef TAKT_BENCH_ZEROMQ
  zeromq.processes = make_zeromq_ipc;
  zeromq.threads = make_zeromq_inproc;
  zeromq.installed = true;
#endif
#ifdef TAKT_BENCH_CYCLONEDDS
  cyclone.processes = make_cyclonedds;
  cyclone.installed = true;
#endif
#ifdef TAKT_BENCH_ROSCPP
  ros.installed = program_installed("rosmaster");
  if (ros.installed) ros.processes = make_roscpp;
#endif
#ifdef TAKT_BENCH_ONETBB
  tbb.installed = true;
#endif
  return {zeromq, cyclone, ros, tbb};
}

}  // namespace

std::vector<Peer> peers() {
  static const std::vector<Peer> list = [] {
    for (const Peer& peer : known())
      if (!peer.installed)
        std::fprintf(stderr, "peer %s: not installed; apt-get install %s\n", peer.name.c_str(), peer.package.c_str());
    return known();
  }();
  return list;
}

std::vector<PortPlan> serve(std::span<const std::unique_ptr<Medium>> media, std::vector<PortPlan> all) {
  std::vector<size_t> starts;
  for (const auto& medium : media) {
    starts.push_back(all.size());
    for (const PortPlan& pool : medium->pools()) all.push_back(pool);
  }
  for (size_t i = 0; i < media.size(); ++i) media[i]->served(all, starts[i], iceoryx_domain(getpid()));
  return all;
}

}  // namespace takt::bench
