#include "tools/live/request_check.h"

#include <arpa/inet.h>
#include <fmt/format.h>

#include <algorithm>
#include <cctype>

namespace mantle::tools {
namespace {

bool IsAddress(const std::string& name) {
  unsigned char bytes[16];
  return inet_pton(AF_INET, name.c_str(), bytes) == 1 ||
         inet_pton(AF_INET6, name.c_str(), bytes) == 1;
}

bool SameName(std::string_view a, std::string_view b) {
  return std::equal(a.begin(), a.end(), b.begin(), b.end(), [](unsigned char x, unsigned char y) {
    return std::tolower(x) == std::tolower(y);
  });
}

// The name of "NAME:PORT", "[ADDRESS]:PORT" or either without port; empty where it is neither.
std::string NameOf(const std::string& host) {
  const bool bracketed = host.starts_with('[');
  const std::size_t end = bracketed ? host.find(']') : host.find(':');
  if (bracketed && end == host.npos) return {};
  const std::string name = bracketed ? host.substr(1, end - 1) : host.substr(0, end);
  const std::size_t behind = bracketed ? end + 1 : end;
  if (behind == host.npos || behind == host.size()) return name;
  const std::string port = host.substr(behind + 1);
  const bool digits =
      !port.empty() && port.size() <= 5 &&
      std::all_of(port.begin(), port.end(), [](unsigned char c) { return std::isdigit(c) != 0; });
  return host[behind] == ':' && digits ? name : std::string();
}

}  // namespace

std::string RequestFault(const RequestHeaders& headers, RequestKind kind,
                         std::string_view host_name) {
  const std::string name = NameOf(headers.host);
  if (!IsAddress(name) && !SameName(name, "localhost") &&
      (host_name.empty() || !SameName(name, host_name))) {
    return "Host must be an address, localhost or this machine's name";
  }
  if (kind == RequestKind::kPage) return {};
  if (!headers.origin.empty() && headers.origin != "http://" + headers.host) {
    return "Origin must be this server's own page";
  }
  if (!headers.fetch_site.empty() && headers.fetch_site != "same-origin" &&
      headers.fetch_site != "none") {
    return "Sec-Fetch-Site must be same-origin";
  }
  if (kind == RequestKind::kButton && headers.mantle != "live") {
    return "X-Mantle must be live";
  }
  return {};
}

bool IsLoopback(std::string_view address) {
  return address.starts_with("127.") || address == "::1" || address == "localhost";
}

}  // namespace mantle::tools
