#pragma once

#include <cstddef>

/// @file
/// Rows of numbers in registers: the inner loop of the small dense kernels.

#define MANTLE_INLINE inline __attribute__((always_inline))

/// Compiles a function for the baseline and for AVX2, chosen when the program starts. AVX2 does not
/// include fused multiply-add, and sums are not reassociated, so that both give the same bits.
#if defined(__x86_64__) && defined(__GLIBC__) && defined(__GNUC__) && !defined(__clang__) && \
    !defined(__SANITIZE_ADDRESS__) && !defined(__SANITIZE_THREAD__)
#define MANTLE_VECTOR_CLONES __attribute__((target_clones("avx2", "default")))
#else
#define MANTLE_VECTOR_CLONES
#endif

namespace mantle::reduced {

inline constexpr int kLanes = 4;

/// `count` rounded up to whole lanes.
constexpr int Padded(int count) { return (count + kLanes - 1) / kLanes * kLanes; }

/// A row of C numbers kept in registers while multiples of rows in memory are added to it, for
/// functions marked MANTLE_VECTOR_CLONES. C is a multiple of kLanes.
template <int C>
struct Row {
  static_assert(C > 0 && C % kLanes == 0);
  typedef double Vector __attribute__((vector_size(kLanes * sizeof(double))));
  typedef double Memory
      __attribute__((vector_size(kLanes * sizeof(double)), aligned(8), may_alias));
  Vector x[C / kLanes];

  MANTLE_INLINE void Zero() {
    for (Vector& v : x) v = Vector{0.0, 0.0, 0.0, 0.0};
  }
  MANTLE_INLINE void Load(const double* from) {
    for (int i = 0; i < C / kLanes; ++i) {
      x[i] = *reinterpret_cast<const Memory*>(from + i * kLanes);
    }
  }
  MANTLE_INLINE void Add(double f, const double* from) {
    for (int i = 0; i < C / kLanes; ++i) {
      x[i] += f * *reinterpret_cast<const Memory*>(from + i * kLanes);
    }
  }
  MANTLE_INLINE void Scale(double f) {
    for (Vector& v : x) v *= f;
  }
  MANTLE_INLINE void Store(double* to) const {
    for (int i = 0; i < C / kLanes; ++i) *reinterpret_cast<Memory*>(to + i * kLanes) = x[i];
  }
};

}  // namespace mantle::reduced
