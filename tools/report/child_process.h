#pragma once

#include <sys/types.h>

#include <filesystem>
#include <string>
#include <vector>

/// Other programs that an export needs.

namespace mantle::tools {

/// The first of these programs that is in PATH; empty: none.
std::filesystem::path FindProgram(const std::vector<std::string>& names);

/// A program as a child, with ends of pipes as descriptors of its own; killed at the end if it
/// still runs, and what it started with it.
class ChildProcess {
 public:
  /// `descriptors[i]` of this process becomes the child's i-th of `as`; what it says otherwise
  /// goes to the file `log`. Throws CannotGoOn where the system starts no process.
  ChildProcess(const std::filesystem::path& program, const std::vector<std::string>& arguments,
               const std::vector<int>& descriptors, const std::vector<int>& as,
               const std::filesystem::path& log);
  ~ChildProcess();
  ChildProcess(const ChildProcess&) = delete;
  ChildProcess& operator=(const ChildProcess&) = delete;

  /// Waits for its end; its exit status, 128 + N where signal N ended it.
  int Wait();

 private:
  pid_t process_;
};

}  // namespace mantle::tools
