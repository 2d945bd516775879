#pragma once

/// MANTLE_VECTOR_CLONES before a function: compiled for the baseline and for AVX2, chosen when the
/// program starts. AVX2 does not include fused multiply-add, and loops are not reassociated, so
/// that both give the same bits. Only for functions whose loops are plain arrays.

#if defined(__x86_64__) && defined(__GLIBC__) && defined(__GNUC__) && !defined(__clang__) && \
    !defined(__SANITIZE_ADDRESS__) && !defined(__SANITIZE_THREAD__)
#define MANTLE_VECTOR_CLONES __attribute__((target_clones("avx2", "default")))
#else
#define MANTLE_VECTOR_CLONES
#endif
