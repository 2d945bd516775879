#include "tools/mantle/process.h"

#include <gtest/gtest.h>
#include <sys/resource.h>
#include <unistd.h>

#include <cstdlib>
#include <cstring>
#include <memory>
#include <string>

namespace mantle::tools {
namespace {

TEST(Process, BlasGetsOneThreadUnlessTheEnvironmentAsksForMore) {
  unsetenv("OPENBLAS_NUM_THREADS");
  unsetenv("OMP_NUM_THREADS");
  UseOneBlasThread();
  EXPECT_STREQ(std::getenv("OPENBLAS_NUM_THREADS"), "1");
  EXPECT_STREQ(std::getenv("OMP_NUM_THREADS"), "1");
  setenv("OPENBLAS_NUM_THREADS", "3", 1);
  unsetenv("OMP_NUM_THREADS");
  UseOneBlasThread();
  EXPECT_STREQ(std::getenv("OPENBLAS_NUM_THREADS"), "3");
  EXPECT_EQ(std::getenv("OMP_NUM_THREADS"), nullptr);
}

TEST(Process, ARefusalToLockMemoryIsSaidWithItsCure) {
  // Without the right and without a limit to lock within, the kernel refuses.
  const rlimit none{.rlim_cur = 0, .rlim_max = 0};
  EXPECT_EXIT(
      {
        if (setrlimit(RLIMIT_MEMLOCK, &none) != 0) _exit(3);
        if (geteuid() == 0 && setuid(65534) != 0) _exit(4);
        const std::string refused = LockMemory();
        std::fputs(refused.c_str(), stderr);
        _exit(refused.empty() ? 5 : 0);
      },
      testing::ExitedWithCode(0), "could not be locked .*ulimit -l unlimited");
}

TEST(Process, FreedMemoryStaysInTheProcess) {
  EXPECT_EXIT(
      {
        LockMemory();
        // Larger than malloc's usual threshold, above which a block would go back to the kernel.
        constexpr std::size_t kBlock_bytes = 64 << 20;
        const auto touch = [] {
          const auto block = std::make_unique<char[]>(kBlock_bytes);
          std::memset(block.get(), 1, kBlock_bytes);
        };
        rusage before{};
        rusage after{};
        touch();
        getrusage(RUSAGE_SELF, &before);
        touch();
        getrusage(RUSAGE_SELF, &after);
        // 16 384 pages; some faults are other things'.
        constexpr long kFew = 1000;
        _exit(after.ru_minflt - before.ru_minflt < kFew ? 0 : 1);
      },
      testing::ExitedWithCode(0), "");
}

}  // namespace
}  // namespace mantle::tools
