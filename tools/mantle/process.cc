#include "tools/mantle/process.h"

#include <dlfcn.h>
#include <fmt/format.h>
#include <malloc.h>
#include <sys/mman.h>

#include <cerrno>
#include <climits>
#include <cstdlib>
#include <cstring>

namespace mantle::tools {

void UseOneBlasThread() {
  const bool set =
      std::getenv("OPENBLAS_NUM_THREADS") != nullptr || std::getenv("OMP_NUM_THREADS") != nullptr;
  if (set) return;
  setenv("OPENBLAS_NUM_THREADS", "1", 0);
  setenv("OMP_NUM_THREADS", "1", 0);
  // OpenBLAS and OpenMP read the environment when they are loaded, which is before main.
  for (const char* name : {"openblas_set_num_threads", "omp_set_num_threads"}) {
    if (void* function = dlsym(RTLD_DEFAULT, name)) reinterpret_cast<void (*)(int)>(function)(1);
  }
}

void KeepFreedMemory() {
  mallopt(M_MMAP_MAX, 0);  // a threshold of mmap above 32 MiB would be refused
  mallopt(M_TRIM_THRESHOLD, INT_MAX);
}

std::string LockMemory() {
  if (mlockall(MCL_CURRENT | MCL_FUTURE) == 0) return {};
  return fmt::format(
      "memory could not be locked ({}): page faults may delay the loop; allow it by "
      "`ulimit -l unlimited`",
      std::strerror(errno));
}

}  // namespace mantle::tools
