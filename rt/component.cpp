// SPDX-License-Identifier: Apache-2.0
#include "rt/component.hpp"

#include <dlfcn.h>

#include <array>
#include <filesystem>
#include <stdexcept>

#include "rt/abi.hpp"

namespace takt {

const void* find_component(const char* name, const char* entry, const std::string& fix) {
  Dl_info core{};
  dladdr(reinterpret_cast<const void*>(&version), &core);
  // The loader may have found the library through /lib, which is a link to /usr/lib: libexec is beside the latter
  // alone.
  const std::filesystem::path beside = std::filesystem::weakly_canonical(core.dli_fname).parent_path();
  const std::array places{beside / name, (beside / TAKT_LIBEXEC_FROM_LIB / name).lexically_normal()};
  for (const auto& file : places) {
    if (std::error_code ignored; !std::filesystem::exists(file, ignored)) continue;
    void* const module = dlopen(file.c_str(), RTLD_NOW | RTLD_LOCAL);
    if (module == nullptr)
      throw std::runtime_error(file.string() + " cannot be loaded: " + dlerror() + "\n  fix: " + fix);
    const void* const component = dlsym(module, entry);
    const char* const abi = component == nullptr ? nullptr : *static_cast<const char* const*>(component);
    if (abi == nullptr || abi != std::string_view(kAbi))
      throw std::runtime_error(file.string() + " is of another build than libtakt_core: " +
                               (abi == nullptr ? std::string("it has no ") + entry : abi_difference(abi, kAbi)) +
                               "\n  fix: " + fix);
    return component;
  }
  throw std::runtime_error("there is neither " + places[0].string() + " nor " + places[1].string() + "\n  fix: " + fix);
}

}  // namespace takt
