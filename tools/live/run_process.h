#pragma once

#include <sys/types.h>

#include <optional>
#include <string>
#include <vector>

#include "tools/mantle/telemetry.h"

/// Runs in processes of their own, stopped as Ctrl-C stops them: drives stopped, outputs kept.

namespace mantle::tools {

/// `mantle run` as a child, under a small process that waits with it: where this process ends
/// first, whatever the reason, a pipe says so, and the run is stopped (SIGINT, once).
class RunProcess {
 public:
  /// `arguments` of this program. Throws CannotGoOn where the system starts no process.
  explicit RunProcess(const std::vector<std::string>& arguments);
  /// Stops the run and waits for it.
  ~RunProcess();
  RunProcess(const RunProcess&) = delete;
  RunProcess& operator=(const RunProcess&) = delete;

  /// Its exit status (128 + N where signal N ended it) once it has ended.
  std::optional<int> Poll();
  /// Once, whoever asks how often: a second signal would end it at once.
  void Stop();
  /// Waits for its end; its exit status.
  int Wait();

 private:
  std::optional<int> Collect(int flags);

  pid_t waiter_;
  int pipe_{-1};  ///< closed: the run is stopped
  std::optional<int> status_;
};

/// Stops the run that a session names, where it runs on this machine and is of this program. The
/// system allows it for runs of the same user alone. Empty: done; else why not.
std::string StopSession(const SessionTelemetry& session);
/// Why StopSession would refuse at once, without the system's word; empty: it may be tried.
std::string CannotStop(const SessionTelemetry& session);

}  // namespace mantle::tools
