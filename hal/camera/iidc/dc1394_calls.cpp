// SPDX-License-Identifier: Apache-2.0
#include "hal/camera/iidc/dc1394_calls.hpp"

#include <dlfcn.h>

namespace takt::iidc {
namespace {

tl::expected<Dc1394Calls, std::string> load() {
  void* library = dlopen("libdc1394.so.25", RTLD_NOW | RTLD_LOCAL);
  if (library == nullptr) return tl::unexpected(std::string(dlerror()));
  Dc1394Calls calls;
#define TAKT_CALL(name)                                                       \
  calls.name = reinterpret_cast<decltype(calls.name)>(dlsym(library, #name)); \
  if (calls.name == nullptr) return tl::unexpected(std::string("libdc1394.so.25 has no " #name));
  TAKT_DC1394_CALLS(TAKT_CALL)
#undef TAKT_CALL
  return calls;
}

}  // namespace

tl::expected<const Dc1394Calls*, std::string> load_dc1394() {
  static const tl::expected<Dc1394Calls, std::string> loaded = load();
  if (!loaded) return tl::unexpected(loaded.error());
  return &*loaded;
}

}  // namespace takt::iidc
