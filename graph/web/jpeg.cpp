// SPDX-License-Identifier: Apache-2.0
#include "graph/web/jpeg.hpp"

#include <turbojpeg.h>

#include <memory>

namespace takt::web {

std::string jpeg_of(const ImageView<const uint8_t>& image, int quality) {
  if (image.width <= 0 || image.height <= 0 || (image.channels != 1 && image.channels != 3)) return "";
  struct Destroy {
    void operator()(void* compressor) const { tjDestroy(compressor); }
  };
  thread_local const std::unique_ptr<void, Destroy> compressor(tjInitCompress());
  const int sampling = image.channels == 1 ? TJSAMP_GRAY : TJSAMP_420;
  std::string file(tjBufSize(image.width, image.height, sampling), '\0');
  auto* to = reinterpret_cast<unsigned char*>(file.data());
  unsigned long bytes = file.size();
  const int failed = tjCompress2(compressor.get(), image.data, image.width, static_cast<int>(image.stride),
                                 image.height, image.channels == 1 ? TJPF_GRAY : TJPF_BGR, &to, &bytes, sampling,
                                 quality, TJFLAG_NOREALLOC | TJFLAG_FASTDCT);
  if (failed != 0) return "";
  file.resize(bytes);
  return file;
}

}  // namespace takt::web
