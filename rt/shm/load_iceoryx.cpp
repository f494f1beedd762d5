// SPDX-License-Identifier: Apache-2.0
#include <dlfcn.h>

#include <array>
#include <filesystem>

#include "rt/abi.hpp"
#include "rt/shm/iceoryx/component.hpp"
#include "rt/shm/iceoryx_transport.hpp"
#include "rt/shm/transport_error.hpp"

namespace takt {
namespace {

constexpr const char* kFile = "libtakt_iceoryx.so";

const IceoryxComponent* load() {
  Dl_info core{};
  dladdr(reinterpret_cast<const void*>(&version), &core);
  // The loader may have found the library through /lib, which is a link to /usr/lib: libexec is beside the latter alone.
  const std::filesystem::path beside = std::filesystem::weakly_canonical(core.dli_fname).parent_path();
  const std::array places{beside / kFile, (beside / TAKT_LIBEXEC_FROM_LIB / kFile).lexically_normal()};
  for (const auto& file : places) {
    if (std::error_code ignored; !std::filesystem::exists(file, ignored)) continue;
    void* const module = dlopen(file.c_str(), RTLD_NOW | RTLD_LOCAL);
    if (module == nullptr)
      throw TransportError(file.string() + " cannot be loaded: " + dlerror() +
                           "\n  fix: install libiceoryx-posh2, or run with --transport local");
    const auto* const component = static_cast<const IceoryxComponent*>(dlsym(module, "takt_iceoryx"));
    if (component == nullptr || component->abi != std::string_view(kAbi))
      throw TransportError(file.string() + " is of another build than libtakt_core: " +
                           (component == nullptr ? "it has no takt_iceoryx" : abi_difference(component->abi, kAbi)) +
                           "\n  fix: install both from one build, or run with --transport local");
    return component;
  }
  throw TransportError("the iceoryx transport is not installed: there is neither " + places[0].string() + " nor " +
                       places[1].string() +
                       "\n  fix: build and install the target takt_iceoryx, or run with --transport local");
}

/// Loaded at the first use, and again at the next one if that failed.
const IceoryxComponent& component() {
  static const IceoryxComponent* const loaded = load();
  return *loaded;
}

}  // namespace

std::string iceoryx_runtime_prefix(int pid) { return "takt-" + std::to_string(pid) + "-"; }

std::string iceoryx_domain(int daemon_pid) { return "graph-" + std::to_string(daemon_pid); }

std::unique_ptr<Transport> make_iceoryx_transport(std::span<const PortPlan> ports) { return component().make(ports); }

std::unique_ptr<Transport> join_iceoryx_transport(std::span<const PortPlan> ports, const std::string& domain) {
  return component().join(ports, domain);
}

}  // namespace takt
