#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <string_view>

/// The small HTTP server of `mantle live`: the page, its data as server-sent events, its buttons.
/// One source file (live_server.cc) includes the library behind it.

namespace mantle::tools {

struct LiveServerOptions {
  std::string address{"127.0.0.1"};
  int port{0};           ///< 0: one that is free
  int most_viewers{16};  ///< at the same time; further ones are turned away (503)
  bool buttons{true};    ///< whether requests may change something
};

/// What the server asks of its owner, from threads of its own.
struct LiveSource {
  /// The page, text/html.
  std::function<std::string()> page;
  /// What is newer than `*seen`, as server-sent events, and sets `*seen`; waits up to `wait_ms` for
  /// it, and gives an empty text where there is nothing. A viewer that is slow gets what is newest
  /// then: nothing waits for it, or is kept for it. 0: the viewer is new.
  std::function<std::shared_ptr<const std::string>(std::uint64_t* seen, int wait_ms)> next;
  /// The button `name` was pressed; JSON. Empty: there is no such button.
  std::function<std::string(std::string_view name)> press;
  /// How many viewers there are now.
  std::function<void(int viewers)> viewers;
};

class LiveServer {
 public:
  virtual ~LiveServer() = default;  ///< closes every connection
  virtual int port() const = 0;
};

/// Listens before it returns. Throws BadInput where the address cannot be listened on.
std::unique_ptr<LiveServer> StartLiveServer(const LiveServerOptions& options, LiveSource source);

/// The function above as mantle_live.so hands it out, by `mantle_live_functions`.
struct LiveFunctions {
  std::unique_ptr<LiveServer> (*start)(const LiveServerOptions&, LiveSource);
};

}  // namespace mantle::tools
