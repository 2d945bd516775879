#pragma once

#include <string>

/// How the process uses threads and memory: a closed loop shall give the same bits on every run,
/// and in real time shall not wait for the kernel's memory.

namespace mantle::tools {

/// One thread for the BLAS that the solver calls, unless the environment asks for another number
/// (OPENBLAS_NUM_THREADS, OMP_NUM_THREADS): sums over several come in changing order. Call it
/// before any other thread exists.
void UseOneBlasThread();

/// Keeps freed memory in the process (no mapped blocks, no trimming: the solver allocates on every
/// solve), then locks what there is and will be into RAM. Returns what the system refused,
/// empty where nothing.
std::string LockMemory();

}  // namespace mantle::tools
