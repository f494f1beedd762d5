// SPDX-License-Identifier: Apache-2.0
#include "hal/dds/raw_type.hpp"

#include <dds/ddsi/ddsi_serdata.h>
#include <dds/ddsi/ddsi_sertype.h>

#include <algorithm>
#include <cstdio>
#include <cstring>
#include <vector>

extern "C" {
#include <dds/ddsi/q_radmin.h>
}

namespace takt::dds {
namespace {

struct RawSample : ddsi_serdata {
  RawSample(const ddsi_sertype* sample_type, ddsi_serdata_kind sample_kind, size_t size) : ddsi_serdata{}, size_(size) {
    ddsi_serdata_init(this, sample_type, sample_kind);
    bytes.resize((size + 3) / 4 * 4);  // Cyclone reads up to there
  }
  static RawSample* of(ddsi_serdata* sample) { return static_cast<RawSample*>(sample); }
  static const RawSample* of(const ddsi_serdata* sample) { return static_cast<const RawSample*>(sample); }
  size_t size() const { return size_; }
  std::vector<std::byte> bytes;

 private:
  size_t size_;
};

bool same_key(const ddsi_serdata*, const ddsi_serdata*) { return true; }
uint32_t size_of(const ddsi_serdata* sample) { return static_cast<uint32_t>(RawSample::of(sample)->size()); }

ddsi_serdata* from_fragments(const ddsi_sertype* type, ddsi_serdata_kind kind, const nn_rdata* fragment, size_t size) {
  auto* sample = new RawSample(type, kind, size);
  uint32_t have = 0;
  for (; fragment != nullptr; fragment = fragment->nextfrag) {
    const auto end = std::min(fragment->maxp1, static_cast<uint32_t>(size));
    if (end <= have || fragment->min > have) continue;  // the rest of it was in the one before
    const unsigned char* payload = NN_RMSG_PAYLOADOFF(fragment->rmsg, NN_RDATA_PAYLOAD_OFF(fragment));
    std::memcpy(sample->bytes.data() + have, payload + (have - fragment->min), end - have);
    have = end;
  }
  return sample;
}

ddsi_serdata* from_pieces(const ddsi_sertype* type, ddsi_serdata_kind kind, ddsrt_msg_iovlen_t count,
                          const ddsrt_iovec_t* pieces, size_t size) {
  auto* sample = new RawSample(type, kind, size);
  size_t have = 0;
  for (size_t i = 0; i < count && have < size; ++i) {
    const size_t more = std::min<size_t>(pieces[i].iov_len, size - have);
    std::memcpy(sample->bytes.data() + have, pieces[i].iov_base, more);
    have += more;
  }
  return sample;
}

ddsi_serdata* from_key(const ddsi_sertype* type, const ddsi_keyhash*) { return new RawSample(type, SDK_KEY, 0); }
ddsi_serdata* from_sample(const ddsi_sertype* type, ddsi_serdata_kind kind, const void*) {
  return new RawSample(type, kind, 0);
}
void to_bytes(const ddsi_serdata* sample, size_t from, size_t count, void* to) {
  std::memcpy(to, RawSample::of(sample)->bytes.data() + from, count);
}
ddsi_serdata* lend(const ddsi_serdata* sample, size_t from, size_t count, ddsrt_iovec_t* to) {
  to->iov_base = const_cast<std::byte*>(RawSample::of(sample)->bytes.data() + from);
  to->iov_len = count;
  return ddsi_serdata_ref(sample);
}
void end_lending(ddsi_serdata* sample, const ddsrt_iovec_t*) { ddsi_serdata_unref(sample); }
bool to_sample(const ddsi_serdata*, void*, void**, void*) { return false; }
ddsi_serdata* to_untyped(const ddsi_serdata* sample) {
  auto* untyped = new RawSample(sample->type, SDK_KEY, 0);
  untyped->type = nullptr;
  return untyped;
}
bool untyped_to_sample(const ddsi_sertype*, const ddsi_serdata*, void*, void**, void*) { return true; }
void free_sample(ddsi_serdata* sample) { delete RawSample::of(sample); }
size_t print(const ddsi_sertype*, const ddsi_serdata* sample, char* to, size_t room) {
  return static_cast<size_t>(std::snprintf(to, room, "%u bytes", size_of(sample)));
}
void key_hash(const ddsi_serdata*, ddsi_keyhash* to, bool) { *to = {}; }

ddsi_serdata_ops sample_functions() {
  ddsi_serdata_ops ops{};
  ops.eqkey = same_key;
  ops.get_size = size_of;
  ops.from_ser = from_fragments;
  ops.from_ser_iov = from_pieces;
  ops.from_keyhash = from_key;
  ops.from_sample = from_sample;
  ops.to_ser = to_bytes;
  ops.to_ser_ref = lend;
  ops.to_ser_unref = end_lending;
  ops.to_sample = to_sample;
  ops.to_untyped = to_untyped;
  ops.untyped_to_sample = untyped_to_sample;
  ops.free = free_sample;
  ops.print = print;
  ops.get_keyhash = key_hash;
  return ops;
}

void free_type(ddsi_sertype* type) {
  ddsi_sertype_fini(type);
  delete type;
}
void zero(const ddsi_sertype*, void*, size_t) {}
void reallocate(void** samples, const ddsi_sertype*, void*, size_t, size_t count) {
  std::fill_n(samples, count, nullptr);
}
void free_samples(const ddsi_sertype*, void**, size_t, dds_free_op_t) {}
bool same_type(const ddsi_sertype*, const ddsi_sertype*) { return true; }  // names are compared by the caller
uint32_t no_hash(const ddsi_sertype*) { return 0; }

ddsi_sertype_ops type_functions() {
  ddsi_sertype_ops ops{};
  ops.version = ddsi_sertype_v0;
  ops.free = free_type;
  ops.zero_samples = zero;
  ops.realloc_samples = reallocate;
  ops.free_samples = free_samples;
  ops.equal = same_type;
  ops.hash = no_hash;
  return ops;
}

}  // namespace

ddsi_sertype* raw_type(const std::string& name) {
  static const ddsi_serdata_ops of_samples = sample_functions();
  static const ddsi_sertype_ops of_types = type_functions();
  auto* type = new ddsi_sertype{};
  ddsi_sertype_init(type, name.c_str(), &of_types, &of_samples, true);
  return type;
}

ddsi_serdata* raw_sample(const ddsi_sertype& type, std::span<const std::byte> cdr) {
  auto* sample = new RawSample(&type, SDK_DATA, cdr.size());
  std::copy(cdr.begin(), cdr.end(), sample->bytes.begin());
  return sample;
}

std::span<const std::byte> bytes_of(const ddsi_serdata& sample) {
  const RawSample* raw = RawSample::of(&sample);
  return {raw->bytes.data(), raw->size()};
}

}  // namespace takt::dds
