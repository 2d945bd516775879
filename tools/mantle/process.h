#pragma once

#include <string>

/// How the process uses threads and memory: a closed loop shall give the same bits on every run,
/// and in real time shall not wait for the kernel's memory.

namespace mantle::tools {

/// One thread for the BLAS that the solver calls, unless the environment asks for another number
/// (OPENBLAS_NUM_THREADS, OMP_NUM_THREADS): sums over several come in changing order. Call it
/// before any other thread exists.
void UseOneBlasThread();

/// Keeps freed memory in the process (no blocks mapped alone, no trimming): Ipopt and MUMPS
/// allocate on every solve, and pages that go back to the kernel are faulted in again by the next.
/// Call it before anything large is allocated.
void KeepFreedMemory();

/// Locks what memory there is and will be into RAM. Returns what the system refused, empty where
/// nothing.
std::string LockMemory();

}  // namespace mantle::tools
