// SPDX-License-Identifier: Apache-2.0
// CUDA's runtime as far as the plug-in calls it, without a card: memory is the host's, kernels do nothing, and what is
// launched has ended at once. Calls can be made to fail.
#include "tests/cuda/shim.hpp"

#include <cuda_runtime.h>

#include <cstdlib>
#include <cstring>
#include <map>
#include <utility>

#include "nodes/cuda/captured.cuh"

extern "C" __attribute__((visibility("default"))) CudaShim takt_cuda_shim;
CudaShim takt_cuda_shim;

namespace {

bool launch_failed = false;
cudaStream_t newest_stream = nullptr;
std::map<cudaStream_t, takt::cuda::Turn*> turns;

cudaError_t last_error = cudaSuccess;

cudaError_t answer() {
  if (++takt_cuda_shim.calls != takt_cuda_shim.fail_at) return cudaSuccess;
  return last_error = cudaErrorUnknown;
}

/// Something that is given back later.
template <class T>
cudaError_t make(T* made, size_t bytes = 1) {
  if (const cudaError_t error = answer(); error != cudaSuccess) return error;
  *made = reinterpret_cast<T>(std::calloc(bytes, 1));
  ++takt_cuda_shim.live;
  return cudaSuccess;
}

template <class T>
cudaError_t give_back(T it) {
  std::free(const_cast<void*>(reinterpret_cast<const void*>(it)));
  if (it != nullptr) --takt_cuda_shim.live;
  return cudaSuccess;
}

}  // namespace

extern "C" {

cudaError_t cudaGetDeviceCount(int* count) { return *count = 1, answer(); }
cudaError_t cudaGetDeviceProperties(cudaDeviceProp* properties, int) {
  std::strcpy(properties->name, "a shim");
  return answer();
}
const char* cudaGetErrorString(cudaError_t) { return "the shim fails"; }
cudaError_t cudaGetLastError() { return std::exchange(last_error, cudaSuccess); }
cudaError_t cudaSetDevice(int) { return answer(); }
cudaError_t cudaDeviceGetAttribute(int* value, cudaDeviceAttr attribute, int) {
  *value = attribute == cudaDevAttrMaxSharedMemoryPerBlockOptin ? 96 * 1024 : 8;
  return answer();
}
cudaError_t cudaFuncSetAttribute(const void*, cudaFuncAttribute, int) { return answer(); }
cudaError_t cudaOccupancyMaxActiveBlocksPerMultiprocessorWithFlags(int* blocks, const void*, int, size_t, unsigned) {
  return *blocks = 1, answer();
}

cudaError_t cudaMalloc(void** at, size_t bytes) { return make(at, bytes); }
cudaError_t cudaFree(void* at) { return give_back(at); }
cudaError_t cudaHostAlloc(void** at, size_t bytes, unsigned) {
  const cudaError_t error = make(at, bytes);
  if (error == cudaSuccess && bytes == sizeof(takt::cuda::Turn))
    turns[newest_stream] = static_cast<takt::cuda::Turn*>(*at);
  return error;
}
cudaError_t cudaFreeHost(void* at) { return give_back(at); }
cudaError_t cudaMemset(void*, int, size_t) { return answer(); }
cudaError_t cudaMemcpy(void* to, const void* from, size_t bytes, cudaMemcpyKind) {
  std::memcpy(to, from, bytes);
  return answer();
}
cudaError_t cudaHostRegister(void*, size_t, unsigned) {
  const cudaError_t error = answer();
  takt_cuda_shim.live += error == cudaSuccess;
  return error;
}
cudaError_t cudaHostUnregister(void*) { return --takt_cuda_shim.live, cudaSuccess; }
cudaError_t cudaHostGetDevicePointer(void** on_card, void* at, unsigned) { return *on_card = at, answer(); }

cudaError_t cudaStreamCreateWithFlags(cudaStream_t* stream, unsigned) {
  const cudaError_t error = make(stream);
  if (error == cudaSuccess) newest_stream = *stream;
  return error;
}
cudaError_t cudaStreamDestroy(cudaStream_t stream) { return turns.erase(stream), give_back(stream); }
cudaError_t cudaStreamSynchronize(cudaStream_t) { return cudaSuccess; }
cudaError_t cudaStreamQuery(cudaStream_t) { return answer(); }
cudaError_t cudaStreamBeginCapture(cudaStream_t, cudaStreamCaptureMode) { return launch_failed = false, answer(); }
cudaError_t cudaStreamEndCapture(cudaStream_t, cudaGraph_t* graph) {
  if (launch_failed) return cudaErrorStreamCaptureInvalidated;
  return make(graph);
}
cudaError_t cudaGraphInstantiate(cudaGraphExec_t* runs, cudaGraph_t, unsigned long long) { return make(runs); }
cudaError_t cudaGraphUpload(cudaGraphExec_t, cudaStream_t) { return answer(); }
cudaError_t cudaGraphLaunch(cudaGraphExec_t, cudaStream_t stream) {
  const cudaError_t error = answer();
  takt::cuda::Turn& turn = *turns.at(stream);
  if (error == cudaSuccess) turn.writing = turn.written = turn.done = turn.wanted;
  return error;
}
cudaError_t cudaGraphDestroy(cudaGraph_t graph) { return give_back(graph); }
cudaError_t cudaGraphExecDestroy(cudaGraphExec_t runs) { return give_back(runs); }

// What nvcc calls for a kernel.
void** __cudaRegisterFatBinary(void*) {
  static void* binary = nullptr;
  return &binary;
}
void __cudaRegisterFatBinaryEnd(void**) {}
void __cudaUnregisterFatBinary(void**) {}
void __cudaRegisterFunction(void**, const char*, char*, const char*, int, uint3*, uint3*, dim3*, dim3*, int*) {}
unsigned __cudaPushCallConfiguration(dim3, dim3, size_t, CUstream_st*) { return 0; }
cudaError_t __cudaPopCallConfiguration(dim3*, dim3*, size_t*, void*) { return cudaSuccess; }
cudaError_t __cudaGetKernel(cudaKernel_t* kernel, const void*) { return *kernel = nullptr, cudaSuccess; }
cudaError_t __cudaLaunchKernel(cudaKernel_t, dim3, dim3, void**, size_t, cudaStream_t) {
  const cudaError_t error = answer();
  launch_failed = launch_failed || error != cudaSuccess;
  return error;
}

}  // extern "C"
