#pragma once

#include <string>
#include <string_view>

/// Which requests of a browser the live server answers (docs/live.md): those of its own page.
///
/// A page of another site may make the reader's browser send requests here. It can name this server
/// by its address, but then the browser tells where the request comes from (Origin,
/// Sec-Fetch-Site); or by a name of its own that it has pointed here (DNS rebinding), which then
/// stands in Host. So Host must be an address or a name of this machine, and where the browser
/// tells an origin, it must be the server's own.

namespace mantle::tools {

/// The headers that count; empty where there is none.
struct RequestHeaders {
  std::string host, origin, fetch_site;
  std::string mantle;  ///< X-Mantle, which other sites cannot set without being asked about
};

enum class RequestKind {
  kPage,    ///< the page itself: another site may link to it
  kFeed,    ///< data of the run
  kButton,  ///< changes something
};

/// Why the request is refused; empty: it is not. `host_name`: this machine's, beside localhost and
/// addresses in numbers.
std::string RequestFault(const RequestHeaders& headers, RequestKind kind,
                         std::string_view host_name);

/// Whether `address` is this machine's own loopback ("127.0.0.1", "::1", "localhost").
bool IsLoopback(std::string_view address);

}  // namespace mantle::tools
