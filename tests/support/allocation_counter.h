#pragma once

#include <cstddef>

/// Counts calls of the C allocator, and so of operator new and of Eigen, by interposing it. Include
/// in one file of a test program. Under a sanitizer, or on a C library that does not export its own
/// allocator by another name, nothing is counted and kCountsAllocations is false.

#if defined(__GLIBC__) && !defined(__SANITIZE_ADDRESS__) && !defined(__SANITIZE_THREAD__)
#include <atomic>

namespace mantle::tests {
inline constexpr bool kCountsAllocations = true;
inline std::atomic<long> allocation_count{0};
}  // namespace mantle::tests

extern "C" {
void* __libc_malloc(std::size_t size);
void* __libc_calloc(std::size_t count, std::size_t size);
void* __libc_realloc(void* pointer, std::size_t size);
void* __libc_memalign(std::size_t alignment, std::size_t size);

void* malloc(std::size_t size) {
  ++mantle::tests::allocation_count;
  return __libc_malloc(size);
}
void* calloc(std::size_t count, std::size_t size) {
  ++mantle::tests::allocation_count;
  return __libc_calloc(count, size);
}
void* realloc(void* pointer, std::size_t size) {
  ++mantle::tests::allocation_count;
  return __libc_realloc(pointer, size);
}
void* aligned_alloc(std::size_t alignment, std::size_t size) {
  ++mantle::tests::allocation_count;
  return __libc_memalign(alignment, size);
}
}
#else
namespace mantle::tests {
inline constexpr bool kCountsAllocations = false;
inline long allocation_count{0};
}  // namespace mantle::tests
#endif
