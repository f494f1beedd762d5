// SPDX-License-Identifier: Apache-2.0
#include "rt/image_file/image_file.hpp"

#include <algorithm>
#include <array>
#include <bit>
#include <cctype>
#include <cstdint>
#include <cstring>
#include <fstream>
#include <opencv2/imgcodecs.hpp>
#include <string>

#include "rt/file/input_file.hpp"

namespace takt {
namespace {

constexpr int kMostBits = 16;
constexpr uint64_t kMostEdge = 1 << 20;   ///< px
constexpr uint64_t kMostDeflated = 1100;  ///< times its size in the file, as deflate packs

/// What the head of a file says; 0: it does not.
struct Head {
  uint64_t width = 0, height = 0;
  uint32_t largest = 0;      ///< of PGM, PPM
  bool binary = false;       ///< of PGM, PPM: OpenCV scales text, and not this, to 255
  int significant = 0;       ///< sBIT of PNG
  uint64_t least_bytes = 0;  ///< that such a picture takes in a file
};

uint32_t big_endian(const unsigned char* bytes) {
  return static_cast<uint32_t>(bytes[0]) << 24 | static_cast<uint32_t>(bytes[1]) << 16 |
         static_cast<uint32_t>(bytes[2]) << 8 | bytes[3];
}

/// The numbers behind the magic; a `#` begins a comment up to the end of its line.
Head pnm_head(std::istream& in, char kind) {
  in.seekg(2);
  const auto number = [&in] {
    for (int c = in.peek(); c == '#' || std::isspace(c) != 0; c = in.peek()) {
      std::string comment;
      if (c == '#') std::getline(in, comment);
      else in.get();
    }
    uint32_t value = 0;
    in >> value;
    return in ? value : 0;
  };
  Head head;
  head.width = number();
  head.height = number();
  head.largest = number();
  head.binary = kind >= '5';
  const bool colour = kind == '3' || kind == '6';
  const uint64_t values = std::min(head.width, kMostEdge) * std::min(head.height, kMostEdge) * (colour ? 3 : 1);
  head.least_bytes = values * (head.binary && head.largest > 255 ? 2 : 1);
  return head;
}

/// Size and sBIT, which stands before the data.
Head png_head(std::istream& in) {
  Head head;
  std::array<unsigned char, 8> start{};
  in.seekg(8);
  while (in.read(reinterpret_cast<char*>(start.data()), 8)) {
    const uint32_t length = big_endian(start.data());
    const std::string_view name(reinterpret_cast<const char*>(start.data()) + 4, 4);
    if (name == "IDAT" || name == "IEND") break;
    std::array<unsigned char, 8> data{};
    const std::streamoff behind = std::streamoff(in.tellg()) + static_cast<std::streamoff>(length) + 4;
    in.read(reinterpret_cast<char*>(data.data()), std::min<std::streamsize>(length, 8));
    if (name == "IHDR") head.width = big_endian(data.data()), head.height = big_endian(data.data() + 4);
    if (name == "sBIT") head.significant = *std::max_element(data.begin(), data.begin() + std::min(length, 4U));
    in.clear();
    in.seekg(behind);
  }
  head.least_bytes = std::min(head.width, kMostEdge) * std::min(head.height, kMostEdge) / 8 / kMostDeflated;
  return head;
}

[[noreturn]] void refuse(const std::filesystem::path& file, const std::string& what) {
  throw ImageError(file.string() + ": " + what);
}

constexpr std::string_view kPng = "\x89PNG\r\n\x1a\n";

/// OpenCV tries every decoder that it has, and a damaged file ends the process in one of them (DICOM's).
bool known(std::string_view start) {
  using namespace std::string_view_literals;
  constexpr std::array kStarts{kPng, "\xff\xd8\xff"sv, "BM"sv, "II*\0"sv, "MM\0*"sv};
  // As its own decoders of these want them.
  const bool pnm = start[0] == 'P' && "123456Ff"sv.find(start[1]) != std::string_view::npos &&
                   std::isspace(static_cast<unsigned char>(start[2])) != 0;
  return pnm || std::any_of(kStarts.begin(), kStarts.end(), [&](auto begin) { return start.starts_with(begin); });
}

Head head_of(const std::filesystem::path& file) {
  require_readable<ImageError>(file, kLargestInput);
  std::ifstream in(file, std::ios::binary);
  std::array<char, 8> start{};
  in.read(start.data(), start.size());
  const std::string_view magic(start.data(), start.size());
  if (!known(magic)) refuse(file, "is no image of a known kind: PNG, JPEG, PGM, PPM, PBM, PFM, BMP, TIFF");
  if (magic == kPng) return png_head(in);
  in.clear();
  const bool has_maxval = magic[0] == 'P' && std::string_view("2356").find(magic[1]) != std::string_view::npos;
  return has_maxval ? pnm_head(in, magic[1]) : Head{};
}

cv::Mat decode(const std::filesystem::path& file, int mode, const Head& head) {
  const std::string claim =
      head.width > 0 ? " (its head says " + std::to_string(head.width) + " x " + std::to_string(head.height) + " px)"
                     : "";
  std::error_code failed;
  if (const auto size = std::filesystem::file_size(file, failed); !failed && size < head.least_bytes)
    refuse(file, "is too short for what it claims, " + std::to_string(size) + " bytes" + claim);
  cv::Mat image;
  try {
    image = cv::imread(file.string(), mode);
  } catch (const std::exception&) {  // OpenCV's text names its own source
    refuse(file, "is larger than can be read, or damaged" + claim);
  }
  if (image.empty()) refuse(file, "cannot be read or is no image" + claim);
  return image;
}

cv::Mat whole(const std::filesystem::path& file, cv::Mat image) {
  if (image.depth() != CV_8U && image.depth() != CV_16U)
    refuse(file, "has values that are no whole numbers of 8 or 16 bits; convert it to PGM or PNG");
  return image;
}

struct Values {
  uint32_t brightest = 0, all = 0;  ///< the largest one; all ORed
};

Values values_of(const cv::Mat& image) {
  Values values;
  for (int y = 0; y < image.rows; ++y) {
    const auto* row = image.ptr<uint16_t>(y);
    for (int x = 0; x < image.cols * image.channels(); ++x) {
      values.brightest = std::max<uint32_t>(values.brightest, row[x]);
      values.all |= row[x];
    }
  }
  return values;
}

/// The value that becomes 255.
uint32_t largest_value(const std::filesystem::path& file, const cv::Mat& image, const Head& head, int bits) {
  const Values values = values_of(image);
  const auto of_bits = [](int n) { return (1U << static_cast<unsigned>(n)) - 1; };
  if (bits > 0) {
    if (values.brightest > of_bits(bits))
      refuse(file, "its brightest value is " + std::to_string(values.brightest) + ", which has more than " +
                       std::to_string(bits) + " bits");
    return of_bits(bits);
  }
  if (head.largest > 0) return head.largest;
  if (head.significant > 0 && head.significant < kMostBits) {
    // The format wants the significant bits on top, and cameras write them at the bottom.
    const bool on_top =
        (values.all & of_bits(kMostBits - head.significant)) == 0 || values.brightest > of_bits(head.significant);
    return on_top ? of_bits(kMostBits) : of_bits(head.significant);
  }
  const auto used = static_cast<int>(std::bit_width(values.brightest));
  if (used == kMostBits || used == 0 || head.significant == kMostBits) return of_bits(kMostBits);
  refuse(file, "16-bit image, brightest value " + std::to_string(values.brightest) +
                   ", and the file does not say how many bits count: say `bits: " + std::to_string(std::max(used, 8)) +
                   "`, or store it as PGM with maxval or as PNG with sBIT");
}

}  // namespace

cv::Mat read_image(const std::filesystem::path& file, Channels channels, int bits) {
  const Head head = head_of(file);
  const int mode = channels == Channels::grey     ? cv::IMREAD_GRAYSCALE
                   : channels == Channels::colour ? cv::IMREAD_COLOR
                                                  : cv::IMREAD_ANYCOLOR;
  cv::Mat image = whole(file, decode(file, mode | cv::IMREAD_ANYDEPTH, head));
  if (image.depth() == CV_8U) {
    if (head.binary && head.largest > 0 && head.largest < 255) image.convertTo(image, CV_8U, 255.0 / head.largest);
    return image;
  }
  // Grey is darker than the brightest colour: what the values need is seen in the colours.
  const cv::Mat as_stored = channels == Channels::grey && bits == 0 && head.largest == 0
                                ? decode(file, cv::IMREAD_ANYCOLOR | cv::IMREAD_ANYDEPTH, head)
                                : image;
  image.convertTo(image, CV_8U, 255.0 / largest_value(file, as_stored, head, bits));
  return image;
}

cv::Mat read_values(const std::filesystem::path& file) {
  return whole(file, decode(file, cv::IMREAD_UNCHANGED, head_of(file)));
}

cv::Mat1f read_floats(const std::filesystem::path& file) {
  cv::Mat image = decode(file, cv::IMREAD_UNCHANGED, head_of(file));
  if (image.type() != CV_32FC1) refuse(file, "is no PFM of one channel");
  return image;
}

}  // namespace takt
