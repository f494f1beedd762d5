// SPDX-License-Identifier: Apache-2.0
#include "nodes/cuda/card.hpp"

#include <array>
#include <stdexcept>

#include "rt/component.hpp"

namespace takt::cuda {
namespace {

constexpr int kDriverTooOld = 35, kNoCard = 100;  // cudaErrorInsufficientDriver, cudaErrorNoDevice

std::string no_card(int error, const char* why) {
  std::string text = std::string("there is no card: ") + why;
  if (error == kDriverTooOld)
    text += "\n  fix: a driver from NVIDIA for CUDA 13, 580 or later (Debian 12 has 535, which is too old)";
  if (error == kNoCard) text += "\n  fix: none that Takt knows of; nvidia-smi lists the cards that the driver sees";
  return text;
}

}  // namespace

tl::expected<Card, std::string> find_card(int index) {
  try {
    static const auto& cuda = load_component<Table>("libtakt_cuda.so", "takt_cuda",
                                                    "build with nvcc and -DTAKT_CUDA=ON; or leave out `accelerator`");
    std::array<char, kWhyBytes> text{};
    const int count = cuda.cards(text.data());
    if (count <= 0) return tl::unexpected(no_card(-count, count == 0 ? "CUDA finds none" : text.data()));
    if (index < 0 || index >= count)
      return tl::unexpected("there is no card " + std::to_string(index) + "; cards: 0 to " + std::to_string(count - 1));
    cuda.card_name(index, text.data());
    return Card{&cuda, index, text.data()};
  } catch (const std::runtime_error& error) {
    return tl::unexpected(error.what());
  }
}

}  // namespace takt::cuda
